#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What one daemon carries, on one core of its own: 500 workers that behave badly now and then, while
# people look and submit; then as many results as it can take. Numbers stand on lines that begin
# with "#"; deploy/OPERATING.md quotes them.
# Alone: it measures times.
. "$(dirname "$0")/_crowd.sh"

# Of the daemon: processor seconds, kB of memory, descriptors, results so far, bytes of the
# database, ns of the clock.
page() {
    awk -v hz="$(getconf CLK_TCK)" '{ printf "%.2f ", ($14 + $15) / hz }' /proc/"$PID"/stat
    awk '/^VmRSS/ { printf "%d ", $2 }' /proc/"$PID"/status
    find /proc/"$PID"/fd -type l | wc -l | tr '\n' ' '
    curl -sS -m 20 -H "Authorization: Bearer $(cat "$T/admin")" "$URL/metrics" |
        awk '$1 == "bcd_leases_returned_total" { printf "%d ", $2 }'
    stat -c %s "$T"/data/bcd.sqlite | tr '\n' ' '
    date +%s%N
}
# Pages every second from when the crowd is at work, into $T/pages.
watch() { # SECONDS_BEFORE SECONDS
    sleep "$1"
    for second in $(seq "$2"); do
        page
        sleep 1
    done >"$T/pages"
}
calc() {
    awk "BEGIN { x = ($1); printf \"%.4g\", x }"
}
true_that() {
    [ "$(calc "$1")" = 1 ]
}
at() { # first|last FIELD
    case $1 in first) head -n 1 "$T/pages" ;; *) tail -n 1 "$T/pages" ;; esac | cut -d ' ' -f "$2"
}
grown() { # FIELD
    calc "$(at last "$1") - $(at first "$1")"
}
carried() {
    seconds=$(calc "$(grown 6) * 1e-9")
    RATE=$(calc "$(grown 4) / $seconds")
    SHARE=$(calc "$(grown 1) / $seconds")
    echo "# $RATE results a second in $seconds s; $SHARE cores of the daemon," \
        "$(calc "1000 * $(grown 1) / $(grown 4)") ms for each;" \
        "$(at first 2) to $(at last 2) kB of memory, $(at first 3) to $(at last 3) descriptors"
}
one_core() {
    [ "$(nproc)" -lt 2 ] || ! command -v taskset >/dev/null || taskset -apc 0 "$PID" >"$T/said"
}

# ---------------------------------------- 500 workers, each with chunks of ten seconds
crowd_daemon 512 30
one_core
crowd_sweep 1000 2000 4
crowd_sweep 50000 50 64
watch 16 20 &
crowd_work --workers 500 --seconds 300 --work 10000 --gone 3 --late 3 --twice 10 --broken 5
wait $!
carried
crowd_ledger
check "of each kind there were some" says '.gone > 0 and .late > 0 and .doubled > 0 and .broken > 0'
check "jobs have the bits of one machine" same_bits 1007 4
check "also those of several chunks" same_bits 50003 64
check "workers, lookers and submitters have an answer within a second" says \
    '[.ms[]] | all(.p99 < 1000)'
check "small pages in 50 ms" says '[.ms.healthz, .ms.job, .ms.page] | all(.median < 50)'
check "a core is enough for it" true_that "$SHARE < 0.75"
check "memory stays" true_that "$(grown 2) < 0.2 * $(at first 2)"
check "so do descriptors" true_that "$(grown 3) < 20"
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
echo "# $(calc "$(stat -c %s "$T/data/bcd.sqlite") / $("$B/bcd" sql --data "$T/data" --csv \
    'select count(*) from jobs' | tail -n 1)") bytes of the database for each job"

# ------------------------------------------------------ as many results as it can take
rm -rf "$T/data"
SWEEPS=
crowd_daemon 512 30
one_core
crowd_sweep 1000 6000 4
watch 4 10 &
crowd_work --workers 100 --seconds 200 --work 0
wait $!
carried
check "a hundred results a second are no trouble" true_that "$RATE > 100"
finish
