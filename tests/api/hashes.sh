#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The published vectors of tests/hashes: jobs, what their hash is taken of, and the hash; told by
# this program and by sha256sum. What makes no other job changes no hash, what makes one does.
. tests/api/_lib.sh

for job in tests/hashes/*.json; do
    name=${job##*/}
    name=${name%.json}
    "$B/bcd" check --encoding "$job" >"$T/$name.txt" 2>"$T/err"
    check "$name: its encoding is the published one (else sh tests/hashes/_write.sh, and why)" \
        cmp "$T/$name.txt" "tests/hashes/$name.txt"
    "$B/bcd" check "$job" >"$T/$name.check" 2>"$T/err"
    check "$name: the hash is the SHA-256 of its encoding" \
        test "$(jq -r .hash "$T/$name.check")  $name.txt" = \
        "$(grep " $name.txt\$" tests/hashes/SHA256SUMS)"
done
check "sha256sum agrees" sh -c 'cd tests/hashes && sha256sum -c SHA256SUMS'

hash_of() { # a job's text, changed by a jq filter
    jq "$1" tests/hashes/formula.json >"$T/job.json" && "$B/bcd" check "$T/job.json" | jq -r .hash
}
same=$(hash_of .)
for other in '.diameter = 0.50' '.temperature = 1' '.method = "auto"' '.time = 4e-1' \
    '.label = "mine" | .tags = ["a"] | .priority = 3' 'to_entries | reverse | from_entries' \
    '.interaction.cutoff = 2.0' '.observables.pair_distribution.bins = 100'; do
    check "the same job: $other" test "$(hash_of "$other")" = "$same"
done
for other in '.diameter = 0.5000000000000001' '.seed = 2' '.realizations = 17' '.method = "strang"' \
    '.potential.energy = "(x-3)^2/2+sin(x)"' '.observables.energy = {}' '.tolerance = 0.0051'; do
    check "another job: $other" test "$(hash_of "$other")" != "$same"
done
finish
