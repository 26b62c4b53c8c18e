#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Jobs that build on one another: more and fewer realizations, a target, all anew by force; by curl,
# with kill -9 in the middle, and to the byte what bcd run gives.
. "$(dirname "$0")/_lib.sh"

rods='"particles":20,"length":40,"diameter":0.5,"force":1,"time":12,"time_step":0.001,
"potential":{"type":"cosine","amplitude":6},"method":"strang",
"observables":{"msd":{"first":0.01,"last":1,"points":8},"energy":{}}'
target='"target":{"observable":"msd","relative_error":0.025},"realizations":400'

as_run() { # MORE: the last job's results are those of bcd run
    printf '{%s,%s}' "$rods" "$1" >"$T/alone.json"
    "$B/bcd" run -q "$T/alone.json" | jq -S . >"$T/alone"
    curl -sS -m 60 "$URL/v1/jobs/$ID/results" | jq -S . | cmp - "$T/alone"
}
outcome() {
    curl -sS -m 60 "$URL/v1/jobs/$ID" >"$T/body"
    holds ".outcome | $1"
}
submit() {
    post_text "{$rods,$1}"
    until_state "$ID" done
}

daemon_start "$T/one" --workers 1
check "a job of 20 realizations" submit '"realizations":20'
first=$ID
check "ran them all" outcome \
    'del(.core_seconds) == {realizations: 20, reused_realizations: 0, reused_from: null}'
check "and says what that took" outcome '.core_seconds > 0 and .core_seconds < 60'
ask GET "/v1/jobs?outcome.core_seconds=0..60"
check "by which it is found" holds ".jobs | length == 1 and .[0].id == \"$first\""
ask GET "/v1/jobs?outcome.core_seconds>=60"
check "and others are not" holds '.jobs == []'
check "one of 30" submit '"realizations":30'
check "takes over those of the first" outcome ".reused_realizations == 20 and .reused_from == \"$first\""
check "and gives what a fresh run gives" as_run '"realizations":30'
check "one of 18" submit '"realizations":18'
check "takes over those up to a milestone" outcome '.reused_realizations == 16'
check "and gives what a fresh run gives" as_run '"realizations":18'
check "one realization" submit '"realizations":1'
check "in blocks of its own" outcome '.reused_realizations == 0'

# ---- anew, by force
post_text "{$rods,\"realizations\":30}"
check "the same job again is not run" test "$STATUS" = 200
second=$ID
ask POST '/v1/jobs?force=true' --data-binary "@$T/job"
ID=$(jq -r .id "$T/body")
check "by force it is" test "$STATUS" = 202 -a "$ID" != "$second"
check "as a job of its own" holds '.deduplicated == false'
check "that ends" until_state "$ID" done
check "having run all of it" outcome '.reused_realizations == 0'
check "with the same results" as_run '"realizations":30'
third=$ID
post_text "{$rods,\"realizations\":30}"
check "and stands for the same job from then on" test "$STATUS $ID" = "200 $third"

# ---- a target
check "a job with a target" submit "$target"
found=$(curl -sS -m 60 "$URL/v1/jobs/$ID" | jq .outcome.realizations)
check "is met" outcome '.target.reached and .target.stopped_by == "target"'
check "by its error bar, time step included" outcome \
    '.target | .relative_error <= 0.025 and .statistical < .relative_error'
check "by no more realizations than it takes ($found)" outcome \
    '.realizations > 30 and .realizations < 400 and .reused_realizations == 30'
check "they give what a fresh job of so many gives" as_run "\"realizations\":$found"
post_text "{$rods,\"target\":{\"observable\":\"msd\",\"relative_error\":2}}"
check "a wrong target is refused at its place" holds '.errors[0].pointer == "/target/relative_error"'
daemon_end TERM

# ---- on another number of workers, killed in the middle
daemon_start "$T/four" --workers 4
post_text "{$rods,$target}"
last=0 back=0 kills=0
while [ $kills -lt 3 ]; do
    now=$(curl -sS -m 60 "$URL/v1/jobs/$ID" | jq .progress)
    jq -ne "$now >= $last" >"$T/null" || back=$((back + 1))
    last=$now
    jq -ne "$now > 0.2 * ($kills + 1)" >"$T/null" || continue
    daemon_end KILL
    kills=$((kills + 1)) last=0
    daemon_start "$T/four" --workers 4
done
check "progress never went back" test $back = 0
check "it is done in spite of kills" until_state "$ID" done
check "after as many realizations" outcome ".realizations == $found"
check "with the same results" as_run "\"realizations\":$found"
finish
