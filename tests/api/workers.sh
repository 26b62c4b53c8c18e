#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A daemon that lends its chunks, and workers that run them: killed, told to end, left alone by the
# daemon; the results are those of one machine, bit for bit. A worker's token is good for that alone.
. "$(dirname "$0")/_lib.sh"
. "$(dirname "$0")/_workers.sh"

job() { # SEED TIME REALIZATIONS
    printf '{"particles":30,"length":60,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"realizations":%s,"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},' "$3"
    printf '"msd":{"first":0.01,"last":1,"points":10},"density":{"bins":20}}}'
}
worker() { # [options]
    worker_start --url "$URL" --token-file "$T/worker.token" "$@"
}
as_admin() { # METHOD PATH [curl ...]
    ask "$@" -H "Authorization: Bearer $ADMIN"
}
submit() { # FILE
    as_admin POST /v1/jobs --data-binary "@$1"
    ID=$(jq -r .id "$T/body")
}
ended() { # ID STATE
    for try in 1 2 3 4; do
        as_admin GET "/v1/jobs/$1?wait=50"
        [ "$(jq -r .state "$T/body")" = "$2" ] && return
    done
    return 1
}
metric() {
    as_admin GET /metrics
    awk -v name="$1" '$1 == name { print $2 }' "$T/body"
}
at_least() { # METRIC LEAST
    [ "$(metric "$1")" -ge "$2" ]
}
same_bits() { # ID FILE
    as_admin GET "/v1/jobs/$1/results"
    jq -S . "$T/body" >"$T/theirs"
    "$B/bcd" run --quiet "$2" | jq -S . | cmp - "$T/theirs"
}

ADMIN=$("$B/bcdd" token create --data "$T/data" --owner root --role admin 2>"$T/said")
"$B/bcdd" token create --data "$T/data" --owner cluster --role worker >"$T/worker.token" 2>"$T/said"
chmod 600 "$T/worker.token"
start() {
    daemon_start "$T/data" --backend workers --workers 8 --lease 2
}
start
as_worker="Authorization: Bearer $(cat "$T/worker.token")"
for path in /v1/jobs /v1/me /v1/tokens /metrics; do
    ask GET $path -H "$as_worker"
    check "a worker may not ask for $path" status_is 403
done
ask POST /v1/jobs -d "$(job 1 1 1)" -H "$as_worker"
check "nor submit" status_is 403
reader=$(curl -sS -H "Authorization: Bearer $ADMIN" "$URL/v1/tokens" -d '{"owner":"ada","role":"operator"}' | jq -r .token)
ask POST /v1/leases -d '{"worker":"me","result_version":1}' -H "Authorization: Bearer $reader"
check "and others may not be workers" status_is 403
ask POST /v1/leases -d '{"worker":"me","result_version":1}' -H "$as_worker"
check "nor may programs of another result version" status_is 422
check "which is said" holds '.errors[0].pointer == "/result_version"'
ask POST /v1/leases/l1/return -H "$as_worker" \
    -d '{"job":"jx","chunk":0,"core_seconds":1,"tally":"AA==","sha256":"00"}'
check "a result with a wrong checksum" status_is 422

# ---- one job, three workers
job 1 20 24 >"$T/first"
submit "$T/first"
first=$ID
worker
worker
worker
check "a job is done" ended "$first" done
check "with the bits of one machine" same_bits "$first" "$T/first"
check "several had a part in it" test "$(metric bcd_leases_granted_total)" -ge 3
check "what they used is their owner's" sh -c "
    curl -sS -H 'Authorization: Bearer $ADMIN' '$URL/v1/owners' | jq -e '.owners[] | select(.owner == \"root\") | .core_seconds.decayed > 0'"

# ---- kill -9, SIGTERM, and a daemon that is away for a while
job 2 800 8 >"$T/second"
submit "$T/second"
second=$ID
check "three have a chunk" eventually at_least bcd_leases_held 3
sleep 0.5
check "told to end one ends" kill_one_end_another
worker
daemon_end KILL
LISTEN=127.0.0.1:${URL##*:}
start
check "the daemon was killed; workers went on" eventually at_least bcd_leases_held 1
check "the job is done" ended "$second" done
check "with the bits of one machine" same_bits "$second" "$T/second"
check "no result differed" test "$(metric bcd_leases_differed_total)" = 0

# ---- one is killed, and the job is cancelled
worker
job 3 100000 8 >"$T/third"
submit "$T/third"
third=$ID
check "another is under way" eventually at_least bcd_leases_held 3
kill -9 "$LAST"
check "who is not heard of any more loses it" eventually at_least bcd_leases_expired_total 1
check "which is in the log" grep -q 'event=lease_expired job=j' "$T/stderr"
worker
check "another takes it" eventually at_least bcd_leases_held 3
as_admin DELETE "/v1/jobs/$third"
job 4 2 8 >"$T/fourth"
submit "$T/fourth"
check "a cancelled one makes room for the next" ended "$ID" done
check "and stays cancelled" ended "$third" cancelled
worker --idle 0
wait "$LAST"
check "who is not needed ends" test $? = 0
check "workers had nothing to complain of" sh -c "! cat $T/worker.err | grep ."
check "and told what they did" grep -qxE '[0-9]+ chunks? run' "$T/worker.out"
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
finish
