#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A full disk (no file of the daemon can grow any more): new jobs are refused with 507, what is there
# is served, what is computed waits; with room again all goes on by itself, to the same bits.
. "$(dirname "$0")/_lib.sh"

job() { # SEED TIME
    printf '{"particles":30,"length":60,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"realizations":4,"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},'
    printf '"msd":{"first":0.01,"last":1,"points":10},"density":{"bins":20}}}'
}
disk() { # full|empty
    case $1 in
    full) prlimit --pid "$PID" --fsize=0:unlimited ;;
    *) prlimit --pid "$PID" --fsize=unlimited:unlimited ;;
    esac
}

daemon_start "$T/data" --workers 2
post_text "$(job 1 5)"
done=$ID
until_state "$done" done
curl -sS "$URL/v1/jobs/$done/results" >"$T/before.json"
post_text "$(job 2 1200)" # some seconds, also on a fast machine
running=$ID
until_state "$running" running
disk full
post_text "$(job 3 5)"
check "a new job is refused" status_is 507
check "as a problem" type_is application/problem+json
check "that says why" holds '.title | test("full")'
ask POST /v1/sweeps --data-binary "{\"base\":$(job 4 5),\"axes\":{\"/seed\":[1,2,3]}}"
check "so is a sweep" status_is 507
ask DELETE "/v1/jobs/$running"
check "and a cancel" status_is 507
ask GET /readyz
check "it is not ready" status_is 503
ask GET /healthz
check "but alive" status_is 200
ask GET "/v1/jobs/$done/results"
check "results are served" status_is 200
check "as they were" cmp "$T/body" "$T/before.json"
ask GET "/v1/jobs"
check "jobs are listed; none was half taken" holds '[.jobs[].id] | length == 2'
failures() { # writes that met the full disk
    curl -sS "$URL/metrics" | sed -n 's/^bcd_store_failures_total{cause="full"} //p'
}
before=$(failures)
more_failures() {
    [ "$(failures)" -ge $((before + 2)) ]
}
check "its worker tries again and again" eventually more_failures
ask GET "/v1/jobs/$running"
check "the job that ran has not failed" holds '.state == "running"'
disk empty
post_text "$(job 3 5)"
check "with room again jobs are taken" status_is 202
new=$ID
check "the waiting ones go on by themselves" until_state "$running" done
check "new ones too" until_state "$new" done
for id in "$running" "$new"; do
    curl -sS "$URL/v1/jobs/$id/results" | jq -c 'del(.id)' >"$T/full.$id"
done
disk full
daemon_end TERM
check "it can end with a full disk ($EXIT)" test "$EXIT" = 0
check "the database is whole" test "$(sqlite3 "$T/data/bcd.sqlite" 'PRAGMA integrity_check')" = ok
daemon_start "$T/calm" --workers 1
for pair in "2 1200 $running" "3 5 $new"; do
    set -- $pair
    post_text "$(job "$1" "$2")"
    until_state "$ID" done
    curl -sS "$URL/v1/jobs/$ID/results" | jq -c 'del(.id)' >"$T/out"
    check "the bits are those of an empty disk" cmp "$T/out" "$T/full.$3"
done
finish
