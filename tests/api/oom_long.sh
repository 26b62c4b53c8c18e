#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A daemon in a control group with little memory, killed by the kernel again and again for a job that
# needs more: that job fails with the reason, those beside it end with the bits that they have anywhere.
. "$(dirname "$0")/_lib.sh"
GROUP=
cleanup() {
    [ -z "$PID" ] || kill -9 "$PID" 2>/dev/null
    wait
    [ -z "$GROUP" ] || rmdir "$GROUP" 2>/dev/null
    rm -rf "$T"
}
skip() {
    echo "1..1"
    echo "ok 1 - # SKIP no control group with a limit of memory can be made here"
    exit 0
}
small() { # SEED
    printf '{"particles":30,"length":60,"diameter":0.5,"time":200,"time_step":0.001,"seed":%s,"realizations":4,' "$1"
    printf '"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{}}}'
}
bits() { # NAME: results of all small jobs
    for id in $ids; do
        curl -sS "$URL/v1/jobs/$id/results" | jq -c 'del(.id)'
    done >"$T/$1"
}
kills() {
    awk '$1 == "oom_kill" { print $2 }' /proc/vmstat
}

# The first version of control groups has the controller on a mount of its own.
above=$(findmnt -n -t cgroup -O memory -o TARGET | head -n 1) limit=memory.limit_in_bytes
if [ -z "$above" ]; then
    above=$(findmnt -n -t cgroup2 -o TARGET | head -n 1) limit=memory.max
    grep -qw memory "$above/cgroup.subtree_control" 2>/dev/null || skip
fi
mkdir "$above/bcdd-test-$$" 2>/dev/null || skip
GROUP=$above/bcdd-test-$$
echo 150M >"$GROUP/$limit" 2>/dev/null || skip
[ ! -e "$GROUP/memory.swap.max" ] || echo 0 >"$GROUP/memory.swap.max"

# What it starts is in the group from its first byte on.
cat >"$T/start" <<EOF
#!/bin/sh
echo \$\$ >"$GROUP/cgroup.procs" && exec "$B/bcdd" "\$@"
EOF
chmod 755 "$T/start"
mkdir "$T/bin"
ln -s "$T/start" "$T/bin/bcdd"
free_B=$B before=$(kills)

B=$T/bin
daemon_start "$T/data" --workers 2
ids=
for seed in 1 2 3 4 5 6; do
    small $seed >"$T/job"
    post "$T/job"
    ids="$ids $ID"
done
post_text '{"particles":1000000,"length":2000000,"diameter":0.5,"time":100,"time_step":0.001,
    "potential":{"type":"cosine","amplitude":6},"observables":{"msd":{}},"priority":9}'
hog=$ID
check "a job that needs more is accepted: nobody told the server of the limit" status_is 202
starts=1
state=running
while [ "$state" != failed ] && [ $starts -le 20 ]; do
    wait "$PID" # for the kernel
    daemon_start "$T/data" --workers 2
    starts=$((starts + 1))
    for try in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do
        state=$(curl -sS -m 10 "$URL/v1/jobs/$hog?wait=2" 2>/dev/null | jq -r .state)
        [ "$state" != failed ] && kill -0 "$PID" 2>/dev/null || break
    done
done
check "the kernel killed it ($((starts - 1)) times)" test "$(kills)" -ge $((before + 5))
ask GET "/v1/jobs/$hog"
check "the job has failed" holds '.state == "failed"'
check "with the reason" holds '.error | test("memory")'
check "after five attempts" holds '.attempts.lost == 5'
for id in $ids; do
    check "one beside it is done" until_state "$id" done
    check "and is not blamed" sh -c "curl -sS $URL/v1/jobs/$id | jq -e '.attempts.failed == 0'"
done
bits confined
daemon_end TERM
check "and the daemon lives to be ended" test "$EXIT" = 0

B=$free_B
daemon_start "$T/calm" --workers 2
ids=
for seed in 1 2 3 4 5 6; do
    small $seed >"$T/job"
    post "$T/job"
    until_state "$ID" done
    ids="$ids $ID"
done
bits free
check "the bits are those without a limit" cmp "$T/confined" "$T/free"
daemon_end TERM
finish
