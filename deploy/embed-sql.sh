#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# embed-sql.sh schema/001_x.sql schema/002_y.sql ... > migrations.inc
#
# Prints the files as C: one array of bytes each, and a table of them in order. Bytes, because C17
# promises string literals of 4095 characters only. Numbers must run 001, 002, ... without gaps.
set -eu

want=0
table=
for file in "$@"; do
    want=$((want + 1))
    base=${file##*/}
    if [ "${base%%_*}" != "$(printf '%03d' "$want")" ]; then
        echo "embed-sql.sh: $file: expected number $(printf '%03d' "$want")" >&2
        exit 1
    fi
    echo "static const unsigned char migration_$want[] = {"
    od -An -v -tu1 "$file" | sed 's/[0-9][0-9]*/&,/g'
    echo "0};"
    table="$table    {\"$base\", (const char *)migration_$want},
"
done
if [ "$want" -eq 0 ]; then
    echo "embed-sql.sh: no files" >&2
    exit 1
fi
printf 'static const struct migration migrations[] = {\n%s};\n' "$table"
