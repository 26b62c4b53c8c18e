#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The same job gives the same bits whatever the C library makes of the processor: its own sine,
# exponential and memory functions come in variants with and without FMA and AVX.
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
. tests/api/_digest.sh

# Names up to glibc 2.32 and since; unknown ones are ignored.
without='-AVX512F,-AVX512VL,-AVX2,-AVX,-FMA,-FMA4,-ERMS,-AVX2_Usable,-AVX_Usable,-FMA_Usable'
loader=$(sed -n 's/.* \(\/[^ ]*\/ld-linux[^ ]*\)$/\1/p' /proc/self/maps | head -n 1)
restricted() {
    (
        GLIBC_TUNABLES=glibc.cpu.hwcaps=$without
        export GLIBC_TUNABLES
        "$@"
    )
}
features() { # that the C library uses, as its loader tells
    "$loader" --list-diagnostics 2>/dev/null | grep '^x86.cpu_features.features.*active'
}

digest_jobs some
digest_measure "$B/bcd" "$T/plain" >"$T/faults" 2>&1
restricted digest_measure "$B/bcd" "$T/restricted" >>"$T/faults" 2>&1
refused=$(grep -lx refused "$T"/plain/*.out | wc -l)
measured=$(grep -Lx refused "$T"/plain/*.out | wc -l)
differ=$(digest_same "$T/plain" "$T/restricted")

count=0
verdict() { # $1 = text, $2 = what is wrong, empty = passed
    count=$((count + 1))
    if [ -z "$2" ]; then
        echo "ok $count - $1"
    else
        echo "not ok $count - $1"
        printf '%s\n' "$2" | sed 's/^/# /'
    fi
}
echo 1..3
verdict "every method runs, refusals are about the method alone" "$(
    cat "$T/faults"
    [ "$measured" -ge 28 ] || echo "$measured measured, $refused refused"
    for method in engine/methods/*.c; do
        method=${method##*/}
        grep -Lx refused "$T"/plain/*."${method%.c}".out | grep -q . || echo "$method: never"
    done
)"
if [ -n "$loader" ] && features >"$T/as-is"; then
    restricted features >"$T/less"
    verdict "the C library takes the restriction" "$(
        ! cmp -s "$T/as-is" "$T/less" || echo "no feature went away"
    )"
else
    count=$((count + 1))
    echo "ok $count - the C library takes the restriction # SKIP it does not tell its features"
fi
verdict "without AVX and FMA in the C library every measured number has the same bits" "$differ"
