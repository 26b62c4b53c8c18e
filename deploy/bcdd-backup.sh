#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcdd-backup.sh --data DIR --to DIR --keep N [--bcd PROGRAM]
#
# A new backup bcd-TIME.sqlite in the second directory, with what `bcd backup` says of it beside it
# (bcd-TIME.json: jobs, bytes, checksum), made while the daemon works. All that are there are read
# and compared with their checksums; then the oldest whole ones go until N are left. A backup that
# is no longer what it was is never counted, never deleted, and named: the exit status is then 1,
# though the new one is there. When the new one fails, none goes.
set -eu
LC_ALL=C
export LC_ALL
umask 077

wrong() {
    echo "bcdd-backup: $1
usage: bcdd-backup --data DIR --to DIR --keep N [--bcd PROGRAM]" >&2
    exit 2
}
data= to= keep= bcd=$(dirname "$0")/../../bin/bcd
while [ $# -gt 0 ]; do
    [ $# -gt 1 ] || wrong "\"$1\" is no option, or lacks its value"
    case $1 in
    --data) data=$2 ;;
    --to) to=$2 ;;
    --keep) keep=$2 ;;
    --bcd) bcd=$2 ;;
    *) wrong "\"$1\" is no option" ;;
    esac
    shift 2
done
[ -n "$data" ] && [ -n "$to" ] || wrong "--data and --to are needed"
case $keep in
'' | *[!0-9]* | 0* | ?????*) wrong "--keep takes a number from 1 to 9999, not \"$keep\"" ;;
esac

bcd=$(realpath -- "$bcd")
data=$(realpath -- "$data")
cd -- "$to"
to=$PWD
rm -f ./*.partial # what a killed one left

name=bcd-$(date -u +%Y%m%dT%H%M%SZ)
"$bcd" backup --data "$data" "$name.sqlite" >"$name.json.partial" || {
    status=$?
    rm -f "$name.json.partial"
    exit "$status"
}
mv "$name.json.partial" "$name.json"
sync "$name.json" .

# Whether a backup has the checksum that `bcd backup` told of it.
is_whole() {
    sum=$(sed -n 's/.*"sha256":"\([0-9a-f]\{64\}\)".*/\1/p' "$1.json" 2>/dev/null) || return 1
    [ -n "$sum" ] && [ "$sum" = "$(sha256sum <"$1.sqlite" | cut -d ' ' -f 1)" ]
}
whole=
damaged=0
count=0
for file in bcd-*.sqlite; do # in order of time
    if is_whole "${file%.sqlite}"; then
        whole="$whole ${file%.sqlite}"
        count=$((count + 1))
    else
        echo "bcdd-backup: $to/$file is damaged: not what it was when it was made" >&2
        damaged=$((damaged + 1))
    fi
done
for old in $whole; do
    [ "$count" -gt "$keep" ] || break
    rm -f "$old.sqlite" "$old.json"
    count=$((count - 1))
done
echo "bcdd-backup: $to/$name.sqlite: $(cat "$name.json")"
echo "bcdd-backup: kept $count, damaged $damaged"
[ "$damaged" -eq 0 ]
