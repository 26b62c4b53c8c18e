#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The test runner must not call green what is not: every way to fail is counted as a failure.
set -u
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/tests/fake"
cp tests/run.sh "$work/tests/run.sh"

count=0
# expect "text" "last line" status: the fake test's script is on stdin.
expect() {
    count=$((count + 1))
    cat >"$work/tests/fake/t.sh"
    TEST_LIMIT=${5:-60} B=build sh "$work/tests/run.sh" "${4:-check}" >"$work/out" 2>&1
    status=$?
    last=$(tail -n 1 "$work/out")
    if [ "$last" = "$2" ] && [ "$status" -eq "$3" ]; then
        echo "ok $count - $1"
    else
        echo "not ok $count - $1"
        sed 's/^/# /' "$work/out"
    fi
}

echo 1..15
expect "all passed" "2 passed, 0 failed" 0 <<'T'
echo 1..2; echo "ok 1 - a"; echo "ok 2 - b"
T
expect "one failed" "1 passed, 1 failed" 1 <<'T'
echo 1..2; echo "ok 1 - a"; echo "not ok 2 - b"
T
expect "what cmocka says of one skipped" "1 passed, 0 failed" 0 <<'T'
echo 1..2; echo "ok 1 - a"; echo "not ok 2 # SKIP test_b"
T
expect "fewer than planned" "1 passed, 1 failed" 1 <<'T'
echo 1..2; echo "ok 1 - a"
T
expect "more than planned" "2 passed, 1 failed" 1 <<'T'
echo 1..1; echo "ok 1 - a"; echo "ok 2 - b"
T
expect "no plan" "1 passed, 1 failed" 1 <<'T'
echo "ok 1 - a"
T
expect "no output" "0 passed, 1 failed" 1 <<'T'
T
expect "planned nothing" "0 passed, 1 failed" 1 <<'T'
echo 1..0
T
expect "a signal" "1 passed, 1 failed" 1 <<'T'
echo 1..1; echo "ok 1 - a"; kill -SEGV $$
T
expect "an exit status of its own" "1 passed, 1 failed" 1 <<'T'
echo 1..1; echo "ok 1 - a"; exit 3
T
expect "the time limit" "1 passed, 1 failed" 1 check 2 <<'T'
echo 1..1; echo "ok 1 - a"; sleep 30
T
touch "$work/tests/fake/test_absent.c"
expect "a C test that was not built" "1 passed, 1 failed" 1 <<'T'
echo 1..1; echo "ok 1 - a"
T
rm "$work/tests/fake/test_absent.c"
# Long tests and scripts for other scripts stay out; a skipped test is neither passed nor failed.
echo 'echo 1..1; echo "ok 1 - a"' >"$work/tests/fake/soak_long.sh"
echo 'echo 1..1; echo "ok 1 - a"' >"$work/tests/fake/_shared.sh"
expect "nothing passed is no success" "0 passed, 0 failed" 1 <<'T'
echo 1..1; echo "ok 1 - not here # SKIP no such thing"
T
rm "$work"/tests/fake/*
printf '%s\n' '# Waits: for the other.' 'echo 1..1' \
    "i=0; until [ -e $work/beside ] || [ \$i -gt 300 ]; do sleep 0.1; i=\$((i + 1)); done" \
    "[ -e $work/beside ] && echo 'ok 1' || echo 'not ok 1'" >"$work/tests/fake/first_by_name.sh"
TEST_JOBS=1
export TEST_JOBS
expect "what waits does so beside the others" "2 passed, 0 failed" 0 <<T
touch $work/beside; echo 1..1; echo "ok 1 - a"
T
unset TEST_JOBS
rm "$work"/tests/fake/*
printf '%s\n' '# Alone: it sees whether the others have ended.' 'echo 1..1' \
    "[ -e $work/ended ] && echo 'ok 1' || echo 'not ok 1'" >"$work/tests/fake/first_by_name.sh"
expect "what runs alone runs after the others" "2 passed, 0 failed" 0 <<T
sleep 0.3; touch $work/ended; echo 1..1; echo "ok 1 - a"
T
