#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# embed-page.sh server/page/index.html server/page/main.js ... > page.inc
#
# Prints the files as C: for each its bytes, the same compressed, and a name for them that changes
# with them; and a table of all. Bytes, because C17 promises string literals of 4095 characters only.
set -eu

bytes() { # name of the array; the file on stdin
    echo "static const unsigned char $1[] = {"
    od -An -v -tu1 | sed 's/[0-9][0-9]*/&,/g'
    echo "0};"
}

count=0
table=
for file in "$@"; do
    base=${file##*/}
    case $base in
    *.html) type='text/html; charset=utf-8' ;;
    *.css) type='text/css; charset=utf-8' ;;
    *.js) type='text/javascript; charset=utf-8' ;;
    *.svg) type='image/svg+xml' ;;
    *)
        echo "embed-page.sh: $file: of what type is that?" >&2
        exit 1
        ;;
    esac
    sum=$(sha256sum <"$file" | cut -c 1-16)
    bytes "page_$count" <"$file"
    gzip -9 -n -c "$file" | bytes "page_${count}_gzip"
    table="$table    {\"$base\", \"$type\", \"$sum\", page_$count, sizeof(page_$count) - 1,
     page_${count}_gzip, sizeof(page_${count}_gzip) - 1},
"
    count=$((count + 1))
done
if [ "$count" -eq 0 ]; then
    echo "embed-page.sh: no files" >&2
    exit 1
fi
printf 'static const struct page_file page_files[] = {\n%s};\n' "$table"
