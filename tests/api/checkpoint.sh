#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What a kill -9 costs: a long chunk goes on from its last checkpoint, and making them takes next to
# nothing. Seconds of work are those of the processor, so that nothing else on the machine matters.
. "$(dirname "$0")/_lib.sh"

progress() {
    curl -sS -m 60 "$URL/v1/jobs/$ID" | jq .progress
}
metric() {
    curl -sS -m 60 "$URL/metrics" | sed -n "s/^$1 //p"
}
used() { # hundredths of a second of the daemon's processor time
    set -- $(cut -d ' ' -f 14,15 "/proc/$PID/stat")
    echo $(($1 + $2))
}
has_worked() { # HUNDREDTHS
    [ "$(used)" -ge "$1" ]
}
saved_and_told() { # what it used goes to the store every 5 s
    made=$(metric bcd_checkpoints_total)
    worked=$(metric bcd_core_seconds_total)
    jq -ne "$made >= 2 and $worked > 0" >"$T/said"
}

daemon_start "$T/data" --workers 1
post_text '{"particles":20000,"length":40000,"diameter":0.5,"time":1000,"time_step":0.001,
    "potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},"density":{"bins":20}}}'
until_state "$ID" running
eventually has_worked 100
before=$(progress) begun=$(used)
eventually has_worked 550
check "checkpoints were made" eventually saved_and_told
after=$(progress) ended=$(used)
took=$(metric bcd_checkpoint_seconds_total)
daemon_end KILL
check "a chunk longer than any test" jq -ne "$after < 0.5"
check "in less than 2 % of the time ($took s of $worked s)" jq -ne "$took < 0.02 * $worked"
daemon_start "$T/data" --workers 1
goes_on() {
    restored=$(progress)
    jq -ne "$restored > 0" >"$T/said"
}
check "something was kept" eventually goes_on
lost=$(jq -n "($after - $restored) / (($after - $before) / ($ended - $begun) * 100)")
check "a kill -9 costs less than 5 s of work in the first 6 ($lost s)" jq -ne "$lost < 5"
ask GET "/v1/jobs/$ID/attempts"
check "the lost attempt has saved something" holds '.attempts[1].ended == "lost" and .attempts[1].saves >= 2'
check "and says what it cost, as far as that is known" holds '.attempts[1].core_seconds > 0'
daemon_end TERM
finish
