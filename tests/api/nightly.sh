#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What the timers run: backups of a daemon at work of which the last few stay, checked; and the look
# through its log.
. "$(dirname "$0")/_lib.sh"
to="$T/backups of the lab"
mkdir "$to"
night() { # OPTION...: its words in $T/said and $T/err, EXIT
    sh deploy/bcdd-backup.sh --bcd "$B/bcd" --to "$to" "$@" >"$T/said" 2>"$T/err"
    EXIT=$?
}
there() { # how many backups, how many with words about them
    find "$to" -name 'bcd-*.sqlite' | wc -l
    find "$to" -name 'bcd-*.json' | wc -l
}
aged() { # YEAR: the newest becomes one of that year
    newest=$(find "$to" -name 'bcd-*.json' | sort | tail -n 1)
    mv "$newest" "$to/bcd-$1.json"
    mv "${newest%.json}.sqlite" "$to/bcd-$1.sqlite"
}
for wrong in "--keep 0" "--keep x" "--keep -1" "--keep 3 --turbo 1" "--keep" ""; do
    # shellcheck disable=SC2086
    night --data "$T/data" $wrong
    check "wrong: \"$wrong\": exit 2, in words" test "$EXIT" = 2 -a -s "$T/err"
done

daemon_start "$T/data" --workers 1
post_text '{"particles":5,"length":10,"time":1,"observables":{"energy":{}}}'
until_state "$ID" done
for year in 2001 2002 2003; do
    night --data "$T/data" --keep 3
    [ "$EXIT" = 0 ] && aged $year
done
check "three nights" test "$(there | tr '\n' ' ')" = "3 3 "
night --data "$T/data" --keep 3
check "a fourth" test "$EXIT" = 0
check "three are kept" test "$(there | tr '\n' ' ')" = "3 3 "
check "the oldest went" test ! -e "$to/bcd-2001.sqlite" -a ! -e "$to/bcd-2001.json"
newest=$(find "$to" -name 'bcd-*.sqlite' | sort | tail -n 1)
check "what is in the new one is said, and kept beside it" \
    test "$(jq -r '"\(.jobs) \(.results)"' "${newest%.sqlite}.json")" = "1 1"
check "it is a whole database" test "$(sqlite3 "$newest" 'pragma integrity_check')" = ok
check "for nobody else to read" test "$(stat -c %a "$newest")" = 600
aged 2004

printf x | dd of="$to/bcd-2002.sqlite" bs=1 seek=5000 conv=notrunc 2>"$T/dd"
night --data "$T/data" --keep 2
check "one that has changed since: exit 1" test "$EXIT" = 1
check "it is named" grep -q 'bcd-2002.sqlite is damaged' "$T/err"
check "and stays, as one that does not count" test -e "$to/bcd-2002.sqlite" -a ! -e "$to/bcd-2003.sqlite"
check "the new one is there" test "$(find "$to" -newer "$T/dd" -name 'bcd-*.sqlite' | wc -l)" -ge 1
aged 2005
rm "$to/bcd-2002.sqlite" "$to/bcd-2002.json"
before=$(there | tr '\n' ' ')
night --data "$T/nothing" --keep 1
check "no directory: it fails, in words" test "$EXIT" != 0 -a -s "$T/err"
mkdir "$T/nothing"
night --data "$T/nothing" --keep 1
check "no database: it fails" test "$EXIT" != 0 -a -s "$T/err"
check "and nothing went, nothing came" test "$(there | tr '\n' ' ')" = "$before"
(
    ulimit -f 40
    night --data "$T/data" --keep 1
    exit "$EXIT"
)
check "a full disk: it fails" test $? != 0
check "nothing went, nothing is left behind" \
    test "$(there | tr '\n' ' ') $(find "$to" -name '*partial*' | wc -l)" = "$before 0"

# ---- the log
ask GET /no/such/page
daemon_end TERM
look() {
    sh deploy/bcdd-log.sh <"$1" >"$T/looked"
    EXIT=$?
}
look "$T/stderr"
check "a log without errors: exit 0" test "$EXIT" = 0
check "its lines are counted" grep -qx "bcdd-log: $(wc -l <"$T/stderr") lines, 0 errors" "$T/looked"
{
    cat "$T/stdout" "$T/stderr"
    echo 'time=2026-01-01T00:00:00.000Z level=warning event=store_full code=13'
    echo 'time=2026-01-01T00:00:01.000Z level=error event=store_broken code=10 message="level=info event=x"'
    echo 'time=2026-01-01T00:00:02.000Z level=error event=store_broken code=11 message="disk"'
    echo 'Main process exited, code=killed'
} >"$T/bad"
look "$T/bad"
check "with errors: exit 1" test "$EXIT" = 1
check "they come first, with the last line of each kind" sh -c \
    "head -n 1 '$T/looked' | grep -q '^error store_broken: 2, the last: .*code=11'"
check "warnings after them" sh -c "sed -n 2p '$T/looked' | grep -q '^warning store_full: 1, '"
check "words of others are shown" grep -q '^no event: 1, the last: Main process' "$T/looked"
: >"$T/empty"
look "$T/empty"
check "an empty log is quiet" test "$EXIT $(cat "$T/looked")" = "0 bcdd-log: 0 lines, 0 errors"
finish
