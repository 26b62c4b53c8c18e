#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The papers' scenes are jobs this program accepts, shortened and full, and say what their names say.
set -u
B=${B:-build}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
set -- tests/scenes/*.json tests/scenes/full/*.json
echo "1..$(($# + 1))"
count=0
for file; do
    count=$((count + 1))
    diameter=$(expr "$file" : '.*-sigma\([0-9.]*\)-')
    density=$(expr "$file" : '.*-rho\([0-9.]*\)\.json')
    if "$B/bcd" check "$file" >"$work/out" 2>&1 &&
        jq -e --argjson s "$diameter" --argjson r "$density" --arg f "$file" '
            .job.diameter == $s and .job.particles / .job.length == $r and
            .job.potential.amplitude == 6 and
            .job.method == (if $f | test("/2022-") then "bcd" else "auto" end)' \
            "$work/out" >"$work/said"; then
        echo "ok $count - $file"
    else
        echo "not ok $count - $file"
        sed 's/^/# /' "$work/out"
    fi
done
count=$((count + 1))
absent=$(for file in tests/scenes/*.json; do
    [ -e "tests/scenes/full/${file##*/}" ] || echo "$file"
done)
if [ -z "$absent" ] && [ $# -eq 60 ]; then
    echo "ok $count - every shortened scene has its full one"
else
    echo "not ok $count - every shortened scene has its full one: $absent"
fi
