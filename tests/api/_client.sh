# SPDX-License-Identifier: GPL-3.0-or-later
# _client.sh - bcd, the command line, and what it said. Read with `.` after _lib.sh.
#
#   bcd ARGUMENTS                stdout to $T/out, stderr to $T/err, both also to $T/all; sets EXIT
#   signalled SIGNAL ARGUMENTS   as bcd, and after a moment the signal; later where it came too early
#   usage_error TEXT ARGUMENTS   two checks: exit status 2, and nothing on stdout
unset BCD_TOKEN BCD_URL NO_COLOR
exec </dev/null # what is not given to it, bcd does not read

bcd() {
    "$B/bcd" "$@" >"$T/out" 2>"$T/err"
    EXIT=$?
    cat "$T/out" "$T/err" >>"$T/all"
}

# timeout sends the signal and hands on the exit status. Who was not yet ready for it said nothing.
signalled() {
    sent=$1
    shift
    for after in 0.4 2 10 30; do
        timeout --preserve-status -k 10 -s "$sent" $after "$B/bcd" "$@" >"$T/out" 2>"$T/err"
        EXIT=$?
        [ ! -s "$T/err" ] || break
    done
}

usage_error() {
    usage=$1
    shift
    bcd "$@"
    check "usage: $usage" exits 2
    check "usage: $usage: stdout stays empty" silent out
}

# For check.
exits() {
    [ "$EXIT" -eq "$1" ] && return
    echo "exit status $EXIT"
    cat "$T/err"
    return 1
}
out() { # stdout as JSON
    jq -e "$@" <"$T/out"
}
prints() { # a line of stdout is that
    grep -qxE -- "$1" "$T/out" && return
    cat "$T/out" "$T/err"
    return 1
}
says() { # a part of stderr is that
    grep -qF -- "$1" "$T/err" && return
    cat "$T/err"
    return 1
}
silent() { # out or err
    [ ! -s "$T/$1" ]
}
