#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The descriptions in schema/ are what the program prints; `make schema` writes them anew.
set -u
B=${B:-build}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

count=0
# same NAME FILE
same() {
    count=$((count + 1))
    if "$B/bcd" schema "$1" >"$work/out" 2>&1 && diff -u "$2" "$work/out" >"$work/diff"; then
        echo "ok $count - $2"
    else
        echo "not ok $count - $2 differs: make schema"
        head -n 40 "$work/out" "$work/diff" | sed 's/^/# /'
    fi
}

echo 1..4
same job schema/job.schema.json
same openapi schema/openapi.json
count=$((count + 1))
if "$B/bcd" schema nothing >"$work/out" 2>&1 || [ $? -ne 2 ]; then
    echo "not ok $count - there is no other"
else
    echo "ok $count - there is no other"
fi

# A parameter that nobody reads would be accepted and ignored. Moments are read by what they are of.
unread=$(jq -r '[.paths[][].parameters[]? | select(.in == "query").name] | unique[]' \
    schema/openapi.json | while read -r name; do
    of=${name%_after}
    grep -q "\"${of%_before}[\"_]" server/api/handle*.c server/store/store*.c || echo "$name"
done)
count=$((count + 1))
if [ -z "$unread" ]; then
    echo "ok $count - handlers read the query parameters that the rows tell of"
else
    echo "not ok $count - no handler reads: $unread"
fi
