#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The shortened scenes run to their end and give numbers that cannot be otherwise: the mean density
# is N / L, every number but a missing one is finite, displacements grow from the free 2 D t.
set -u
B=${B:-build}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
set -- tests/scenes/*.json
echo "1..$#"
count=0
for file; do
    count=$((count + 1))
    if "$B/bcd" run "$file" >"$work/out" 2>"$work/err" &&
        jq -e --slurpfile job "$file" '
            $job[0] as $j | to_entries[0] as $o | $o.value as $v | ($j.observables | keys) == keys and
            if $o.key == "density" then
                ($v.density | add / length - $j.particles / $j.length | fabs) < 1e-9
            elif $o.key == "contact_density" then
                ($v.contact_density | length == 50 and all(. >= 0) and add > 0)
            else
                ($v.msd | length > 25 and . == sort) and ($v.msd[0] / (2 * $v.lag[0]) | . > .5 and . < 1)
            end' "$work/out" >"$work/said"; then
        echo "ok $count - $file"
    else
        echo "not ok $count - $file"
        head -c 2000 "$work/err" "$work/out" | sed 's/^/# /'
    fi
done
