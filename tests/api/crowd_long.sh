#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What one daemon carries: 500 workers that behave badly now and then, on one core of the daemon's,
# while people look and submit. Then as many results as it can take. Numbers stand on lines that
# begin with "#"; README and deploy/OPERATING.md quote them.
# Alone: it measures times.
. "$(dirname "$0")/_crowd.sh"

# Of the daemon: processor seconds, kB of memory, descriptors, bytes in files.
now_of_daemon() {
    awk -v hz="$(getconf CLK_TCK)" '{ printf "%.2f ", ($14 + $15) / hz }' /proc/"$PID"/stat
    awk '/^VmRSS/ { printf "%d ", $2 }' /proc/"$PID"/status
    find /proc/"$PID"/fd -type l | wc -l | tr '\n' ' '
    cat "$T"/data/bcd.sqlite* | wc -c
}
calc() {
    awk "BEGIN { x = ($1); printf \"%.4g\", x }"
}
true_that() {
    [ "$(calc "$1")" = 1 ]
}
one_core() {
    [ "$(nproc)" -lt 2 ] || taskset -apc 0 "$PID" >"$T/said"
}
# Looks at the daemon once the crowd is at work, and again some seconds later.
watch() { # SECONDS: sets BEFORE and AFTER, and RATE of chunks
    sleep 6
    BEFORE="$(now_of_daemon) $(metric bcd_leases_returned_total) $(date +%s%N)"
    sleep "$1"
    AFTER="$(now_of_daemon) $(metric bcd_leases_returned_total) $(date +%s%N)"
}
between() { # FIELD: how much more
    calc "$(echo "$AFTER" | cut -d ' ' -f "$1") - $(echo "$BEFORE" | cut -d ' ' -f "$1")"
}
at_end() { # FIELD
    echo "$AFTER" | cut -d ' ' -f "$1"
}

# ------------------------------------------------- 500 workers, chunks of 5 s, leases of 2 s
crowd_daemon 512
one_core
crowd_sweep 1000 3000 4
crowd_sweep 50000 100 64
watch 20 >"$T/watched" &
crowd_work --workers 500 --seconds 200 --work 5000 --gone 2 --late 3 --twice 5 --broken 3
