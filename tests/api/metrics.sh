#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What operators look at: /metrics, /readyz, request ids and the log.
. "$(dirname "$0")/_lib.sh"

SHORT='{"particles":2,"length":10,"time":1,"observables":{"energy":{}}}'
LONG='{"particles":100,"length":200,"diameter":0.5,"time":1e6,"observables":{"msd":{"first":0.01,"last":1,"points":5}}}'

# The text format, strictly: every series below its own HELP and TYPE, none twice, counters named
# and never negative, buckets that grow up to the count.
well_formed() {
    awk '
        function wrong(what) { print FILENAME ":" FNR ": " what ": " $0; bad = 1 }
        /^# HELP / { if ($3 in helped) wrong("second HELP"); helped[$3] = 1; name = $3
                     if (NF < 4) wrong("no text"); next }
        /^# TYPE / { if ($3 != name || $3 in type) wrong("TYPE"); type[$3] = $4
                     if ($4 !~ /^(counter|gauge|histogram)$/) wrong("type")
                     if (($4 == "counter") != ($3 ~ /_total$/)) wrong("name of a counter"); next }
        !/^[a-z_]+(\{[a-z_]+="[^"\\\n]*"(,[a-z_]+="[^"\\\n]*")*\})? [-+0-9.e]+$/ { wrong("sample"); next }
        { series = $0; sub(/ [^ ]*$/, "", series); value = $NF
          base = series; sub(/\{.*/, "", base); stem = base
          if (type[name] == "histogram") sub(/_(bucket|sum|count)$/, "", stem)
          if (stem != name) wrong("not below its TYPE")
          if (series in seen) wrong("twice")
          seen[series] = value; count++
          if (type[name] == "counter" && value < 0) wrong("negative")
          if (base == name "_bucket") { if (value < last) wrong("falls"); last = value
                                        if (series ~ /le="\+Inf"/) inf = value }
          if (base == name "_count") { if (value != inf) wrong("count"); last = 0 } }
        END { if (count < 30) { print "only " count " series"; bad = 1 } exit bad }' "$1"
}
# value SERIES: of the last page
value() {
    awk -v series="$1" '{ s = $0; sub(/ [^ ]*$/, "", s) } s == series { print $NF; found = 1 }
                        END { exit !found }' "$T/body"
}
is() {
    [ "$(value "$1")" = "$2" ]
}
more() {
    awk -v v="$(value "$1")" -v least="$2" 'BEGIN { exit !(v >= least) }'
}

daemon_start "$T/data" --workers 2 --nice 7
give_way() { # once each thread has come to it
    ps -L -o ni=,comm= -p "$PID" >"$T/threads"
    awk '($1 == 7) != ($2 ~ /^(worker|finisher)$/) { bad = 1 } $1 == 7 { n++ } END { exit bad || n < 2 }' "$T/threads"
}
check "workers give way, and nobody else" eventually give_way
ask GET /readyz
check "a new server is ready" holds '. == {"status": "ready"}'
post_text "$SHORT"
SHORT_ID=$ID
until_state "$SHORT_ID" 'done'
post_text "$LONG"
until_state "$ID" running
ask GET /v1/jobs/nothing
ask GET /nowhere
ask GET "/v1/jobs/$SHORT_ID?wait=0.2"
ask GET "/v1/jobs/$ID?wait=0.2"
curl -sN -m 250 "$URL/v1/events" >"$T/events" &
STREAM=$!
eventually grep -q '^event: counts' "$T/events"
ask GET /metrics
cp "$T/body" "$T/page"
check "/metrics is Prometheus text" type_is 'text/plain; version=0.0.4; charset=utf-8'
check "well formed" well_formed "$T/page"
check "jobs by state" is 'bcd_jobs{state="done"}' 1
check "and running" is 'bcd_jobs{state="running"}' 1
check "workers" is bcd_workers 2
check "one is busy" is bcd_workers_busy 1
check "chunks" is bcd_chunks_total 1
check "steps of rods" more bcd_rod_steps_total 1000
check "core seconds" more bcd_core_seconds_total 0.001
check "requests by route" is 'bcd_http_requests_total{method="POST",route="/v1/jobs",class="2xx"}' 2
check "by class" is 'bcd_http_requests_total{method="GET",route="/v1/jobs/{id}",class="4xx"}' 1
check "also those without a route" is 'bcd_http_requests_total{method="",route="",class="4xx"}' 1
check "open streams" is bcd_http_streams 1
check "the histogram leaves out what waits" sh -c '[ "$1" -ge 5 ] && [ "$1" -lt "$2" ]' - \
    "$(value bcd_http_request_seconds_count)" \
    "$(awk '/^bcd_http_requests_total/ { n += $NF } END { print n }' "$T/body")"
check "transactions" more bcd_store_commits_total 4
check "no failures" is 'bcd_store_failures_total{cause="broken"}' 0
check "the database" more bcd_store_bytes 4096
check "memory" more process_resident_memory_bytes 1e6
check "descriptors" more process_open_fds 8
check "the start, some seconds ago" sh -c '[ $(($(date +%s) - $1)) -ge 0 ] && [ $(($(date +%s) - $1)) -lt 600 ]' - \
    "$(value process_start_time_seconds)"
check "the build" sh -c 'grep -q "^bcd_build_info{version=\"[0-9.]*\",result_version=\"[0-9]*\"} 1$" "$1"' - "$T/page"
kill "$STREAM"
wait "$STREAM" 2>/dev/null
ask GET /v1/jobs?limit=600 -H 'X-Request-Id: mine-1'
check "a request's id comes back" header_is X-Request-Id mine-1
ask GET "/v1/jobs?state=done&secret=1" -H 'X-Request-Id: mine-2'
line() {
    grep -E "event=request .*request=$1( |\$)" "$T/stderr"
}
eventually line mine-2 >"$T/line"
line mine-1 >"$T/line"
check "one line tells of it" [ "$(wc -l <"$T/line")" = 1 ]
check "all there is to tell" grep -Eq \
    'method=GET path=/v1/jobs status=200 bytes=[0-9]+ ms=[0-9.e-]+ owner=local request=mine-1 end=whole$' "$T/line"
check "and what was made by whom" grep -Eq "method=POST path=/v1/jobs status=202 .*location=/v1/jobs/$SHORT_ID$" "$T/stderr"
check "but not what is asked for" sh -c '! grep -q secret "$1"' - "$T/stderr"
daemon_end TERM

# A disk without room: what stands is served, but the server is not ready.
: >"$T/stderr"
: >"$T/stdout" # or the port of the one before is read there
(
    ulimit -f 1000 # blocks of 512 bytes: room for the schema and some jobs
    exec "$B/bcdd" --listen 127.0.0.1:0 --data "$T/full" --workers 1 --log changes \
        >"$T/stdout" 2>>"$T/stderr"
) &
PID=$!
until URL=$(sed -n 's/^listening on //p' "$T/stdout") && [ -n "$URL" ]; do
    kill -0 "$PID" 2>/dev/null || { echo "Bail out! it did not start"; exit 1; }
    sleep 0.02
done
i=0
STATUS=202
while [ "$STATUS" = 202 ] && [ $i -lt 1000 ]; do
    i=$((i + 1))
    post_text "{\"particles\":2,\"length\":10,\"time\":1,\"seed\":$i,\"observables\":{\"energy\":{}}}"
done
check "the disk is full" status_is 507
ask GET /readyz
check "then the server is not ready" status_is 503
check "and says why" holds '[.errors[].pointer] | index("/store") != null'
ask GET /healthz
check "though alive" status_is 200
ask GET /metrics
check "failures are counted" more 'bcd_store_failures_total{cause="full"}' 1
ask GET /v1/jobs -H 'X-Request-Id: quiet-1'
ask GET /v1/jobs/none -H 'X-Request-Id: loud-1'
check "--log changes: a line for a read that fails" eventually grep -q loud-1 "$T/stderr"
check "but not for one that goes well" sh -c '! grep -q quiet-1 "$1"' - "$T/stderr"
daemon_end KILL
check "--nice takes 0 to 19" sh -c '! "$1/bcdd" --data "$2" --nice 20 2>/dev/null' - "$B" "$T/x"
check "--log takes two words only" sh -c '! "$1/bcdd" --data "$2" --log some 2>/dev/null' - "$B" "$T/x"
finish
