#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcd report figures: the table of jobs inside the program and the files in tests/scenes are the same
# jobs; a panel's files, picture and verdict agree with the same job run by itself.
. tests/api/_lib.sh
. tests/api/_client.sh

# same_jobs DIR: the printed jobs are those of the files there, completed.
same_jobs() {
    for file in "$1"/*.json; do
        name=${file##*/}
        printf '"%s"\n' "${name%.json}"
        "$B/bcd" check "$file"
    done >"$T/files"
    jq -e -n --slurpfile printed "$T/out" --slurpfile files "$T/files" '
        ($files | length) > 0 and $printed[0] ==
        ([range(0; $files | length; 2) | {($files[.]): $files[. + 1].job}] | add)'
}

bcd report figures --jobs
check "the shortened jobs are printed" exits 0
check "and are those of tests/scenes" same_jobs tests/scenes
check "30 of them" jq -es '.[0] | length == 30' "$T/out"
bcd report figures --jobs --full
check "the full jobs are those of tests/scenes/full" same_jobs tests/scenes/full
bcd report figures --jobs --only gamma10
check "a part of them" jq -es '.[0] | keys == ["2022-fig6-gamma10-sigma0.5-rho0.5",
    "2022-fig6-gamma10-sigma0.8-rho0.8", "2024-fig7a-gamma10-sigma0.5-rho0.5",
    "2024-fig7b-gamma10-sigma0.8-rho0.5"]' "$T/out"

scene=2022-fig3-sigma0.8-rho0.2
bcd report figures --only $scene --out "$T/figures" --workers 2
check "one panel runs" exits 0
check "no progress bar without a terminal" test ! -s "$T/err"
cp "$T/out" "$T/table"
"$B/bcd" run --csv density tests/scenes/$scene.json >"$T/density.csv"
check "its table is that of bcd run, bit for bit" \
    cmp "$T/density.csv" "$T/figures/$scene-density.csv"
"$B/bcd" run tests/scenes/$scene.json >"$T/result.json"
# The verdict, worked out from the result by jq.
check "L1, max|z|, chi-square and p are the result's" awk -F, -v want="$(jq -r '.density |
    ([.density, .theory] | transpose | map(.[0] - .[1] | fabs) | add) / (.theory | add),
    (.z | map(select(. != null) | fabs) | max),
    .chi_square, .degrees_of_freedom, .p_value' "$T/result.json" | tr '\n' ' ')" '
    NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i }
    NR == 2 {
        n = split(want, w, " ")
        split("l1 z_max chi_square degrees_of_freedom p_value", names, " ")
        for (i = 1; i <= 5; i++) {
            d = $(at[names[i]]) - w[i]
            if (n != 5 || d * d > 1e-18 * (1 + w[i] * w[i])) { print names[i], $0, want; bad = 1 }
        }
        if ($(at["core_seconds"]) <= 0 || $(at["method"]) != "bcd") bad = 1
    }
    END { exit bad || NR != 2 }' "$T/figures/2022-figures.csv"
# 0.8 0.2: 20 rods. 0.0150 is about 4 times what step and noise leave of L1 here.
check "the profile lies on the theory" awk '$2 == "density" { ok = $6 == 20 && $9 > 0 && $9 < 0.015 }
    END { exit !ok }' "$T/table"
check "the picture has one panel with theory and 50 points" sh -c '
    [ "$(grep -c "class=\"panel\"" "$1")" = 1 ] && [ "$(grep -c "class=\"dot\"" "$1")" = 50 ] &&
    [ "$(grep -c "class=\"theory\"" "$1")" = 1 ]' - "$T/figures/2022-fig3.svg"
check "three files, and no other figure" test "$(ls "$T/figures" | wc -l)" = 3

# Fig. 5 of 2022 is computed, not simulated: the least largest force (physics.md of the project: 1.58,
# 2.95, 4.88), and the printed force is Eq. 32 at one gap.
bcd report figures --only fig5 --out "$T/force"
check "the force of sticky rods" exits 0
check "its least largest value is where it should be" awk '
    $1 == "gamma" { p[$2] = $5 + 0; n++ }
    END { exit !(n == 3 && p["0.1"] > 1.575 && p["0.1"] < 1.585 && p["1"] > 2.945 &&
                 p["1"] < 2.955 && p["10"] > 4.875 && p["10"] < 4.885) }' "$T/out"
check "and it is Eq. 32" awk -F, '
    NR > 1 && $3 == 1 && $4 == 2 && $1 > 0.0199 && $1 < 0.0201 {
        u = 1 - $1 / 0.05; d = 3 / 0.05; f = 2 * d * u / (0.05 * (1 + d * u * u))
        ok = ($2 - f) ^ 2 < 1e-18 * f * f
    }
    END { exit !ok }' "$T/force/2022-fig5-force.csv"
check "six panels, fifteen curves and three" sh -c '
    [ "$(grep -c "class=\"panel\"" "$1")" = 6 ] && [ "$(grep -c "class=\"curve\"" "$1")" = 18 ]' \
    - "$T/force/2022-fig5.svg"
check "three files" test "$(ls "$T/force" | wc -l)" = 3

bcd report figures --only $scene --out "$T/density.csv"
check "a file is no directory" exits 1
check "says so" says "cannot be made"
bcd report figures --only fig3 --jobs --method elastic
check "another method, with its own step" jq -es '.[0] | length == 9 and
    all(.[]; .method == "elastic" and .time_step == "auto")' "$T/out"
bcd report figures --only $scene --jobs --method "no\"ne"
check "no such method" exits 1
check "says where" says /method
bcd report figures --only nothing
check "no such scene" exits 2
bcd report figures --out
check "an option without its value" exits 2
bcd report figures --workers 0
check "no workers" exits 2
bcd report figures extra
check "a word too many" exits 2
bcd report nothing
check "no such report" exits 2
bcd report
check "no report" exits 2
bcd report --help
check "the list of reports" prints '.*bcd report figures.*'
bcd report figures --help
check "help" prints '.*--full.*'

# Ended in the middle of a run. A background job of sh ignores SIGINT: SIGTERM it is.
"$B/bcd" report figures --only gamma10-sigma0.8 --out "$T/cut" >"$T/out" 2>"$T/err" &
report=$!
eventually test -d "$T/cut"
sleep 1
kill -TERM $report
wait $report
EXIT=$?
check "a signal ends it" exits 143
check "with words" says "ended by"
check "and nothing half done is left" test -d "$T/cut" -a -z "$(ls "$T/cut" 2>&1)"
finish
