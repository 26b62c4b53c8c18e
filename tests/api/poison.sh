#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Whose fault it was: a job that crashes the server three times has failed, and says why; those that
# were in motion beside it are done, to the same bits. kill -9 is nobody's fault, however often.
. "$(dirname "$0")/_lib.sh"

innocent='{"particles":40,"length":80,"diameter":0.5,"time":800,"time_step":0.001,"realizations":2,
    "potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},"density":{"bins":20}}}'
# So many rods that its run takes more than 4 MB: what tests/preload/poison.c looks for.
poison='{"particles":1000000,"length":2000000,"diameter":0.5,"time":2,"time_step":0.001,
    "observables":{"energy":{}}}'

shim=$(pwd)/$B/tests/preload/poison.so
case $B in /*) shim=$B/tests/preload/poison.so ;; esac
start() { # HOW: a daemon in which the poison works
    : >"$T/stdout"
    daemon=$B/bcdd
    POISON=$1 LD_PRELOAD=$shim "$daemon" --listen 127.0.0.1:0 --data "$T/data" --nice 0 \
        --workers 2 >"$T/stdout" 2>>"$T/stderr" &
    PID=$!
    URL=
    eventually listens_or_ended
}
listens_or_ended() {
    URL=$(sed -n '1s/^listening on //p' "$T/stdout")
    [ -n "$URL" ] || ! kill -0 "$PID" 2>/dev/null
}
ended() {
    ! kill -0 "$PID" 2>/dev/null
}
wait_crash() { # sets EXIT: 128 + the signal
    eventually ended || kill -9 "$PID"
    wait "$PID" 2>/dev/null
    EXIT=$?
    PID=
}
attempts() {
    sqlite3 "$T/data/bcd.sqlite" "SELECT group_concat(ended, ' ') FROM (SELECT ended FROM attempts
        JOIN jobs ON seq = attempts.job WHERE id = '$1' ORDER BY number)"
}

check "there is something to preload" test -e "$shim"

# ---- left alone
daemon_start "$T/calm" --workers 2
post_text "$innocent"
until_state "$ID" done
curl -sS "$URL/v1/jobs/$ID/results" | jq -c 'del(.id)' >"$T/calm.json"
daemon_end TERM

# ---- three ways to crash
start none
post_text "$innocent"
good=$ID
daemon_end TERM
start segv
post_text "$poison"
bad=$ID
wait_crash
check "a fault of memory ends the server as ever ($EXIT)" test "$EXIT" = 139
check "it leaves a note" grep -Eqx "$bad 0 11" "$T/data/bcd.crashed"
check "for the owner's eyes" test "$(stat -c %a "$T/data/bcd.crashed")" = 600
start stack
wait_crash
check "so does one at the end of its stack ($EXIT)" test "$EXIT" = 139
check "it is noted too" grep -Eqx "$bad 0 11" "$T/data/bcd.crashed"
start abort
wait_crash
check "so does an abort ($EXIT)" test "$EXIT" = 134
start segv
check "the fourth start goes on" test -n "$URL"
check "without the note" test ! -e "$T/data/bcd.crashed"
ask GET "/v1/jobs/$bad"
check "the job has failed" holds '.state == "failed" and .attempts == {"lost": 0, "failed": 3}'
check "and says why" holds '.error == "it crashed the server 3 times, the last time by SIGABRT in chunk 0"'
ask GET "/v1/jobs/$bad/attempts"
check "each attempt is kept" holds '[.attempts[] | [.number, .ended, .reason, .saves]] == [
    [3, "crashed", "SIGABRT in chunk 0", 0], [2, "crashed", "SIGSEGV in chunk 0", 0],
    [1, "crashed", "SIGSEGV in chunk 0", 0]]'
check "with its moments" holds '[.attempts[] | .started_at < .ended_at] | all'
check "the job beside it is done" until_state "$good" done
ask GET "/v1/jobs/$good"
check "it has lost attempts, and is not blamed" holds '.attempts.lost >= 1 and .attempts.failed == 0'
curl -sS "$URL/v1/jobs/$good/results" | jq -c 'del(.id)' >"$T/out"
check "its results are those of a job left alone" cmp "$T/calm.json" "$T/out"
daemon_end TERM

# ---- kill -9, six times, before anything can be saved
start none
post_text "$(printf '%s' "$poison" | sed 's/"time":2/"time":40/')"
bad=$ID
until_state "$bad" running
for i in 1 2 3 4 5 6; do
    daemon_end KILL
    start none
done
ask GET "/v1/jobs/$bad"
check "kill -9 fails no job" holds '.state == "running" and .attempts == {"lost": 6, "failed": 0}'
goes_on() {
    curl -sS "$URL/v1/jobs/$bad" | jq -e '.progress > 0' >"$T/said"
}
check "a job that rests goes on when it is alone" eventually goes_on
daemon_end TERM
check "a clean end is no loss" test "$(attempts "$bad")" = "lost lost lost lost lost lost stopped"
finish
