#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The same job gives the same bits from every compiler, level of optimisation and instruction set:
# gcc builds the kernels for AVX-512, AVX2 and SSE2 and takes the widest that the processor has;
# clang builds them for SSE2, or for what it is told.
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
. tests/api/_digest.sh
unset MAKEFLAGS MFLAGS MAKELEVEL

digest_jobs all
digest_measure "$B/bcd" "$T/measured" >"$T/faults" 2>&1
echo 1..7
measured=$(grep -Lx refused "$T"/measured/*.out | wc -l)
if [ ! -s "$T/faults" ] && [ "$measured" -ge 100 ]; then
    echo "ok 1 - $measured jobs measured, refusals are about the method alone"
else
    echo "not ok 1 - $measured jobs measured, refusals are about the method alone"
    sed 's/^/# /' "$T/faults"
fi

count=1
same() { # $1 = compiler, $2 = CFLAGS
    count=$((count + 1))
    text="$1 $2 gives the same bits as the build under test"
    if ! make -j 2 B="$T/other" CC="$1" CFLAGS="$2" "$T/other/bcd" >"$T/make" 2>&1; then
        echo "not ok $count - $text: it does not build"
        tail -n 20 "$T/make" | sed 's/^/# /'
    else
        digest_measure "$T/other/bcd" "$T/others" >"$T/faults" 2>&1
        differ=$(cat "$T/faults" && digest_same "$T/measured" "$T/others")
        if [ -z "$differ" ]; then
            echo "ok $count - $text"
        else
            echo "not ok $count - $text"
            printf '%s\n' "$differ" | sed 's/^/# /'
        fi
    fi
    rm -rf "$T/other" "$T/others"
}

# gcc warns without cause at this level.
same gcc "-O1 -Wno-error"
same gcc -O2
same gcc -O3
same clang -O2
same clang -O3
# AVX2 and FMA everywhere, on a processor that has them.
if grep -qw avx2 /proc/cpuinfo && grep -qw fma /proc/cpuinfo; then
    same clang "-O2 -march=x86-64-v3"
else
    echo "ok 7 - clang for AVX2 # SKIP this processor has none"
fi
