#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcdd-log.sh - the daemon's log on stdin: how often each warning and error stands there, errors
# first, each with the last line of its kind. Exit status 1 if there was an error, 0 otherwise.
LC_ALL=C awk '
    function value(key,    at, rest) {
        at = index(" " $0, " " key "=")
        rest = substr($0, at + length(key) + 1)
        sub(/ .*/, "", rest)
        return at ? rest : ""
    }
    /^time=[^ ]+ level=(info|warning|error) event=/ {
        lines++
        level = value("level")
        if (level == "info")
            next
        kind = level " " value("event")
        count[kind]++
        last[kind] = $0
        errors += level == "error"
        next
    }
    /^listening on http/ { lines++; next }
    NF { other++; stray = $0 }
    END {
        for (pass = 1; pass <= 2; pass++)
            for (kind in count)
                if ((kind ~ /^error /) == (pass == 1))
                    printf "%s: %d, the last: %s\n", kind, count[kind], last[kind]
        if (other)
            printf "no event: %d, the last: %s\n", other, stray
        printf "bcdd-log: %d lines, %d errors\n", lines + other, errors
        exit errors > 0
    }'
