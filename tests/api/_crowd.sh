# SPDX-License-Identifier: GPL-3.0-or-later
# _crowd.sh - a daemon and a crowd of workers that behave badly now and then (tests/tools/crowd.c).
# Read with `.` by the others.
#
#   crowd_daemon LENT SECONDS   a daemon that lends so many chunks at a time, with leases of so
#                               long; and ID: a job, done by no one yet, that people look at
#   crowd_sweep FIRST COUNT REALIZATIONS   so many jobs with seeds of their own
#   crowd_work [crowd's options]           until all sweeps are done, then gives $T/crowd
#   crowd_ledger                checks that every chunk is accounted for
#   said FILTER                 of what the crowd said
. "$(dirname "$0")/_lib.sh"
CROWD=
SWEEPS=
cleanup() {
    for pid in $CROWD $PID; do
        kill -9 "$pid" 2>/dev/null
    done
    rm -rf "$T"
}

crowd_job() { # REALIZATIONS
    printf '{"particles":10,"length":20,"diameter":0.5,"time":0.5,"time_step":0.005,"realizations":%s,' "$1"
    printf '"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},'
    printf '"msd":{"first":0.01,"last":0.5,"points":10},"density":{"bins":50}}}'
}
as_admin() {
    ask "$@" -H "Authorization: Bearer $(cat "$T/admin")"
}
metric() {
    as_admin GET /metrics
    awk -v name="$1" '$1 == name { print $2 }' "$T/body"
}
said() {
    jq "$1" "$T/crowd"
}
says() {
    jq -e "$1" "$T/crowd"
}

crowd_daemon() {
    "$B/bcdd" token create --data "$T/data" --owner root --role admin >"$T/admin" 2>"$T/said"
    "$B/bcdd" token create --data "$T/data" --owner cluster --role worker >"$T/worker" 2>"$T/said"
    daemon_start "$T/data" --backend workers --workers "$1" --lease "$2" --log changes --nice 5
    as_admin POST /v1/jobs -d "$(crowd_job 4)"
    ID=$(jq -r .id "$T/body")
}

crowd_sweep() {
    as_admin POST /v1/sweeps \
        -d "{\"base\":$(crowd_job "$3"),\"axes\":{\"/seed\":{\"first\":$1,\"count\":$2}}}"
    SWEEPS="$SWEEPS $(jq -r .id "$T/body")"
}

all_done() {
    for sweep in $SWEEPS; do
        as_admin GET "/v1/sweeps/$sweep"
        jq -e '.states.done == .jobs' "$T/body" >/dev/null || return 1
    done
}

crowd_work() {
    "$B/tests/tools/crowd" --port "${URL##*:}" --token "$T/worker" --admin "$T/admin" \
        --job "$ID" "$@" >"$T/crowd" 2>"$T/crowd.said" &
    CROWD=$!
    while kill -0 $CROWD 2>/dev/null && ! all_done; do
        sleep 0.3
    done
    check "all sweeps are done" all_done
    kill -TERM $CROWD
    wait $CROWD
    check "the crowd ends in good order" test $? = 0
    CROWD=
    check "and has nothing to complain of" sh -c "! grep . '$T/crowd.said'"
    said 'del(.ms)' | jq -c . | sed 's/^/# /'
    said '.ms | to_entries[] | "# \(.key): \(.value.count), median \(.value.median) ms, 95 % \(.value.p95), 99 % \(.value.p99), longest \(.value.max)"' | tr -d '"'
}

# Chunks of jobs that are done, as the database has them.
chunks_done() {
    "$B/bcd" sql --data "$T/data" --csv "select sum(derived_chunks) from jobs where state = 'done'" |
        tail -n 1
}
same_count() {
    [ "$(chunks_done)" = "$(metric bcd_leases_returned_total)" ]
}
as_many_done_as_returned() {
    eventually same_count && return
    echo "$(chunks_done) chunks of jobs that are done, $(metric bcd_leases_returned_total) returned"
    return 1
}

expired() { # LEAST
    [ "$(metric bcd_leases_expired_total)" -ge "$1" ]
}

crowd_ledger() {
    check "every chunk of every job was returned once, and no more" as_many_done_as_returned
    check "the daemon took what the crowd was told that it took" \
        test "$(metric bcd_leases_returned_total)" = "$(said .taken)"
    check "and lent what the crowd has got" \
        test "$(metric bcd_leases_granted_total)" = "$(said .loans)"
    check "each loan came back, vanished, or was told to stop" says \
        '.loans + .doubled == .taken + .again + .unwanted + .refused + .differed + .gone + .stopped'
    check "who vanished lost the chunk" eventually expired "$(said .gone)"
    check "what was run twice was noticed and had the same bits" \
        test "$(metric bcd_leases_again_total)" = "$(said .again)"
    check "what arrived damaged was not taken" says '.refused + .differed == .broken'
    check "all had been lent by this daemon" says '.unknown == 0'
    check "every request had an answer" says '.lost == 0 and .failed == 0'
    check "no job failed" test "$(metric 'bcd_jobs{state="failed"}')" = 0
    check "one job for each that was submitted" test \
        "$("$B/bcd" sql --data "$T/data" --csv "select count(*) from jobs where label = 'crowd'" | tail -n 1)" \
        = "$(said .ms.submit.count)"
}

# Of a sweep: the job of one seed, and what one machine gives.
same_bits() { # SEED REALIZATIONS
    id=$("$B/bcd" sql --data "$T/data" --csv \
        "select id from jobs where seed = $1 and realizations = $2 and particles = 10" | tail -n 1)
    as_admin GET "/v1/jobs/$id/results"
    jq -S . "$T/body" >"$T/theirs"
    crowd_job "$2" | jq ".seed = $1" | "$B/bcd" run --quiet - | jq -S . | cmp - "$T/theirs"
}
