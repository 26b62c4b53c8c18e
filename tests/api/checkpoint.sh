#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What a kill -9 costs: a long chunk goes on from its last checkpoint, and making them takes next to
# nothing. Seconds of work are progress over what the job made of it in a second before.
# Alone: it compares how fast a job gets on before and after.
. "$(dirname "$0")/_lib.sh"

progress() {
    curl -sS -m 60 "$URL/v1/jobs/$ID" | jq .progress
}
metric() {
    curl -sS -m 60 "$URL/metrics" | sed -n "s/^$1 //p"
}

daemon_start "$T/data" --workers 1
post_text '{"particles":20000,"length":40000,"diameter":0.5,"time":100,"time_step":0.001,
    "potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},"density":{"bins":20}}}'
until_state "$ID" running
sleep 1
before=$(progress) begun=$(date +%s%N)
sleep 4.5 # what it used goes to the store every 5 s
after=$(progress) ended=$(date +%s%N)
made=$(metric bcd_checkpoints_total)
took=$(metric bcd_checkpoint_seconds_total)
worked=$(metric bcd_core_seconds_total)
daemon_end KILL
check "a chunk longer than any test" jq -ne "$after < 0.5"
check "checkpoints were made ($made)" jq -ne "$made >= 2"
check "in less than 2 % of the time ($took s of $worked s)" jq -ne "$took < 0.02 * $worked"
daemon_start "$T/data" --workers 1
tries=0
while restored=$(progress) && [ "$restored" = 0 ] && [ $tries -lt 200 ]; do
    sleep 0.01
    tries=$((tries + 1))
done
lost=$(jq -n "($after - $restored) / (($after - $before) / ($ended - $begun) * 1e9)")
check "a kill -9 costs less than 5 s of work in the first 6 ($lost s)" jq -ne "$lost < 5"
check "something was kept" jq -ne "$restored > 0"
ask GET "/v1/jobs/$ID/attempts"
check "the lost attempt has saved something" holds '.attempts[1].ended == "lost" and .attempts[1].saves >= 2'
check "and says what it cost, as far as that is known" holds '.attempts[1].core_seconds > 0'
daemon_end TERM
finish
