#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# run.sh check|check-long - runs the tests and counts them.
#
#   C tests      tests/<layer>/test_*.c, built as $B/tests/<layer>/test_* (B: build directory)
#   shell tests  tests/<layer>/*.sh, but not _*.sh, which other scripts read
#
# Every test speaks TAP and starts in the project's root with its own TMPDIR. *_long.c and *_long.sh
# run in check-long only, which then builds and runs the C tests again under the address and
# undefined behaviour sanitizers, and those of tests/server under the thread sanitizer.
#
# A test that crashes, exceeds its time limit, exits with a status of its own, prints no plan or
# another number of results than planned counts as one more failure. TEST_JOBS (2) tests run at a
# time; beside them, one by one, those with a line "Waits: why" in their comments, which need next to
# no processor; after them, one by one, shell tests with a line "Alone: why". Output is shown for failures
# only, and the slowest tests are named. The last line is "N passed, N failed"; the status is 1 unless
# N > 0 passed and none failed.
set -u
LC_ALL=C
export LC_ALL

# Prints "passed failed skipped reason" for the TAP on stdin; $1 = exit status of the test.
count_tap() {
    awk -v status="$1" '
        /^1\.\.[0-9]+/      { plan += substr($1, 4); plans++; next }
        /^not ok [0-9]+ # SKIP/ { skipped++; next } # that is how cmocka says it
        /^not ok/           { failed++; next }
        /^ok/ && /# *SKIP/  { skipped++; next }
        /^ok/               { passed++; next }
        /^Bail out!/        { bailed = 1 }
        END {
            seen = passed + failed + skipped
            if (status == 124 || status == 137) reason = "time limit or killed"
            else if (status > 128)              reason = "signal " status - 128
            else if (bailed)                    reason = "bailed out"
            else if (!plans)                    reason = "no plan"
            else if (!plan)                     reason = "no tests"
            else if (seen != plan)              reason = "planned " plan ", ran " seen
            else if (status && !failed)         reason = "exit status " status
            print passed + 0, failed + (reason != ""), skipped + 0, reason
        }'
}

# One test: $1 = its label, $2 = what to run. Leaves LABEL.out and LABEL.count in $RESULTS.
run_one() {
    name=$(printf '%s' "$1" | tr / .)
    out=$RESULTS/$name.out
    TMPDIR=$RESULTS/$name.tmp
    export TMPDIR
    mkdir -p "$TMPDIR"
    started=$(date +%s%N)
    case $2 in
    *.sh) timeout -k 10 "$LIMIT" sh "$2" >"$out" 2>&1 ;;
    *)
        if [ -x "$2" ]; then
            CMOCKA_MESSAGE_OUTPUT=TAP timeout -k 10 "$LIMIT" "$2" >"$out" 2>&1
        else
            echo "Bail out! $2 was not built" >"$out"
            false
        fi
        ;;
    esac
    status=$?
    ended=$(date +%s%N)
    rm -rf "$TMPDIR"
    count_tap "$status" <"$out" >"$RESULTS/$name.count"
    read -r passed failed skipped reason <"$RESULTS/$name.count"
    [ "$failed" -eq 0 ] || printf '%s\n' "$1" >>"$RESULTS/failing"
    echo "$(((ended - started) / 1000000)) $1" >>"$RESULTS/times"
    awk -v name="$1" -v p="$passed" -v f="$failed" -v s="$skipped" -v ns="$((ended - started))" \
        -v reason="$reason" 'BEGIN {
            printf "%-44s %5d passed %3d failed %s%8.2f s%s\n", name, p, f,
                   s ? sprintf("%d skipped ", s) : "", ns / 1e9, reason ? "  (" reason ")" : "" }'
}

# Called by xargs below: one "label|command" each.
if [ "${1:-}" = --one ]; then
    run_one "${2%%|*}" "${2#*|}"
    exit 0
fi

case ${1:-} in
check) LIMIT=${TEST_LIMIT:-600} ;;
check-long) LIMIT=${TEST_LIMIT:-3600} ;;
*)
    echo "usage: run.sh check|check-long" >&2
    exit 2
    ;;
esac
layerset=$1
cd "$(dirname "$0")/.." || exit 2
B=${B:-build}
RESULTS=$(mktemp -d)
export B LIMIT RESULTS
trap 'rm -rf "$RESULTS"' EXIT
trap 'exit 130' INT TERM

wanted() {
    case $1 in
    */_*.sh) return 1 ;;
    *_long.c | *_long.sh) [ "$layerset" = check-long ] ;;
    *) [ -e "$1" ] ;;
    esac
}

# "label|binary" of the C tests in the given source files, as built in directory $1; $2 prefixes.
list_c() {
    built=$1 prefix=$2
    shift 2
    for source; do
        wanted "$source" || continue
        test=${source#tests/}
        test=${test%.c}
        printf '%s%s|%s/tests/%s\n' "$prefix" "$test" "$built" "$test"
    done
}

# The given sources of tests that run "together", "alone", or in the lane of those that "wait".
sources_that() {
    wanted_how=$1
    shift
    for source; do
        how=together
        ! grep -sqE '^(#| \*) Alone: ' "$source" || how=alone
        ! grep -sqE '^(#| \*) Waits: ' "$source" || how=wait
        [ "$how" != "$wanted_how" ] || printf '%s\n' "$source"
    done
}

# "label|what to run" of the tests that run so.
list() {
    # shellcheck disable=SC2046
    list_c "$B" "" $(sources_that "$1" tests/*/test_*.c)
    for source in $(sources_that "$1" tests/*/*.sh); do
        ! wanted "$source" || printf '%s|%s\n' "${source#tests/}" "$source"
    done
}

run_list() { # how many at a time; the list on stdin
    xargs -r -d '\n' -n 1 -P "$1" sh tests/run.sh --one
}

# Builds everything with clang's sanitizer $2 into $B/$1 and runs the C tests of the sources given.
run_sanitized() {
    label=$1 built=$B/$1 sanitizer=$2
    shift 2
    flags="-O1 -g -fno-omit-frame-pointer -fsanitize=$sanitizer -fno-sanitize-recover=all"
    targets=$(list_c "$built" "" "$@" | cut -d '|' -f 2)
    if (
        unset MAKEFLAGS MFLAGS MAKELEVEL
        # shellcheck disable=SC2086
        make --no-print-directory -j 2 B="$built" CC=clang CFLAGS="$flags" \
            LDFLAGS="-fsanitize=$sanitizer" "$built/bcdd" "$built/bcd" $targets
    ) >"$RESULTS/make.$label" 2>&1; then
        list_c "$built" "$label:" "$@" | run_list "${TEST_JOBS:-2}"
    else
        cat "$RESULTS/make.$label"
        echo "0 1 0 does not build" >"$RESULTS/$label.count"
        echo "$label: does not build"
    fi
}

{
    list wait | run_list 1 &
    list together | run_list "${TEST_JOBS:-2}"
    wait
    list alone | run_list 1
    if [ "$layerset" = check-long ]; then
        sh deploy/install-packages.sh long
        export ASAN_OPTIONS="detect_leaks=1:strict_string_checks=1:${ASAN_OPTIONS:-}"
        export UBSAN_OPTIONS="print_stacktrace=1:${UBSAN_OPTIONS:-}"
        export TSAN_OPTIONS="second_deadlock_stack=1:${TSAN_OPTIONS:-}"
        run_sanitized asan address,undefined tests/*/test_*.c
        run_sanitized tsan thread tests/server/test_*.c
    fi
}

if [ -s "$RESULTS/failing" ]; then
    while read -r label; do
        printf '\n==== %s\n' "$label"
        cat "$RESULTS/$(printf '%s' "$label" | tr / .).out"
    done <"$RESULTS/failing"
    printf '\n==== what failed\n'
    while read -r label; do
        name=$(printf '%s' "$label" | tr / .)
        read -r passed failed skipped reason <"$RESULTS/$name.count"
        [ -z "$reason" ] || printf '%s: %s\n' "$label" "$reason"
        grep -e '^not ok' -e '^Bail out' "$RESULTS/$name.out" | grep -v '# SKIP' |
            awk -v label="$label" '{ print label ": " $0 }'
    done <"$RESULTS/failing"
    echo
fi
if [ -s "$RESULTS/times" ]; then
    sort -rn "$RESULTS/times" | head -n 10 |
        awk '{ printf "%s%s %.0f s", NR == 1 ? "slowest: " : ", ", $2, $1 / 1000 } END { print "" }'
fi
cat "$RESULTS"/*.count 2>/dev/null |
    awk '{ p += $1; f += $2 } END { printf "%d passed, %d failed\n", p, f; exit !(p > 0 && f == 0) }'
