#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What a server does while both workers compute: small GETs, event streams, and what they cost the
# workers. Processor times are held against bounds on any machine; rates only where nothing else
# runs, for another program's share cannot be told from a slow server.
# Alone: it measures.
. "$(dirname "$0")/_lib.sh"

SHORT='{"particles":2,"length":10,"time":1,"observables":{"energy":{}}}'
LONG='{"particles":1000,"length":2000,"diameter":0.5,"time":1e5,"realizations":8,"observables":{"msd":{"first":0.01,"last":1,"points":5}}}'
SECONDS_EACH=4
STREAMS=100

# Numbers of the server: processor seconds of workers, of all else, steps of rods, requests.
page() {
    curl -sS -m 20 "$URL/metrics" | awk '
        /^bcd_core_seconds_total/ { core = $2 } /^process_cpu_seconds_total/ { all = $2 }
        /^bcd_rod_steps_total/ { steps = $2 } /^bcd_http_requests_total/ { n += $NF }
        END { printf "%.6f %.6f %.0f %d\n", core, all - core, steps, n }'
}
# Processor seconds that this machine gave to anybody; seconds since it started.
machine() {
    awk -v hz="$(getconf CLK_TCK)" '/^cpu / { print ($2 + $3 + $4 + $7 + $8) / hz }' /proc/stat
}
now() {
    cut -d ' ' -f 1 /proc/uptime
}
# calc EXPRESSION: its value
calc() {
    awk "BEGIN { x = ($1); printf \"%.4g\", x }"
}
true_that() {
    [ "$(calc "$1")" = 1 ]
}
# checked_rate TEXT CONDITION: skipped when other programs took more than a tenth of the machine
checked_rate() {
    if true_that "$OTHERS > 0.1"; then
        COUNT=$((COUNT + 1))
        echo "ok $COUNT - $1 # SKIP other programs have $OTHERS of the machine"
    else
        check "$1" true_that "$2"
    fi
}

command -v wrk >/dev/null || sh deploy/install-packages.sh long
daemon_start "$T/data" --workers 2 --log changes --nice 5
post_text "$SHORT"
SHORT_ID=$ID
until_state "$SHORT_ID" 'done'

# --------------------------------------------------------- a server that does nothing
switches() {
    cat /proc/"$PID"/task/*/status | awk '/^voluntary_ctxt/ { n += $2 } END { print n }'
}
sleep 1
before=$(switches)
sleep 5
echo "# without clients: $(calc "($(switches) - $before) / 5") wakes a second"
check "a server that nobody asks sleeps" true_that "($(switches) - $before) / 5 < 5"

post_text "$LONG"
LONG_ID=$ID
until_state "$LONG_ID" running
sleep 1

# ------------------------------------------------------------------- small GETs
for what in /healthz "/v1/jobs/$SHORT_ID"; do
    # shellcheck disable=SC2046
    set -- $(page) $(machine) $(now)
    wrk -t1 -c32 -d${SECONDS_EACH}s "$URL$what" >"$T/wrk"
    # core others steps requests machine now, before and after
    # shellcheck disable=SC2046
    set -- "$@" $(page) $(machine) $(now)
    rate=$(awk '/^Requests\/sec/ { print $2 }' "$T/wrk")
    cost_us=$(calc "1e6 * ($8 - $2) / (${10} - $4)")
    # What was neither the server's nor (about as much again at most) the client's.
    client=$(calc "$cost_us * 1e-6 * (${10} - $4)")
    OTHERS=$(calc "(${11} - $5 - ($7 - $1) - ($8 - $2) - $client) / (${12} - $6) / $(nproc)")
    echo "# GET $what: $rate a second, $cost_us us of the server's processor time each;" \
        "workers had $(calc "($7 - $1) / (${12} - $6)") cores, other programs $OTHERS of the machine"
    check "GET $what is answered" sh -c '! grep -q "Non-2xx" "$1"' - "$T/wrk"
    check "GET $what takes less than 150 us of a processor" true_that "$cost_us < 150"
    checked_rate "10000 a second while both workers compute" "$rate >= 10000"
done

# --------------------------------------------------- what 100 GETs a second cost the workers
# In turns, for the machine is not always equally fast.
i=0
: >"$T/ratios"
while [ $i -lt 5 ]; do
    i=$((i + 1))
    # shellcheck disable=SC2046
    set -- $(page) $(now)
    sleep 2
    # shellcheck disable=SC2046
    set -- "$@" $(page) $(now)
    alone=$(calc "($8 - $3) / (${10} - $5)")
    # shellcheck disable=SC2046
    set -- $(page) $(machine) $(now)
    curl -sS --rate 100/s "$URL/v1/jobs/$SHORT_ID#[1-200]" -o /dev/null
    # shellcheck disable=SC2046
    set -- "$@" $(page) $(machine) $(now)
    served=$(calc "${10} - $4")
    asked=$(calc "($9 - $3) / (${12} - $6)")
    OTHERS=$(calc "(${11} - $5 - ($7 - $1) - ($8 - $2)) / (${12} - $6) / $(nproc)")
    echo "$(calc "$asked / $alone") $(calc "$served / (${12} - $6)") $(calc "($8 - $2) / (${12} - $6)") $OTHERS" >>"$T/ratios"
done
median() {
    cut -d ' ' -f "$1" "$T/ratios" | sort -g | sed -n 3p
}
OTHERS=$(median 4)
echo "# at $(median 2) GETs a second the workers step at $(median 1) of their speed;" \
    "serving takes $(median 3) cores"
checked_rate "they were asked often enough" "$(median 2) > 50"
check "serving 100 a second takes less than 5 % of a core" true_that "$(median 3) < 0.05"
checked_rate "the workers lose less than 5 %" "$(median 1) > 0.95"

# --------------------------------------------------------------------- streams
# Of a job that moves on by more than a thousandth whenever they look.
ask DELETE "/v1/jobs/$LONG_ID"
post_text "$(echo "$LONG" | sed 's/1e5/3e3/')"
LONG_ID=$ID
until_state "$LONG_ID" running
for what in "/v1/jobs/$LONG_ID/events" /v1/events; do
    i=0
    while [ $i -lt $STREAMS ]; do
        i=$((i + 1))
        printf 'url = "%s%s"\noutput = "%s/stream%d"\n' "$URL" "$what" "$T" $i
    done >"$T/streams"
    curl -sN -Z --parallel-immediate --parallel-max $STREAMS -m 9 -K "$T/streams" >/dev/null 2>&1 &
    CLIENT=$!
    sleep 1.5
    open=$(curl -sS "$URL/metrics" | sed -n 's/^bcd_http_streams //p')
    # shellcheck disable=SC2046
    set -- $(page) $(now)
    sleep 5
    # shellcheck disable=SC2046
    set -- "$@" $(page) $(now)
    share=$(calc "($7 - $2) / (${10} - $5)")
    wait $CLIENT
    echo "# $open streams of $what: $share cores," \
        "$(grep -c '^event: ' "$T/stream1") events in the first"
    check "$STREAMS streams are open" [ "$open" = $STREAMS ]
    check "they tell something" [ "$(grep -c '^event: ' "$T/stream1")" -ge 3 ]
    check "and take less than 5 % of a core" true_that "$share < 0.05"
done
finish
