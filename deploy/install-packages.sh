#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# install-packages.sh [long|deb] - installs what building and testing need on Debian 12 and is missing.
#
# Whether something is missing is decided by using it: command -v for programs, pkg-config for
# libraries, a file for header-only ones. When nothing is missing the script says nothing and does
# not touch the network. `long` adds what only `make check-long` needs, `deb` what `make deb` needs.
# Where Slurm cannot be had, its tests are skipped, and that is said: all else is needed.
# Services that come with a package (nginx) are neither started nor enabled.
set -eu

missing=

need_command() { # command package
    command -v "$1" >/dev/null 2>&1 || missing="$missing $2"
}

need_library() { # pkg-config module, package
    pkg-config --exists "$1" 2>/dev/null || missing="$missing $2"
}

need_header() { # header below the system's include directories, package
    [ -e "/usr/include/$1" ] || [ -e "/usr/local/include/$1" ] || missing="$missing $2"
}

# Debian's, whatever other Python there is: one test reads an export with it.
need_numpy() {
    /usr/bin/python3 -c 'import numpy' >/dev/null 2>&1 || missing="$missing python3-numpy"
}

look() {
    missing=
    need_command gcc gcc
    need_header stdio.h libc6-dev
    need_command make make
    need_command pkg-config pkg-config
    need_library libmicrohttpd libmicrohttpd-dev
    need_library jansson libjansson-dev
    need_library sqlite3 libsqlite3-dev
    need_library gsl libgsl-dev
    need_library libmd libmd-dev
    need_library libcurl libcurl4-openssl-dev
    need_library cmocka libcmocka-dev
    need_header Random123/philox.h librandom123-dev
    need_command curl curl
    need_command jq jq
    need_command sqlite3 sqlite3
    need_command mandoc mandoc
    need_command node nodejs
    need_numpy
    need_command npm npm
    need_command systemd-analyze systemd
    need_command openssl openssl
    PATH=$PATH:/usr/sbin need_command nginx nginx-light
    case ${1:-} in
    long | deb)
        need_command dh debhelper
        need_command dpkg-buildpackage dpkg-dev
        ;;
    esac
    need_command chromium chromium
    if [ "${1:-}" = long ]; then
        need_command clang clang
        need_command wrk wrk
        need_command mmdebstrap mmdebstrap
    fi
}

look_for_slurm() {
    need_command sbatch slurm-client
    PATH=$PATH:/usr/sbin need_command slurmctld slurmctld
    PATH=$PATH:/usr/sbin need_command slurmd slurmd
    PATH=$PATH:/usr/sbin need_command munged munge
    if [ "${1:-}" = long ]; then
        PATH=$PATH:/usr/sbin need_command slurmdbd slurmdbd
        PATH=$PATH:/usr/sbin need_command mariadbd mariadb-server
    fi
}

look "${1:-}"
needed=$missing
look_for_slurm "${1:-}"
[ -n "$missing" ] || exit 0

echo "install-packages: missing:$missing"
# Nothing is missing that cannot be done without.
go_without_slurm() {
    [ -z "$needed" ] || return 0
    echo "install-packages: Slurm cannot be installed here; its tests will be skipped"
    exit 0
}
if ! command -v apt-get >/dev/null 2>&1; then
    go_without_slurm
    echo "install-packages: there is no apt-get here; please install the above by hand" >&2
    exit 1
fi
as_root=
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null 2>&1; then
        go_without_slurm
        echo "install-packages: not root and no sudo; as root run: apt-get install$missing" >&2
        exit 1
    fi
    as_root=sudo
fi

# Without a pkg-config every library above looks missing; apt leaves alone what is there.
install() {
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y --no-install-recommends $missing
}
# Packages ask this file whether their service may start, and enable it for the next boot: tests want
# the program alone. A service that was there before is not touched.
policy=/usr/sbin/policy-rc.d
hold_services() {
    services=
    for service in nginx munge slurmctld slurmd slurmdbd mariadb; do
        [ -e "/lib/systemd/system/$service.service" ] || services="$services $service"
    done
    [ -z "$services" ] || [ -e "$policy" ] ||
        $as_root sh -c "printf '#!/bin/sh\nexit 101 # bcdd\n' >$policy && chmod 755 $policy"
}
let_services_go() {
    ! grep -qs '# bcdd$' "$policy" || $as_root rm -f "$policy"
    for service in $services; do
        $as_root rm -f "/etc/systemd/system/multi-user.target.wants/$service.service"
    done
}
fail() {
    echo "install-packages: apt-get could not install:$missing" >&2
    exit 1
}
echo "install-packages: ${as_root:+$as_root }apt-get install$missing"
log=$(mktemp)
hold_services
trap 'let_services_go; rm -f "$log"' EXIT
# A fresh machine has no package lists, an old one stale lists: fetch them only when needed.
if ! install >"$log" 2>&1; then
    echo "install-packages: ${as_root:+$as_root }apt-get update"
    { $as_root apt-get update && install; } >"$log" 2>&1 || {
        go_without_slurm
        missing=$needed
        install >>"$log" 2>&1
    } || {
        cat "$log" >&2
        fail
    }
fi

look "${1:-}"
[ -z "$missing" ] || {
    cat "$log" >&2
    fail
}
echo "install-packages: done"
