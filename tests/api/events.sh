#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What happens to jobs, as it happens: event streams, ?wait=, ETag and 304.
. "$(dirname "$0")/_lib.sh"

SHORT='{"particles":2,"length":10,"time":1,"observables":{"energy":{},"msd":{"first":0.01,"last":0.1,"points":3}}}'
LONG='{"particles":100,"length":200,"diameter":0.5,"time":1e6,"observables":{"msd":{"first":0.01,"last":1,"points":5}}}'
# About half a second of work.
SOME='{"particles":200,"length":400,"diameter":0.5,"time":1500,"realizations":2,"observables":{"msd":{"first":0.01,"last":1,"points":5}}}'

# listen FILE PATH [curl ...]: a stream into a file, in the background
listen() {
    file=$1 path=$2
    shift 2
    curl -sSN -m 250 "$@" -D "$file.head" -o "$file" "$URL$path" &
    LISTENER=$!
}

# data FILE EVENT: the data of all events of a kind, one a line
data() {
    tr -d '\r' <"$1" | awk -v event="event: $2" '$0 == event { on = 1; next }
        /^data: / && on { print substr($0, 7) } /^$/ { on = 0 }'
}

# until_seen FILE TEXT
until_seen() {
    eventually grep -q -- "$2" "$1" 2>/dev/null
}

daemon_start "$T/data" --workers 1

# ---------------------------------------------------------------- one job
listen "$T/all" /v1/events
ALL=$LISTENER
until_seen "$T/all" '^event: counts'
post_text "$SOME"
SOME_ID=$ID
listen "$T/job" "/v1/jobs/$SOME_ID/events"
wait "$LISTENER"
check "a job's stream ends after done" [ $? -eq 0 ]
data "$T/job" progress >"$T/progress"
data "$T/job" done >"$T/done"
check "it tells progress, each with id, state and progress in [0, 1]" jq -es --arg id "$SOME_ID" \
    'length >= 2 and all(.id == $id and (.state | IN("queued", "running", "done"))
                         and .progress >= 0 and .progress <= 1)' "$T/progress"
check "which never goes back" jq -es 'map(.progress) | . == sort' "$T/progress"
check "and there is one done with the job's state" jq -es --arg id "$SOME_ID" \
    '. == [{id: $id, state: "done", progress: 1}]' "$T/done"
check "done comes last" [ "$(grep '^event:' "$T/job" | tail -n 1 | tr -d '\r')" = "event: done" ]
stream_head() {
    tr -d '\r' <"$T/$1.head" | grep -qix "$2"
}
check "it is an event stream" stream_head job 'Content-Type: text/event-stream'
check "that nobody stores" stream_head job 'Cache-Control: no-store'
check "or buffers" stream_head job 'X-Accel-Buffering: no'

started=$(date +%s%N)
listen "$T/again" "/v1/jobs/$SOME_ID/events"
wait "$LISTENER"
took=$((($(date +%s%N) - started) / 1000000))
check "of a job that has ended there is done at once" [ "$took" -lt 10000 ] # others go on for ever
check "and nothing else" [ "$(data "$T/again" done | jq -r .state)" = "done" ]
ask GET /v1/jobs/jnone/events
check "of a job that is not there: 404" status_is 404
ask HEAD "/v1/jobs/$SOME_ID/events" -I
check "HEAD of a stream ends" status_is 200

post_text "$LONG"
LONG_ID=$ID
listen "$T/cancelled" "/v1/jobs/$LONG_ID/events"
until_seen "$T/cancelled" '"running"'
ask DELETE "/v1/jobs/$LONG_ID"
wait "$LISTENER"
check "a job that is cancelled is done, too" \
    [ "$(data "$T/cancelled" done | jq -r .state)" = cancelled ]

# ---------------------------------------------------------------- all jobs
counted() { # STREAM COUNTS: the last ones
    data "$1" counts >"$T/counts"
    jq -es "last == $2" "$T/counts" >"$T/said"
}
check "one stream tells how many are in each state" eventually counted "$T/all" \
    '{queued: 0, running: 0, done: 1, failed: 0, cancelled: 1}'
eventually grep -q '"state":"cancelled"' "$T/all"
data "$T/all" job >"$T/jobs"
check "and of all jobs" jq -es --arg some "$SOME_ID" --arg long "$LONG_ID" \
    '([.[] | select(.id == $some)] | last | .state == "done" and .progress == 1) and
     ([.[] | select(.id == $long)] | last | .state == "cancelled") and
     any(.state == "running" and .progress > 0 and .owner == "local")' "$T/jobs"
check "nothing follows a job's end" jq -es --arg some "$SOME_ID" \
    '[.[] | select(.id == $some) | .state] | index("done") == length - 1' "$T/jobs"
last=$(tr -d '\r' <"$T/all" | sed -n 's/^id: //p' | tail -n 1)
post_text "$SHORT"
SHORT_ID=$ID
until_state "$SHORT_ID" 'done'
listen "$T/resumed" /v1/events -H "Last-Event-ID: $last"
RESUMED=$LISTENER
until_seen "$T/resumed" '^event: counts'
check "Last-Event-ID: what was missed is told" \
    [ "$(data "$T/resumed" job | jq -r "select(.state == \"done\").id")" = "$SHORT_ID" ]
listen "$T/lost" /v1/events -H "Last-Event-ID: 1-7"
LOST=$LISTENER
until_seen "$T/lost" '^event: counts'
check "an id of another start: something is lost" grep -q '^event: lost' "$T/lost"
listen "$T/nobody" '/v1/events?owner=nobody'
NOBODY=$LISTENER
until_seen "$T/nobody" '^retry: '
ask GET '/v1/events?owner=A.B'
check "no such owner can be: 400" status_is 400
ask GET '/v1/events?nonsense=1'
check "no such parameter: 400" status_is 400

# ---------------------------------------------------------------- a sweep
ask POST /v1/sweeps -d "{\"base\":$SHORT,\"axes\":{\"/seed\":{\"first\":5,\"count\":3}}}"
SWEEP=$(jq -r .id "$T/body")
listen "$T/sweep" "/v1/events?sweep=$SWEEP"
OF_SWEEP=$LISTENER
listen "$T/local" '/v1/events?owner=local'
OF_LOCAL=$LISTENER
check "counts of a sweep's points" eventually counted "$T/sweep" \
    '{queued: 0, running: 0, done: 3, failed: 0, cancelled: 0}'
ask GET '/v1/events?sweep=snone'
check "no such sweep: 404" status_is 404

# ---------------------------------------------------------------- ?wait=
post_text "$(echo "$LONG" | sed 's/1e6/3e6/')"
started=$(date +%s%N)
ask GET "/v1/jobs/$ID?wait=0.1"
took=$((($(date +%s%N) - started) / 1000000))
check "?wait= ends when the time is over" [ "$took" -ge 99 ]
check "with the record as it is" holds '.state == "queued" or .state == "running"'
ask DELETE "/v1/jobs/$ID"
post_text "$(echo "$SOME" | sed 's/1500/1501/')"
WAITED_ID=$ID
ask GET "/v1/jobs/$WAITED_ID?wait=55"
check "or with the job's end" holds '.state == "done" and .progress == 1'
for bad in -1 61 x nan ''; do
    ask GET "/v1/jobs/$WAITED_ID?wait=$bad"
    check "wait=$bad: 400" status_is 400
done
tells_of_waited() {
    data "$T/local" job | grep -q "$WAITED_ID"
}
check "the owner's listener heard of it" eventually tells_of_waited
check "another owner's heard nothing of all that" [ -z "$(data "$T/nobody" job)" ]
check "nor did the sweep's" [ -z "$(data "$T/sweep" job | grep "$WAITED_ID")" ]
check "nor did the owner's hear counts, which are of all" [ -z "$(data "$T/local" counts)" ]

# ---------------------------------------------------------------- ETag
tag_of() {
    tr -d '\r' <"$T/head" | sed -n 's/^[Ee][Tt]ag: //p'
}
tags=
for what in "$SHORT_ID" "$SHORT_ID/results" "$SHORT_ID/results/msd" "$SHORT_ID/results/energy" \
    "$SHORT_ID/results/msd.csv" "$SHORT_ID/results/msd.svg" "$WAITED_ID/results/msd"; do
    ask GET "/v1/jobs/$what"
    tag=$(tag_of)
    tags="$tags$tag
"
    ask GET "/v1/jobs/$what" -H "If-None-Match: \"other\", $tag"
    check "$what: 304 for who has it" status_is 304
    check "... without a body, with the tag" [ "$(tag_of)" = "$tag" ] && [ ! -s "$T/body" ]
    ask GET "/v1/jobs/$what" -H 'If-None-Match: "other"'
    check "... and all of it for others" status_is 200
done
for path in /openapi.json /v1/schema/job; do
    ask GET "$path"
    ask GET "$path" -H "If-None-Match: $(tag_of)"
    check "$path: 304 for who has it" status_is 304
done
check "each has a tag of its own" [ "$(printf %s "$tags" | sort -u | grep -c '^"[a-z0-9.-]*"$')" = 7 ]
post_text "$(echo "$LONG" | sed 's/1e6/2e6/')"
ask GET "/v1/jobs/$ID"
check "a job in motion has none" [ -z "$(tag_of)" ]
ask GET "/v1/jobs/$SHORT_ID/results/none" -H "If-None-Match: $tag"
check "nor has what is not there" status_is 404

# ---------------------------------------------------------------- the end
listen "$T/last" "/v1/jobs/$ID/events"
until_seen "$T/last" '"running"'
curl -sS -m 100 "$URL/v1/jobs/$ID?wait=60" -o "$T/held" &
HELD=$!
one_waits() {
    curl -sS -m 60 "$URL/metrics" | grep -x 'bcd_http_waiting 1' >"$T/said"
}
check "somebody waits" eventually one_waits
started=$(date +%s%N)
daemon_end TERM
took=$((($(date +%s%N) - started) / 1000000))
wait "$LISTENER"
check "streams end when the server stops" [ $? -eq 0 ]
wait "$HELD"
check "and who waits is answered" [ "$(jq -r .id "$T/held")" = "$ID" ]
check "nobody waits for the other" [ "$took" -lt 20000 ] # a minute, if they did
check "the server was content" [ "$EXIT" -eq 0 ]
wait "$OF_SWEEP" "$OF_LOCAL" "$ALL" "$RESUMED" "$LOST" "$NOBODY"
finish
