#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A backup made while jobs run, from the directory and from the server: a daemon on the copy has all
# finished results byte for byte, and ends unfinished jobs with the same bits. What fails leaves
# nothing.
. "$(dirname "$0")/_lib.sh"

job() { # SEED TIME
    printf '{"particles":30,"length":60,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"realizations":3,"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},'
    printf '"msd":{"first":0.01,"last":1,"points":10},"density":{"bins":20}}}'
}
results() { # ID FILE
    curl -sSf -m 60 -o "$2" "$URL/v1/jobs/$1/results"
}
backup() { # FILE...: words to $T/said, status in EXIT
    "$B/bcd" backup --data "$T/data" "$@" >"$T/said" 2>"$T/err"
    EXIT=$?
}
said() {
    jq -e "$@" <"$T/said"
}
failed_with() {
    [ "$EXIT" -ne 0 ] && [ ! -s "$T/said" ] && grep -q -- "$1" "$T/err"
}

daemon_start "$T/data" --workers 1 # which the second job has for itself: the third waits
post_text "$(job 1 2)"
done=$ID
until_state "$done" done
results "$done" "$T/done.json"
post_text "$(job 2 800)"
running=$ID
until_state "$running" running
post_text "$(job 3 2)"
queued=$ID

# ---- made while it runs
backup "$T/copy.sqlite"
check "a backup from the directory" test "$EXIT" = 0
check "says what is in it" said --arg f "$T/copy.sqlite" '.file == $f and .jobs == 3 and .results == 3
    and .schema >= 5 and .bytes > 10000 and .taken_ms > 1.7e12'
check "and its checksum" test "$(jq -r .sha256 "$T/said")" = "$(sha256sum <"$T/copy.sqlite" | cut -d ' ' -f 1)"
check "is one whole database" test "$(sqlite3 "$T/copy.sqlite" 'pragma integrity_check')" = ok
check "and one file, the owner's" test "$(stat -c %a "$T/copy.sqlite") $(cd "$T" && echo copy.*)" = \
    "600 copy.sqlite"
"$B/bcd" sql --csv --file "$T/copy.sqlite" "select count(*), sum(state = 'running') from jobs" >"$T/out"
check "it can be asked in SQL" test "$(tail -n 1 "$T/out")" = 3,1
STATUS=$(curl -sS -m 60 -o "$T/sent.sqlite" -D "$T/head" -w '%{http_code}' "$URL/v1/backup")
check "a backup from the server" test "$STATUS" = 200
check "is one whole database too" test "$(sqlite3 "$T/sent.sqlite" 'pragma integrity_check')" = ok
check "with all jobs" test "$(sqlite3 "$T/sent.sqlite" 'select count(*) from jobs')" = 3
check "the server keeps none of it" test "$(cd "$T/data" && echo *backup*)" = '*backup*'
"$B/bcd" backup --url "$URL" "$T/fetched.sqlite" 2>"$T/err"
check "the command line fetches it" test "$(sqlite3 "$T/fetched.sqlite" 'select count(*) from jobs')" = 3
check "for nobody else to read" test "$(stat -c %a "$T/fetched.sqlite")" = 600
fetched=$(sha256sum <"$T/fetched.sqlite")
"$B/bcd" backup --url "$URL" "$T/fetched.sqlite" 2>"$T/err"
check "and does not overwrite it" \
    test "$? $(grep -c 'there already' "$T/err") $(sha256sum <"$T/fetched.sqlite")" = "1 1 $fetched"

# ---- what is refused, or fails, leaves nothing
before=$(sha256sum <"$T/copy.sqlite")
backup "$T/copy.sqlite"
check "an existing file is not overwritten" failed_with 'there already'
check "nor touched" test "$(sha256sum <"$T/copy.sqlite")" = "$before"
backup "$T/no/such/place"
check "no such directory" failed_with 'No such file'
"$B/bcd" backup --data "$T/nothing" "$T/x" >"$T/said" 2>"$T/err"
EXIT=$?
check "no such database" failed_with 'No such file'
mkdir "$T/text"
echo 'no database at all, and not one of ours' >"$T/text/bcd.sqlite"
"$B/bcd" backup --data "$T/text" "$T/x" >"$T/said" 2>"$T/err"
EXIT=$?
check "no database" failed_with 'not a database'
(
    ulimit -f 40
    "$B/bcd" backup --data "$T/data" "$T/x" >"$T/said" 2>"$T/err"
)
EXIT=$?
check "a disk that is full in between" failed_with .
check "nothing is left behind" test "$(cd "$T" && echo x* no*)" = 'x* no*'
echo left >"$T/x.partial"
backup "$T/x"
check "what a killed one left is replaced" test "$EXIT" = 0 -a ! -e "$T/x.partial"

# ---- what the original makes of the unfinished jobs
check "the original finishes" until_state "$running" done 240
check "all of them" until_state "$queued" done 240
results "$running" "$T/running.json"
results "$queued" "$T/queued.json"
daemon_end TERM

# ---- restored
for copy in copy sent; do
    mkdir "$T/$copy"
    cp "$T/$copy.sqlite" "$T/$copy/bcd.sqlite"
    daemon_start "$T/$copy" --workers 1
    check "$copy: finished results are equal byte for byte" results "$done" "$T/out"
    check "$copy: these" cmp "$T/out" "$T/done.json"
    check "$copy: unfinished jobs go on" until_state "$running" done 240
    check "$copy: all of them" until_state "$queued" done 240
    results "$running" "$T/out"
    check "$copy: to the same bits" cmp "$T/out" "$T/running.json"
    results "$queued" "$T/out"
    check "$copy: those that had not begun, too" cmp "$T/out" "$T/queued.json"
    daemon_end TERM
done
finish
