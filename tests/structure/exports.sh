#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The library's exports are exactly what its one public header declares.
set -u
B=${B:-build}
library=$B/libbcd.so
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Dynamic symbols that are defined here; declarations after the preprocessor, comments gone. gcc
# leaves the resolvers of its function clones visible; no C program can spell their dotted names.
nm -D --defined-only "$library" | awk '$2 ~ /^[TDBRVW]$/ { print $3 }' |
    grep -vE '^(_init|_fini)$|[.]resolver$' | sort >"$work/exported"
${CC:-cc} -std=c17 -E -P -Iengine engine/bcd.h |
    tr '\n' ' ' | grep -oE '\bbcd_[a-z0-9_]+ *\(' | tr -d ' (' | sort -u >"$work/declared"

echo 1..4
if [ "$(wc -l <"$work/declared")" -gt 20 ]; then
    echo "ok 1 - declarations are found"
else
    echo "not ok 1 - declarations are found"
fi
missing=$(comm -13 "$work/exported" "$work/declared")
if [ -z "$missing" ]; then
    echo "ok 2 - everything declared is exported"
else
    echo "not ok 2 - everything declared is exported"
    printf '%s\n' "$missing" | sed 's/^/# /'
fi
extra=$(comm -23 "$work/exported" "$work/declared")
if [ -z "$extra" ]; then
    echo "ok 3 - nothing else is exported"
else
    echo "not ok 3 - nothing else is exported"
    printf '%s\n' "$extra" | sed 's/^/# /'
fi
# GSL, libm and the C library alone.
needs=$(readelf -d "$library" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' |
    grep -vE '^(libgsl|libgslcblas|libm|libc|ld-linux-x86-64)\.so')
if [ -z "$needs" ] && [ -e "$library" ]; then
    echo "ok 4 - the library stands on GSL and libm alone"
else
    echo "not ok 4 - the library stands on GSL and libm alone"
    printf '%s\n' "$needs" | sed 's/^/# /'
fi
