#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A job that is interrupted by SIGTERM and by kill -9, on another number of workers each time, ends in
# the same bytes as one that was left alone.
. "$(dirname "$0")/_lib.sh"

cat >"$T/work.json" <<'END'
{"particles": 50, "length": 100, "diameter": 0.5, "time": 900, "time_step": 0.001,
 "equilibration_time": 1, "realizations": 5, "potential": {"type": "cosine", "amplitude": 6},
 "observables": {"msd": {"first": 0.01, "last": 10, "points": 20}, "density": {"bins": 50},
                 "contact_density": {"bins": 20}, "current": {}, "energy": {}, "cluster_sizes": {}}}
END

progress() {
    curl -sS -m 60 "$URL/v1/jobs/$1" | jq .progress
}
has_come() { # ID VALUE
    jq -ne "$(progress "$1") >= $2" >"$T/said"
}
keep_results() { # DIR ID: every form of every result but the id
    mkdir -p "$1"
    for name in "" /msd /msd.csv /density.csv /contact_density.csv /current /energy \
        /cluster_sizes.csv /msd.svg; do
        curl -sSf -m 60 -o "$1/$(printf '%s' "results$name" | tr / .)" \
            "$URL/v1/jobs/$2/results$name" || return 1
    done
}

# ---- left alone, one worker
daemon_start "$T/calm" --workers 1
post "$T/work.json"
check "left alone, it is done" until_state "$ID" done 240
check "its results are kept" keep_results "$T/calm.results" "$ID"
daemon_end TERM
check "SIGTERM ends an idle daemon cleanly" test "$EXIT" = 0

# ---- a 202 means on disk
daemon_start "$T/data" --workers 2
post "$T/work.json"
daemon_end KILL
check "it was accepted" status_is 202
job=$ID
daemon_start "$T/data" --workers 2
ask GET "/v1/jobs/$job"
check "kill -9 right after the 202 loses no job" status_is 200

# ---- SIGTERM in the middle
eventually has_come "$job" 0.3
before=$(progress "$job")
ask GET "/v1/jobs/$job"
check "it runs" holds '.state == "running"'
daemon_end TERM
check "SIGTERM in the middle is a clean end" test "$EXIT" = 0
check "the database is whole" test "$(sqlite3 "$T/data/bcd.sqlite" 'PRAGMA integrity_check')" = ok
daemon_start "$T/data" --workers 3
check "it goes on where it was, at $before" eventually has_come "$job" "$before"

# ---- kill -9 in the middle
eventually has_come "$job" 0.55
ask GET "/v1/jobs/$job"
check "it still runs" holds '.state == "running"'
daemon_end KILL
check "the database is whole after kill -9" \
    test "$(sqlite3 "file:$T/data/bcd.sqlite" 'PRAGMA integrity_check')" = ok
daemon_start "$T/data" --workers 2
check "after kill -9 it is done in the end" until_state "$job" done 240
check "its results are there" keep_results "$T/data.results" "$job"
check "byte for byte those of the job left alone" diff -r "$T/calm.results" "$T/data.results"
post "$T/work.json"
check "and it is still known" test "$STATUS $ID" = "200 $job"
daemon_end INT
check "SIGINT is a clean end too" test "$EXIT" = 0
daemon_start "$T/data" --workers 1
check "results outlive the daemon" keep_results "$T/again.results" "$job"
check "unchanged" diff -r "$T/calm.results" "$T/again.results"
finish
