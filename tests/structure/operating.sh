#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# deploy/OPERATING.md tells of every line in the log and every metric there is, and of no other; its
# commands and paths are real. README's promises name tests that exist.
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
page=deploy/OPERATING.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

. tests/structure/_report.sh
# Rows of the table below a heading of the page, without its head.
rows() {
    sed -n "/^## $1\$/,/^## /p" "$page" | grep '^|' | tail -n +3
}
# "name" of each `name` in the first column.
names() {
    rows "$1" | cut -d '|' -f 2 | grep -oE '`[^`]+`' | tr -d '`'
}
# What is in one list alone.
compare() {
    diff "$1" "$2" | sed -n "s|^<|only $3:|p; s|^>|only in $page:|p"
}

# Calls may go over several lines, and choose between two names. http_reap.c has a function for its own.
find server -name '*.c' ! -path server/base/log.c -exec cat {} + | tr '\n' ' ' |
    grep -oE 'log_write\([^;]*;|[^a-z_]tell\("[a-z_]+"' | sed 's/LOG_FIELDS.*//' |
    grep -v '^log_write(LOG_LEVEL_WARNING, event, ' >"$work/calls"
report "calls of log_write are found" "$([ "$(wc -l <"$work/calls")" -gt 20 ] || echo "too few")"
report "each has the name of its event in it" "$(grep -vE '"[a-z_]+"' "$work/calls")"
grep -oE '"[a-z_]+"' "$work/calls" | tr -d '"' | sort -u >"$work/events"
names "The log" | sort >"$work/told"
report "every event of the log is told, no other, none twice" "$(compare "$work/events" "$work/told" "in the code")"

# The levels of a call are told, too: "event level" of those with one name and one level.
rows "The log" | awk -F '|' '{ n = split($2, name, "`"); for (i = 2; i <= n; i += 2) print name[i] "|" $3 }' >"$work/levels"
report "with its level" "$(
    sed -nE 's/^log_write\(LOG_LEVEL_([A-Z]+), *"([a-z_]+)".*/\1 \2/p' "$work/calls" | tr A-Z a-z |
        while read -r level event; do
            grep -q "^$event|.*\b$level\b" "$work/levels" || echo "$event is $level"
        done
)"

grep -ohE '"(bcd|process)_[a-z_]+' server/api/metrics*.c | tr -d '"' | sort -u >"$work/metrics"
report "metrics are found" "$([ "$(wc -l <"$work/metrics")" -gt 20 ] || echo "too few")"
names "Metrics" | sort >"$work/told"
report "every metric is told, no other, none twice" "$(compare "$work/metrics" "$work/told" "in the code")"

make --no-print-directory -s install B="$B" DESTDIR="$work/root" PREFIX=/usr >"$work/make" 2>&1
report "files it names are installed" "$(
    grep -oE '/(usr|etc)/[a-zA-Z0-9/._-]+[a-zA-Z0-9]' "$page" | sort -u | grep -v /usr/local |
        while read -r path; do [ -e "$work/root$path" ] || echo "$path"; done
)"
report "commands of bcd that it names are there, with their options" "$(
    grep -oE '^    bcd [a-z][^#]*' "$page" | while read -r _ command rest; do
        sub=$(echo "$rest" | grep -oE '^[a-z]+' || true)
        "$B/bcd" help "$command" "$sub" >"$work/help" 2>/dev/null || "$B/bcd" help "$command" >"$work/help" || echo "$command"
        echo "$rest" | grep -oE -- '--[a-z-]+' | while read -r option; do
            grep -q -- "$option" "$work/help" || echo "$command $sub $option"
        done
    done
)"

version=$(sed -n 's/^#define BCD_VERSION "\(.*\)"$/\1/p' engine/bcd.h)
result=$(sed -n 's/^#define BCD_RESULT_VERSION \([0-9]*\)$/\1/p' engine/bcd.h)
report "changelog.md begins with this version" \
    "$(grep -m 1 '^## ' deploy/changelog.md | grep -qE "^## $version \(20[0-9]{2}-[0-9]{2}-[0-9]{2}\)\$" || echo "$version")"
report "and has this result version" "$(grep -q "^- Result version $result:" deploy/changelog.md || echo "$result")"

# README: a table | promise | test |.
sed -n '/^## What is promised/,/^## [^W]/p' README.md | grep '^|' | tail -n +3 >"$work/promises"
report "README promises something" "$([ "$(wc -l <"$work/promises")" -ge 10 ] || echo "too little")"
report "every promise names a test" "$(grep -v '`tests/[a-z]*/[a-z_.]*`' "$work/promises")"
report "tests that README names are there" "$(
    grep -oE 'tests/[a-z]+/[a-z_]+\.(sh|c|mjs)' README.md | sort -u | while read -r test; do
        [ -e "$test" ] || echo "$test"
    done
)"
echo "1..$count"
