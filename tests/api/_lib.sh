# SPDX-License-Identifier: GPL-3.0-or-later
# _lib.sh - a daemon of the test's own, requests by curl, checks as TAP. Read with `.` by the others.
#
#   daemon_start DIR [options]   starts one on a free port; sets PID and URL (its workers do not give
#                                way: tests have deadlines)
#   daemon_end SIGNAL            ends it and waits; sets EXIT
#   ask METHOD PATH [curl ...]   sets STATUS and TYPE; the answer is in $T/body and $T/head
#   post FILE | post_text JSON   submits a job with ask; sets ID
#   until_state ID STATE [s]     waits for it (120 s); fails when another final state comes
#   eventually COMMAND ...       waits until the command succeeds, a minute at most
#   check TEXT COMMAND ...       one TAP line: does the command succeed?
#   finish                       the plan; the last command of a script
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
T=$(mktemp -d)
PID=
LISTEN=127.0.0.1:0
COUNT=0
FAILED=0
trap 'cleanup' EXIT
trap 'exit 130' INT TERM

cleanup() {
    [ -z "$PID" ] || kill -9 "$PID" 2>/dev/null
    rm -rf "$T"
}

daemon_start() {
    data=$1
    shift
    : >"$T/stdout"
    "$B/bcdd" --listen "$LISTEN" --data "$data" --nice 0 "$@" >"$T/stdout" 2>>"$T/stderr" &
    PID=$!
    URL=
    end=$(($(date +%s) + 60))
    while [ -z "$URL" ] && [ "$(date +%s)" -lt $end ] && kill -0 "$PID" 2>/dev/null; do
        sleep 0.01
        URL=$(sed -n '1s/^listening on \(http:\/\/.*:[1-9][0-9]*\)$/\1/p' "$T/stdout")
    done
    [ -n "$URL" ] && return
    echo "Bail out! the daemon did not start"
    cat "$T/stdout" "$T/stderr"
    exit 1
}

daemon_end() {
    kill "-$1" "$PID"
    wait "$PID" 2>/dev/null
    EXIT=$?
    PID=
}

ask() {
    method=$1 path=$2
    shift 2
    STATUS=$(curl -sS -m 60 -X "$method" -o "$T/body" -D "$T/head" -w '%{http_code}' "$@" "$URL$path")
    TYPE=$(tr -d '\r' <"$T/head" | sed -n 's/^[Cc]ontent-[Tt]ype: //p')
}

post() {
    ask POST /v1/jobs --data-binary "@$1"
    ID=$(jq -r '.id // empty' "$T/body" 2>/dev/null)
}

post_text() {
    printf '%s' "$1" >"$T/job"
    post "$T/job"
}

until_state() {
    end=$(($(date +%s) + ${3:-120}))
    while :; do
        now=$(curl -sS -m 60 "$URL/v1/jobs/$1" | jq -r .state)
        [ "$now" = "$2" ] && return
        case $now in
        done | failed | cancelled) return 1 ;;
        esac
        [ "$(date +%s)" -lt "$end" ] || return 1
        sleep 0.02
    done
}

eventually() {
    given_up=$(($(date +%s) + 60))
    until "$@"; do
        [ "$(date +%s)" -lt $given_up ] || return 1
        sleep 0.05
    done
}

check() {
    text=$1
    shift
    COUNT=$((COUNT + 1))
    if "$@" >"$T/check" 2>&1; then
        echo "ok $COUNT - $text"
    else
        FAILED=$((FAILED + 1))
        echo "not ok $COUNT - $text"
        printf '# %s\n' "$*"
        echo "# status ${STATUS:-}, type ${TYPE:-}"
        head -c 2000 "$T/body" 2>/dev/null | sed 's/^/# /'
        sed 's/^/# /' "$T/check"
    fi
}

# For check: what the last answer was.
status_is() {
    [ "$STATUS" = "$1" ]
}
type_is() {
    [ "$TYPE" = "$1" ]
}
header_is() {
    tr -d '\r' <"$T/head" | grep -qix "$1: $2"
}
body_is() {
    [ "$(cat "$T/body")" = "$1" ]
}
holds() {
    jq -e "$@" "$T/body"
}

finish() {
    echo "1..$COUNT"
    [ "$FAILED" -eq 0 ] || [ ! -s "$T/stderr" ] || tail -n 30 "$T/stderr" | sed 's/^/# /'
    [ "$FAILED" -eq 0 ]
}
