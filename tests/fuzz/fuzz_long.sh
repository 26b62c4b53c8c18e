#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# fuzz_long.sh - libFuzzer, with the address and undefined behaviour sanitizers, on each target of
# fuzz.h for FUZZ_SECONDS (600). What it finds is kept in $B/fuzz/findings/TARGET; cut down (the fuzzer's
# -minimize_crash=1) it belongs into tests/fuzz/corpus/TARGET, which test_corpus.c replays.
#
#   FUZZ_TARGETS   which ones (all)      FUZZ_JOBS   how many at a time (2)
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
built=$B/fuzz
seconds=${FUZZ_SECONDS:-600}
targets=${FUZZ_TARGETS:-$(grep -oE '\{"[a-z]+", fuzz_' tests/fuzz/fuzz_targets.c | grep -oE '[a-z]+' | grep -v fuzz)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

# The words that parameters, query and bodies are made of.
dictionary() {
    cat schema/*.json tests/fuzz/corpus/request/* | grep -aoE '[a-z][a-z0-9_./]{2,30}' | sort -u |
        sed 's/.*/"&"/'
    grep -oE '\b(sin|cos|tan|asin|acos|atan|sinh|cosh|tanh|exp|log|sqrt|abs|min|max)\b' \
        engine/kernels/formula.c | sort -u | sed 's/.*/"&("/'
}

one() { # TARGET
    mkdir -p "$work/$1" "$built/findings/$1"
    FUZZ_TARGET=$1 TMPDIR=$work "$built/fuzzer" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=3000 \
        -max_len=8192 -print_final_stats=1 -dict="$work/words" -artifact_prefix="$built/findings/$1/" \
        "$work/$1" "tests/fuzz/corpus/$1" >"$work/$1.log" 2>&1
    echo $? >"$work/$1.rc"
}

if ! make --no-print-directory -j 2 B="$built" CC=clang LDFLAGS=-fsanitize=address,undefined \
    CFLAGS="-O1 -g -fno-omit-frame-pointer -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all" \
    "$built/fuzzer" >"$work/make" 2>&1; then
    cat "$work/make"
    echo "Bail out! the fuzzer does not build"
    exit 1
fi
dictionary >"$work/words"
running=0
for target in $targets; do
    one "$target" &
    running=$((running + 1))
    if [ "$running" -ge "${FUZZ_JOBS:-2}" ]; then
        wait
        running=0
    fi
done
wait

count=0 failed=0
for target in $targets; do
    count=$((count + 1))
    runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$target.log")
    if [ "$(cat "$work/$target.rc")" = 0 ] && [ "${runs:-0}" -gt 100 ]; then
        echo "ok $count - $target: $runs inputs in $seconds s"
    else
        failed=1
        echo "not ok $count - $target: ${runs:-0} inputs"
        tail -n 60 "$work/$target.log" | cut -c 1-300 | sed 's/^/# /'
    fi
done
echo "1..$count"
exit $failed
