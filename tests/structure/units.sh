#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What `make install` puts beside the programs: units that systemd takes without a word and that let
# next to nothing out, a user, directories, pages.
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

. tests/structure/_report.sh

# Where the units say, so that their programs are found.
usr=$work/usr
make --no-print-directory -s install B="$B" PREFIX="$usr" >"$work/make" 2>&1 ||
    report "make install" "$(cat "$work/make")"
installed='bin/bcd bin/bcdd lib/bcd/bcdd-backup lib/bcd/bcdd-log lib/bcd/bcd_sqlite.so
    lib/systemd/system/bcdd.service lib/systemd/system/bcdd-backup.service
    lib/systemd/system/bcdd-backup.timer lib/systemd/system/bcdd-log.service
    lib/systemd/system/bcdd-log.timer lib/sysusers.d/bcdd.conf lib/tmpfiles.d/bcdd.conf etc/default/bcdd
    share/doc/bcdd/OPERATING.md share/doc/bcdd/README.md share/doc/bcdd/changelog.md
    share/doc/bcdd/examples/nginx.conf share/doc/bcdd/examples/slurm.conf.example
    share/doc/bcdd/examples/bcdd-slurm.conf'
for file in $installed; do
    report "installed: $file" "$([ -s "$usr/$file" ] || echo missing)"
done
report "nothing is left to be filled in" "$(grep -rn '@[A-Z]*@' "$usr/lib/systemd" "$usr/etc")"

echo '#BCDD_OPTIONS="mine"' >"$usr/etc/default/bcdd"
make --no-print-directory -s install B="$B" PREFIX="$usr" >"$work/make" 2>&1
report "options of an earlier installation stay" \
    "$(grep -qx '#BCDD_OPTIONS="mine"' "$usr/etc/default/bcdd" || cat "$usr/etc/default/bcdd")"
make --no-print-directory -s install B="$B" DESTDIR="$work/dest" PREFIX=/usr >"$work/make" 2>&1
report "with PREFIX=/usr options are in /etc" "$([ -s "$work/dest/etc/default/bcdd" ] || echo "they are not")"
report "DESTDIR is nobody's path" "$(grep -rn "$work" "$work/dest/usr/lib/systemd")"

units=$usr/lib/systemd/system
if ! command -v systemd-analyze >/dev/null; then
    report "systemd-analyze is there" "deploy/install-packages.sh installs it"
fi
# Other units of this machine may have their faults.
report "systemd takes every unit" \
    "$(systemd-analyze verify --man=no --recursive-errors=no "$units"/bcdd* 2>&1 || echo "status $?")"
sed 's/^ProtectHome=.*/ProtectHome=perhaps/' "$units/bcdd.service" >"$work/bcdd.service"
report "and would not take a wrong one" \
    "$(systemd-analyze verify --man=no --recursive-errors=no "$work/bcdd.service" 2>&1 | grep -q perhaps || echo "no complaint")"
# Before a Slurm, as its drop-in makes it.
drop_in=$units/bcdd.service.d/slurm.conf
mkdir "${drop_in%/*}"
cp "$usr/share/doc/bcdd/examples/bcdd-slurm.conf" "$drop_in"
report "systemd takes what Slurm needs" \
    "$(systemd-analyze verify --man=no --recursive-errors=no "$units/bcdd.service" 2>&1 || echo "status $?")"
sed -i 's/^IPAddressAllow=.*/IPAddressAllow=anybody/' "$drop_in"
report "and looks at it" \
    "$(systemd-analyze verify --man=no --recursive-errors=no "$units/bcdd.service" 2>&1 | grep -q anybody || echo "no complaint")"
rm -r "${drop_in%/*}"
mkdir "$work/slurm"
cat "$units/bcdd.service" "$usr/share/doc/bcdd/examples/bcdd-slurm.conf" >"$work/slurm/bcdd-slurm.service"
for service in "$units"/*.service "$work/slurm/bcdd-slurm.service"; do
    score=$(systemd-analyze security --offline=true --no-pager "$service" 2>"$work/err" |
        sed -n 's/.*Overall exposure level for [^:]*: \([0-9.]*\) .*/\1/p')
    report "${service##*/} is exposed to at most 2.0 of 10 ($score)" \
        "$(echo "${score:-10}" | awk '$1 > 2.0 { print $1 }')"
done
for timer in "$units"/*.timer; do
    report "${timer##*/} has a time and its service" "$(
        when=$(sed -n 's/^OnCalendar=//p' "$timer")
        systemd-analyze calendar "$when" 2>&1 | grep -q 'Normalized form' || echo "when: $when"
        [ -e "${timer%.timer}.service" ] || echo "no service"
    )"
done
report "the user can be made" "$(
    mkdir -p "$work/root/etc"
    systemd-sysusers --root="$work/root" "$usr/lib/sysusers.d/bcdd.conf" 2>&1 | grep -i fail
    grep -q '^bcdd:.*:/var/lib/bcdd:.*nologin$' "$work/root/etc/passwd" || echo "no such user"
)"
echo "1..$count"
