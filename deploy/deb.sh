#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# deb.sh - packs the programs in $B as $B/deb/bcdd_VERSION_ARCH.deb. Debian's tools want a source tree
# with debian/ at its top: one is made below $B/deb, which holds nothing else. Version and date come from
# engine/bcd.h and deploy/changelog.md, which must agree.
set -eu
LC_ALL=C
export LC_ALL
cd "$(dirname "$0")/.."
BCD_B=${B:-build}
BCD_TOP=$PWD
export BCD_B BCD_TOP

fail() {
    echo "deb.sh: $*" >&2
    exit 1
}
version=$(sed -n 's/^#define BCD_VERSION "\(.*\)"$/\1/p' engine/bcd.h)
heading=$(grep -m 1 '^## ' deploy/changelog.md)
date=$(printf '%s\n' "$heading" | sed -n "s/^## $version (\(20[0-9-]*\))\$/\1/p")
[ -n "$date" ] || fail "the first heading of deploy/changelog.md is \"$heading\", not \"## $version (DATE)\""

out=$BCD_B/deb
rm -rf "$out"
mkdir -p "$out/bcdd-$version"
cp -r deploy/debian "$out/bcdd-$version/debian"
chmod 755 "$out/bcdd-$version/debian/rules"
mkdir "$out/bcdd-$version/debian/source"
echo "3.0 (native)" >"$out/bcdd-$version/debian/source/format"
cat >"$out/bcdd-$version/debian/changelog" <<CHANGELOG
bcdd ($version) stable; urgency=medium

  * See changelog.gz.

 -- bcdd maintainers <root@localhost>  $(date -u -R -d "$date")
CHANGELOG
unset MAKEFLAGS MFLAGS MAKELEVEL
(
    cd "$out/bcdd-$version"
    DEB_BUILD_OPTIONS="noautodbgsym nocheck" dpkg-buildpackage -b -us -uc -d >../log 2>&1
) || {
    tail -n 30 "$out/log" >&2
    fail "dpkg-buildpackage failed"
}
rm -rf "$out/bcdd-$version"
ls "$out"/*.deb
