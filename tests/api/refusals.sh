#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What the daemon will not open: it says why, ends with status 1, and not a byte of it is changed.
. "$(dirname "$0")/_lib.sh"

daemon_start "$T/good" --workers 1
post_text '{"particles":5,"length":9,"diameter":0.5,"time":1,"observables":{"energy":{}}}'
until_state "$ID" done
daemon_end TERM

sums() {
    (cd "$1" && for file in *; do [ "$file" = bcd.lock ] || sha256sum "$file"; done)
}
refused() { # TEXT WORDS DIR [command before bcdd]
    what=$1 words=$2 dir=$3
    shift 3
    sums "$dir" >"$T/before"
    timeout 60 "$@" "$B/bcdd" --listen 127.0.0.1:0 --data "$dir" >"$T/out" 2>"$T/err"
    EXIT=$?
    check "$what: exit 1" test "$EXIT" = 1
    check "$what: in words" grep -Eq "^bcdd: $dir.*$words" "$T/err"
    check "$what: it never says that it listens" test ! -s "$T/out"
    sums "$dir" >"$T/after"
    check "$what: nothing is changed, nothing new" cmp "$T/before" "$T/after"
}
copy() { # NAME: a copy of the good one
    mkdir "$T/$1"
    cp "$T/good/bcd.sqlite" "$T/$1/"
}
scribble() { # FILE OFFSET BYTES
    head -c "$3" /dev/zero | tr '\0' 'x' | dd of="$1" bs=1 seek="$2" conv=notrunc 2>/dev/null
}

copy newer
sqlite3 "$T/newer/bcd.sqlite" 'PRAGMA user_version = 999'
refused "a newer schema" "newer" "$T/newer"
mkdir "$T/text"
echo 'this is a shopping list: eggs, flour, milk' >"$T/text/bcd.sqlite"
refused "no database" "not a database" "$T/text"
copy other
sqlite3 "$T/other/bcd.sqlite" 'PRAGMA application_id = 7'
refused "another program's" "another program" "$T/other"
copy header
scribble "$T/header/bcd.sqlite" 0 60
refused "a header that is gone" "not a database" "$T/header"
copy schema
scribble "$T/schema/bcd.sqlite" 100 3000
refused "a first page that is gone" "malformed" "$T/schema"
copy short
truncate -s 5000 "$T/short/bcd.sqlite"
refused "a file that was cut off" "malformed" "$T/short"
mkdir "$T/folder" "$T/folder/bcd.sqlite"
timeout 60 "$B/bcdd" --listen 127.0.0.1:0 --data "$T/folder" >"$T/out" 2>"$T/err"
EXIT=$?
check "a directory in its place: exit 1" test "$EXIT" = 1
check "a directory in its place: in words" grep -q "^bcdd: $T/folder" "$T/err"

# ---- a directory that nobody may write to
copy locked
chmod 755 "$T" "$T/locked"
chmod 644 "$T/locked/bcd.sqlite"
if [ "$(id -u)" != 0 ]; then
    chmod 555 "$T/locked"
    refused "a read-only directory" "denied" "$T/locked"
    chmod 755 "$T/locked"
elif setpriv --reuid=65534 --regid=65534 --clear-groups test -x "$B/bcdd"; then
    refused "a read-only directory" "denied" "$T/locked" \
        setpriv --reuid=65534 --regid=65534 --clear-groups
fi

# ---- a second daemon
daemon_start "$T/good" --workers 1
timeout 60 "$B/bcdd" --listen 127.0.0.1:0 --data "$T/good" >"$T/out" 2>"$T/err"
EXIT=$?
check "a second daemon: exit 1" test "$EXIT" = 1
check "a second daemon: in words" grep -q "^bcdd: $T/good.*another bcdd is using this directory" "$T/err"
ask GET "/v1/jobs/$ID/results"
check "the first goes on" status_is 200
daemon_end TERM
check "and ends well" test "$EXIT" = 0
check "its database is whole" test "$(sqlite3 "$T/good/bcd.sqlite" 'PRAGMA integrity_check')" = ok

# ---- damage further behind
copy deep
pages=$(sqlite3 "$T/deep/bcd.sqlite" "SELECT pageno FROM dbstat WHERE name = 'results'")
for page in $pages; do
    scribble "$T/deep/bcd.sqlite" $(((page - 1) * 4096)) 200
done
refused "results that are gone" "damaged" "$T/deep"
finish
