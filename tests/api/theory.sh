#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Exact references over HTTP and on the command line: one document; and beside results.
. "$(dirname "$0")/_lib.sh"
daemon_start "$T/data" --workers 1

job() { # $1 = further members
    printf '{"particles":8,"length":10,"diameter":0.8,"time":1,"time_step":0.001,%s' "$1"
    printf '"observables":{"density":{"bins":10},"contact_density":{"bins":5,"gap":0.01},'
    printf '"energy":{},"pair_distribution":{"bins":20,"last":2},"msd":{"points":5},'
    printf '"cluster_sizes":{}}}'
}

job '"potential":{"type":"cosine","amplitude":6},' >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "theory of a job" test "$STATUS $TYPE" = "200 application/json"
check "has the ring on the job's own bins" holds '
    (.density.theory | length) == 10 and .density.reference == "canonical"
    and ((.density.theory | add) / 10 - 0.8 | fabs) < 1e-9
    and (.contact_density.theory | length) == 5 and (.pair_distribution.theory | length) == 20'
check "and the infinite system" holds '
    ((.density.infinite | add) / 10 - 0.8 | fabs) < 1e-9 and .equilibrium.pressure_infinite > 1'
check "and the mean energy, the same as its integral" holds '
    (.energy.theory - .equilibrium.energy | fabs) < 1e-12 and .energy.theory < -2'
check "and its own error" holds '.equilibrium.relative_error < 1e-8'
check "null with a reason where there is none" holds '
    .msd.theory == null and (.msd.theory_reason | length) > 10
    and .cluster_sizes.theory == null and (.cluster_sizes.theory_reason | length) > 10'
check "the command line prints the same" sh -c '"$1/bcd" theory "$2/job" | cmp - "$2/body"' - "$B" "$T"

# ---- what would take too long is left out, in words; the job has its results all the same
pairs() { # bins, last
    printf '{"particles":1000,"length":2000,"diameter":0.5,"time":0.01,"time_step":0.001,'
    printf '"potential":{"type":"cosine","amplitude":6},'
    printf '"observables":{"pair_distribution":{"bins":%s,"last":%s}}}' "$1" "$2"
}
pairs 50 500 >"$T/job"
post "$T/job"
check "a job whose pairs reach too far for theory is done" until_state "$ID" done
ask GET "/v1/jobs/$ID/results/pair_distribution"
check "without theory, and says why" holds '
    .theory == null and (.theory_reason | test("too many terms"))'
pairs 100000 3 >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "nor are there exact values for any number of bins" holds '
    .pair_distribution.theory == null and (.pair_distribution.theory_reason | test("too long"))'

# ---- what takes seconds: one at a time, and everything else goes on meanwhile
slow() { # rods: 9 take half a minute, more than there is; 8 on 1000 a few seconds
    printf '{"particles":%s,"length":%s,"diameter":0.5,"time":0.01,"time_step":0.001,' "$1" "$2"
    printf '"potential":{"type":"cosine","amplitude":6},"observables":{"density":{"bins":20}}}'
}
waiting() { # HOW_MANY requests are held
    curl -sS -m 60 "$URL/metrics" | grep -x "bcd_http_waiting $1" >"$T/said"
}
ended() { # has the client in the background got its answer, or left?
    ! kill -0 "$1" 2>/dev/null
}
slow 9 4000 >"$T/slow"
curl -sS -m 250 -o "$T/left" --data-binary "@$T/slow" "$URL/v1/theory" 2>/dev/null &
LEAVING=$!
check "a long theory is under way" eventually waiting 1
job '"frobnicate":0,' >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "what is wrong is told meanwhile" test "$STATUS" = 422
ask GET /healthz
check "other requests are served" test "$STATUS" = 200
check "before it has ended" kill -0 "$LEAVING"
job '"temperature":3,' >"$T/job"
curl -sS -m 250 -o "$T/other" -w '%{http_code}' --data-binary "@$T/job" "$URL/v1/theory" >"$T/status" &
OTHER=$!
check "another theory waits for its turn" eventually waiting 2
kill "$LEAVING"
wait "$LEAVING" 2>/dev/null
check "which comes when nobody waits for the first any more" eventually ended "$OTHER"
check "and is answered" test "$(cat "$T/status")" = 200
# Use is written down with the first that comes 5 s after the last time.
kelvin=4
counts_as_used() {
    job "\"temperature\":$kelvin," >"$T/job"
    kelvin=$((kelvin + 1))
    ask POST /v1/theory --data-binary "@$T/job"
    ask GET /v1/owners
    holds '.owners[0].core_seconds.today > 0.3'
}
sleep 5
check "it counts as the owner's" eventually counts_as_used
for i in 1 2 3 4; do # one at work, three wait
    slow "$((9 + i))" 4000 >"$T/slow$i"
    curl -sS -m 250 -o "$T/left$i" --data-binary "@$T/slow$i" "$URL/v1/theory" 2>/dev/null &
    eval "LEAVING$i=\$!"
done
eventually waiting 4
ask POST /v1/theory --data-binary "@$T/job"
check "so many of one owner and no more" test "$STATUS" = 503
check "with the limit's name" holds '.detail | test("LIMIT_THEORY_OWNER_MAX")'
check "ask again soon" grep -qi '^retry-after:' "$T/head"
kill "$LEAVING1" "$LEAVING2" "$LEAVING3" "$LEAVING4"
wait "$LEAVING1" "$LEAVING2" "$LEAVING3" "$LEAVING4" 2>/dev/null
has_a_place() {
    ask POST /v1/theory --data-binary "@$T/job"
    [ "$STATUS" = 200 ]
}
check "they have left: their places are free" eventually has_a_place
printf '{"particles":5,"length":10,"diameter":0.5,"time":1,"observables":{"density":{"bins":1000000}}}' \
    >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "nor are there tables of any size" test "$STATUS" = 422
check "with the limit's name" holds '.errors[0].detail | test("LIMIT_THEORY_ANSWER_BYTES_MAX")'

# ---- a job's own theory: in the estimate, ended by a cancel and by SIGTERM
ask POST /v1/estimate --data-binary "@$T/slow"
check "the estimate knows of it" holds '.theory_core_seconds > 5 and .core_seconds > 5'
post "$T/slow"
comes_to_its_theory() {
    ask GET "/v1/jobs/$ID"
    holds '.state == "running" and .progress == 1'
}
check "a job comes to its theory" eventually comes_to_its_theory
LONG=$ID
job '"seed":76,"force":1,' >"$T/job" # without a theory of its own
post "$T/job"
check "which takes no worker from others" until_state "$ID" done
ask GET "/v1/jobs/$LONG"
check "and is not at its end yet" holds '.state == "running" and .progress == 1'
ask DELETE "/v1/jobs/$LONG"
check "it is cancelled there" holds '.state == "cancelled"'
job '"seed":77,' >"$T/job"
post "$T/job"
check "and others go on" until_state "$ID" done
sed 's/"time":0.01/"time":0.02/' "$T/slow" >"$T/again"
post "$T/again"
check "another is at its theory" eventually comes_to_its_theory
before=$(date +%s)
daemon_end TERM
# It would take minutes more.
check "SIGTERM ends the daemon in the middle of a theory" test "$EXIT" = 0 -a $(($(date +%s) - before)) -lt 20
daemon_start "$T/data" --workers 1
check "the job is there as before" test "$(curl -sS "$URL/v1/jobs/$ID" | jq -r .state)" = running
ask DELETE "/v1/jobs/$ID"

job '"potential":{"type":"cosine","amplitude":6},"force":1,' >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "driven rods have no equilibrium" holds '
    .density.theory == null and (.density.theory_reason | test("equilibrium"))'
job '"temperature":0,' >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "rods without noise have none" holds '
    .density.theory == null and (.density.theory_reason | test("temperature"))'
job '"frobnicate":0,' >"$T/job"
ask POST /v1/theory --data-binary "@$T/job"
check "a wrong job is refused" test "$STATUS $TYPE" = "422 application/problem+json"
check "with the field" holds '.errors[0].pointer == "/frobnicate"'

job '"potential":{"type":"cosine","amplitude":6},"realizations":64,' >"$T/job"
post "$T/job"
check "a job runs" until_state "$ID" done
ask GET "/v1/jobs/$ID/results/density"
check "its result stands beside theory" holds '
    (.theory | length) == 10 and (.z | length) == 10 and .reference == "canonical"
    and .degrees_of_freedom == 10 and .p_value >= 0 and .p_value <= 1
    and ((.density[4] - .theory[4]) / .stderr[4] | fabs) < 30'
ask GET "/v1/jobs/$ID/results/density.svg"
check "and the picture shows the curve" grep -q -i theory "$T/body"
finish
