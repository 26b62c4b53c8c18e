#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The daemon as a program: options, what it prints, how it ends, and what it takes.
. "$(dirname "$0")/_lib.sh"

run() { # sets EXIT; output in $T/out and $T/err
    timeout 60 "$B/bcdd" "$@" >"$T/out" 2>"$T/err"
    EXIT=$?
}
wrong() { # TEXT, words the message must hold, options
    text=$1 words=$2
    shift 2
    run "$@"
    check "$text: exit 2" test "$EXIT" = 2
    check "$text: in words" grep -q -- "$words" "$T/err"
    check "$text: nothing on stdout" test ! -s "$T/out"
}

run --version
check "--version" test "$EXIT $(cat "$T/out")" = \
    "0 bcdd $(sed -n 's/^#define BCD_VERSION "\(.*\)"$/\1/p' engine/bcd.h)"
run --help
check "--help" test "$EXIT $(grep -c -e '--data' -e '--listen' -e '--workers' "$T/out")" = "0 4"
wrong "no data" "--data" --workers 1
wrong "an unknown option" "--turbo" --turbo
wrong "an option without its value" "--data" --data
wrong "no workers" "--workers" --data "$T/d" --workers 0
wrong "too many workers" "1024" --data "$T/d" --workers 1025
wrong "workers in words" "--workers" --data "$T/d" --workers two
wrong "a port too high" "--listen" --data "$T/d" --listen 127.0.0.1:65536
wrong "no port" "--listen" --data "$T/d" --listen 127.0.0.1
wrong "a name" "numeric" --data "$T/d" --listen example.org:80
wrong "a way in that there is not" "required" --data "$T/d" --auth never
wrong "a name with a port" "--host-name" --data "$T/d" --host-name lab:80
check "none of these made a directory" test ! -e "$T/d"
: >"$T/file"
run --data "$T/file/sub" --listen 127.0.0.1:0
check "a place that cannot be: exit 1, in words" test "$EXIT" = 1 -a -s "$T/err"

# Times are those of the processor, or the best of several: what else the machine does is no matter.
used() { # hundredths of a second of the daemon's processor time
    set -- $(cut -d ' ' -f 14,15 "/proc/$PID/stat")
    echo $(($1 + $2))
}
started=$(date +%s)
daemon_start "$T/data" --workers 2
took=$(used)
check "it starts in less than 300 ms ($took / 100 s)" test "$took" -lt 30
check "nor does it wait for anything" test $(($(date +%s) - started)) -lt 10
check "and prints where it listens, nothing else" test "$(wc -l <"$T/stdout")" = 1
sleep 0.5
before=$(used)
sleep 1
took=$(($(used) - before))
rss=$(awk '/^VmRSS/ { print $2 }' "/proc/$PID/status")
check "idle it takes less than 40 MB ($rss kB)" test "$rss" -lt 40000
check "and no time ($took / 100 s)" test "$took" -le 2
port=${URL##*:}
run --data "$T/other" --listen "127.0.0.1:$port"
check "a second daemon on the port: exit 1" test "$EXIT" = 1
check "in words" grep -q "Address already in use" "$T/err"
run --data "$T/data" --listen 127.0.0.1:0
check "a second daemon on the data: exit 1" test "$EXIT" = 1
check "in words" test -s "$T/err"
ls -A "$T/data" | sort | tr '\n' ' ' >"$T/listing"
check "its state is in bcd.sqlite and what belongs to it" \
    grep -Eqx 'bcd\.[a-z]+ (bcd\.[a-z-]+ )*' "$T/listing"

# The issue's measure: a small job (50 rods, 10^5 steps) within a second of its POST.
post_text '{"particles":50,"length":100,"diameter":0.5,"time":100,"time_step":0.001,
    "potential":{"type":"cosine","amplitude":6},
    "observables":{"msd":{"first":0.01,"last":10,"points":20},"density":{"bins":50}}}'
check "a small job is done" until_state "$ID" done
ask GET "/v1/jobs/$ID"
check "within a second, as processors count" holds '.outcome.core_seconds | . > 0 and . < 1'
in_5_ms() {
    took=$(curl -sS -o /dev/null -w '%{time_total}' "$URL/v1/jobs/$ID/results/msd")
    jq -ne "$took < 0.005" >"$T/said"
}
check "its MSD comes in less than 5 ms, at best" eventually in_5_ms

# A reader of stdout that went away must not end the daemon; nor does a client that hangs up.
for i in 1 2 3 4 5; do
    printf 'GET / HTTP/1.1\r\nHost: localhost\r\n\r\n' |
        curl -sS -m 0.05 "telnet://127.0.0.1:$port" >/dev/null 2>&1
done
ask GET /healthz
check "clients that hang up do no harm" status_is 200
daemon_end TERM
check "SIGTERM: exit 0" test "$EXIT" = 0
check "the port is free at once" sh -c "
    '$B/bcdd' --listen 127.0.0.1:$port --data '$T/data' >'$T/again' 2>/dev/null & pid=\$!
    for i in \$(seq 600); do test -s '$T/again' || sleep 0.1; done
    kill \$pid; wait \$pid; grep -qx 'listening on http://127.0.0.1:$port' '$T/again'"
if [ -e /proc/net/if_inet6 ] && grep -q '^0*1 ' /proc/net/if_inet6; then
    LISTEN='[::1]:0'
    daemon_start "$T/data" --workers 1
    ask GET /healthz -g
    check "IPv6 loopback works ($URL)" status_is 200
    daemon_end TERM
fi
finish
