#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What every source file keeps to: licence, length of files, functions and lines.
set -u

code=$(find engine server tests -name '*.[ch]' | sort)
all=$(find engine server tests deploy schema .ci Makefile -type f \
    \( -name '*.[ch]' -o -name '*.sh' -o -name '*.sql' -o -name '*.mjs' \
    -o -name '*.js' -o -name '*.css' -o -name '*.html' -o -name Makefile -o -path '.ci/run' \) | sort)

. tests/structure/_report.sh

echo 1..6
# A search that finds no files finds no faults either.
report "sources are found" "$([ "$(echo "$all" | wc -l)" -gt 50 ] || echo "only: $all")"

report "every file names its licence in its first lines" "$(
    for file in $all; do
        head -n 3 "$file" | grep -q 'SPDX-License-Identifier: GPL-3.0-or-later' || echo "$file"
    done
)"

report "no file is longer than 600 lines" "$(
    for file in $all; do
        lines=$(wc -l <"$file")
        [ "$lines" -le 600 ] || echo "$file: $lines"
    done
)"

# shellcheck disable=SC2086
report "no line of C is longer than 100 columns" "$(
    awk 'length > 100 { print FILENAME ":" FNR ": " length }' $code
)"

# Functions begin and end with a brace in the first column; so do no other blocks.
# shellcheck disable=SC2086
report "no function is longer than 70 lines" "$(
    awk '/^{/ { begin = FNR }
         /^}/ && begin { if (FNR - begin - 1 > 70) print FILENAME ":" begin ": " FNR - begin - 1
                         begin = 0 }' $code
)"

# shellcheck disable=SC2086
report "no tabs and no blanks at the end of a line" "$(
    grep -nE '	|[ 	]+$' $code | cut -d : -f 1-2
)"
