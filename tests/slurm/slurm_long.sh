#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A daemon whose jobs run on a real Slurm of three nodes, started here: a sweep with a node killed in
# the middle, slurmctld restarted, the daemon restarted while workers run, a cancelled job, commands
# that hang. All results are those of one machine, bit for bit. make check-slurm.
. tests/api/_lib.sh
. tests/slurm/_cluster.sh
PATH=$PATH:/usr/sbin
if [ "$(id -u)" -ne 0 ]; then
    echo "1..1"
    echo "ok 1 - # SKIP slurmd needs root"
    exit 0
fi
cleanup() {
    [ -z "$PID" ] || kill -9 "$PID" 2>/dev/null
    scancel --name=bcdd-test 2>/dev/null
    sleep 1
    cluster_stop
    rm -rf "$T"
}

job() { # SEED TIME
    printf '{"particles":30,"length":60,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"realizations":4,"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},'
    printf '"density":{"bins":20}}}'
}
as_admin() { # METHOD PATH [curl ...]
    ask "$@" -H "Authorization: Bearer $ADMIN"
}
start() {
    daemon_start "$T/data" --backend slurm --slurm "$T/slurm.conf" --workers 12 --lease 3
}
pilots() {
    timeout 5 squeue -h -r --name=bcdd-test -o '%T %N' 2>/dev/null
}
until_pilots() { # PATTERN LEAST [SECONDS]
    for try in $(seq $((${3:-15} * 5))); do
        [ "$(pilots | grep -c "$1")" -ge "$2" ] && return
        sleep 0.2
    done
    pilots
    return 1
}
sweep_is() { # jq condition, seconds
    for try in $(seq $(($2 * 2))); do
        as_admin GET "/v1/sweeps/$SWEEP"
        jq -e "$1" "$T/body" >"$T/said" && return
        sleep 0.5
    done
    return 1
}
until_state_as() { # ID STATE
    for try in 1 2 3 4; do
        as_admin GET "/v1/jobs/$1?wait=15"
        [ "$(jq -r .state "$T/body")" = "$2" ] && return
    done
    return 1
}
metric() {
    as_admin GET /metrics
    awk -v name="$1" '$1 == name { print $2 }' "$T/body"
}

check "a cluster of three nodes" cluster_start "$T/cluster" 3
ADMIN=$("$B/bcdd" token create --data "$T/data" --owner root --role admin 2>"$T/said")
"$B/bcdd" token create --data "$T/data" --owner cluster --role worker >"$T/token" 2>"$T/said"
chmod 600 "$T/token"
cat >"$T/slurm.conf" <<CONF
pilots = 6
idle = 2
poll = 1
name = bcdd-test
time = 10
memory = 100M
partition = all
command = $(realpath "$B/bcd")
token_file = $T/token
CONF
for wrong in 'pilots = 0' 'pilots = many' 'partition = a;b' 'queue = all' 'pilots'; do
    echo "$wrong" >"$T/wrong.conf"
    timeout 5 "$B/bcdd" --data "$T/other" --listen 127.0.0.1:0 --backend slurm --slurm "$T/wrong.conf" \
        >"$T/out" 2>"$T/err"
    check "refused: $wrong" test "$? $(grep -c "wrong.conf, line 1" "$T/err")" = "1 1"
done

# ---- a sweep; a node dies in the middle, and the controller is restarted
start
LISTEN=127.0.0.1:${URL##*:} # the one that pilots know
as_admin POST /v1/sweeps -d "{\"base\":$(job 1 100),\"axes\":{\"/seed\":{\"first\":1,\"count\":${POINTS:-24}}}}"
check "a sweep" status_is 202
SWEEP=$(jq -r .id "$T/body")
check "pilots run on all nodes" until_pilots 'RUNNING n3' 1
check "no more than the file says" test "$(pilots | wc -l)" -le 6
victim=$(cat "$CLUSTER/n3.pid")
# The node dies: its slurmd, and whatever runs below it.
for pid in $(pgrep -f "^slurmstepd: .*" | xargs -r -n 1 sh -c 'grep -lz "SLURMD_NODENAME=n3" /proc/$0/environ /proc/$(pgrep -P $0 | head -1)/environ 2>/dev/null | head -1 >/dev/null && echo $0'); do
    kill -9 "$pid" 2>/dev/null
done
kill -9 "$victim"
cluster_kill slurmctld KILL
sleep 1
cluster_daemon slurmctld
check "half of it is done" sweep_is ".states.done >= ${POINTS:-24} / 2" 60
daemon_end KILL
start
check "the daemon was killed, and is back" test -n "$URL"
check "all of it is done" sweep_is ".states.done == ${POINTS:-24}" 90
check "no point failed" holds '.states.failed == 0'
check "nothing came twice unnoticed, nothing with other bits" test "$(metric bcd_leases_differed_total)" = 0
as_admin GET "/v1/jobs?sweep=$SWEEP&limit=1000"
jq -r '.jobs[] | "\(.id) \(.job.seed)"' "$T/body" >"$T/jobs"
check "every point has a job" test "$(wc -l <"$T/jobs")" = "${POINTS:-24}"
differing=
while read -r id seed; do
    as_admin GET "/v1/jobs/$id/results"
    jq -S . "$T/body" >"$T/theirs"
    job "$seed" 100 >"$T/job"
    "$B/bcd" run --quiet "$T/job" | jq -S . | cmp -s - "$T/theirs" || differing="$differing $id"
done <"$T/jobs"
check "with the bits of one machine:$differing" test -z "$differing"
cluster_daemon n3
check "pilots end when there is nothing to do" sh -c "
    for try in \$(seq 100); do [ -z \"\$(squeue -h --name=bcdd-test)\" ] && exit; sleep 0.2; done; squeue; exit 1"

# ---- cancelled, ended by its time limit, requeued
as_admin POST /v1/jobs -d "$(job 1 1e6)"
ID=$(jq -r .id "$T/body")
check "a long job is under way" until_pilots RUNNING 2
as_admin DELETE "/v1/jobs/$ID"
check "cancelled, pilots let go of it" sh -c "
    for try in \$(seq 100); do [ -z \"\$(squeue -h --name=bcdd-test)\" ] && exit; sleep 0.2; done; squeue; exit 1"
job 99 1500 >"$T/job"
as_admin POST /v1/jobs --data-binary "@$T/job"
ID=$(jq -r .id "$T/body")
check "another" until_pilots RUNNING 1
sleep 2
# As at the end of their time: SIGTERM to the batch script, a minute before.
scancel --batch --signal=TERM --name=bcdd-test
check "told that their time ends, others take over" until_state_as "$ID" done
finish_with_bits() {
    as_admin GET "/v1/jobs/$ID/results"
    jq -S . "$T/body" >"$T/theirs"
    "$B/bcd" run --quiet "$T/job" | jq -S . | cmp - "$T/theirs"
}
check "to the same bits" finish_with_bits

# ---- Slurm that does not answer is no failure
cluster_kill slurmctld KILL
as_admin POST /v1/jobs -d "$(job 5 20)"
ID=$(jq -r .id "$T/body")
sleep 4
as_admin GET "/v1/jobs/$ID"
check "without slurmctld a job waits" holds '.state == "running" or .state == "queued"'
cluster_daemon slurmctld
check "and runs when it is back" until_state_as "$ID" done
[ "$FAILED" -eq 0 ] || grep -h -e event=slurm -e event=lease_expired "$T/stderr" | tail -n 20 | sed 's/^/# /'
[ "$FAILED" -eq 0 ] || { timeout 5 squeue; timeout 5 sinfo -N; tail -n 15 "$CLUSTER/slurmctld.log"; } 2>&1 | sed 's/^/# /'
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
finish
