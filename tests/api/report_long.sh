#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Fig. 7 of 2024, its two curves without stickiness (a minute of one core): flat within a well, then
# towards t^(1/2); the picture. The verdict's columns: sigma, gamma, MSD(error) at t = .01, flattest
# MSD(error) and its lag, slope there, last MSD(error) and its lag, exponent(error).
# Alone: it measures.
. tests/api/_lib.sh

"$B/bcd" report figures --only fig7 --jobs >"$T/jobs"
check "six curves" jq -e 'length == 6' "$T/jobs"
for curve in 2024-fig7a-sigma0.5-rho0.5 2024-fig7b-sigma0.8-rho0.5; do
    "$B/bcd" report figures --only $curve --out "$T/$curve" --quiet >"$T/out" 2>&1
    check "$curve runs" test -s "$T/$curve/2024-fig7.svg"
    sed -n 's/t = //g; s/[()]/ /g; s/ at / /g; s/^ *\(0\.[58] *0 .*\)$/\1/p' "$T/out" >"$T/line"
    cat "$T/line"
    check "a plateau of about 2<x^2> = 0.0169: rods feel that wells are no parabolas" awk '
        { ok = $3 > 0.011 && $3 < 0.0169 && $5 > 0.0169 && $5 < 0.03 && $8 < 0.25 }
        END { exit !(ok && NR == 1) }' "$T/line"
    check "t^(1/2) at long times, within five standard errors and the last of the crossover" awk '
        { ok = $12 - 0.5 > -5 * $13 && $12 - 0.5 < 5 * $13 + 0.1 && $13 < 0.1 }
        END { exit !(ok && NR == 1) }' "$T/line"
    check "one curve with error bars and guides" sh -c '
        [ "$(grep -c "class=\"curve\"" "$1")" = 1 ] && [ "$(grep -c "class=\"band\"" "$1")" = 1 ] &&
        [ "$(grep -c "class=\"guide\"" "$1")" -ge 1 ]' - "$T/$curve/2024-fig7.svg"
done
finish
