#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Ten million rods fit into 1.2 GB, all of the program and its threads counted as address space; and
# make bench writes what it measured in the form that users rely on.
# Alone: it measures.
. tests/api/_lib.sh

LIMIT_KB=1171875 # 1.2e9 bytes
# fits METHOD OBSERVABLE: three steps, as `bcd run` does them.
fits() {
    cat >"$T/job.json" <<JOB
{"particles": 10000000, "length": 20000000, "diameter": 0.5, "method": "$1", "time_step": 1e-4,
 "time": 3e-4, "sample_every": 1e-4, "potential": {"type": "cosine", "amplitude": 6},
 "observables": {$2}}
JOB
    (
        ulimit -v "$LIMIT_KB" || exit 1
        "$B/bcd" run "$T/job.json" --quiet
    ) >"$T/out" 2>"$T/err" && jq -e 'length > 0' "$T/out" && return
    cat "$T/err"
    return 1
}
for method in auto bcd strang elastic; do
    check "10^7 rods in 1.2 GB, density, $method" fits "$method" '"density": {"bins": 50}'
done
check "10^7 rods in 1.2 GB, current, strang" fits strang '"current": {}'
check "10^7 rods in 1.2 GB, msd, strang" fits strang '"msd": {"first": 2e-4, "last": 3e-4, "points": 2}'

"$B/bcd" bench --json "$T/bench.json" >"$T/table"
check "the benchmark ends well" test $? -eq 0
check "its entries have the members of the contract" jq -e '
    (.machine | type == "object") and (.entries | length > 100) and all(.entries[];
        (.scene | IN("free", "sparse", "dense", "sticky")) and (.method | type == "string") and
        .particles >= 10 and (.realizations | IN(1, 16)) and .threads == 1 and
        .ns_per_particle_step > 0 and .ratio_to_noise_and_force > 0)' "$T/bench.json"
check "all scenes are there, up to 10^7 rods" jq -e '
    [.entries[] | select(.particles == 10000000 and .method == "bcd") | .scene] | sort ==
    ["dense", "free", "sparse", "sticky"]' "$T/bench.json"
check "so is lm" jq -e '[.entries[] | select(.method == "lm")] | length >= 20' "$T/bench.json"
check "100 bytes a rod at most from 10^4 on" jq -e '
    all(.entries[] | select(.particles >= 10000 and (.method | IN("bcd", "strang", "elastic", "lm")));
        .bytes_per_particle <= 100 and (.peak_bytes_per_particle // 0) <= 100)' "$T/bench.json"
check "other sections are there" jq -e '
    (.growth | length > 0) and (.published | length > 0) and (.scaling | length == 1) and (.hands | length == 12) and
    (.observables | length == 24) and (.leave_out | length > 0)' "$T/bench.json"
finish
