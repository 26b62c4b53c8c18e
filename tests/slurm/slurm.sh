#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A daemon whose jobs run on a real Slurm, started here: a sweep of 200 points with a node killed in
# the middle, the controller restarted, a worker requeued, the daemon killed while workers run; a
# cancelled job, the end of a worker's time, a Slurm that is away. All results are those of a daemon
# that runs everything itself, bit for bit. make check-slurm.
#
# NODES (3), POINTS (200) and LONG (empty) make more of it: see slurm_long.sh.
# Waits: for Slurm.
. tests/api/_lib.sh
. tests/slurm/_cluster.sh
NODES=${NODES:-3} POINTS=${POINTS:-200}
MAX_ARRAY_SIZE=4
skip() {
    echo "1..1"
    echo "ok 1 - # SKIP Slurm: $CLUSTER_REASON"
    exit 0
}
cluster_possible || skip
LOCAL=
cleanup() {
    for pid in $PID $LOCAL; do
        kill -9 "$pid" 2>/dev/null
    done
    [ -z "${CLUSTER_UP:-}" ] || {
        timeout 20 scancel --signal=KILL --full --name=bcdd-test
        timeout 20 scancel --name=bcdd-test
        sleep 0.5
    } 2>"$T/said"
    [ -z "${CLUSTER:-}" ] || {
        for i in $(seq "$NODES"); do
            cluster_dies "n$i"
        done
        cluster_stop
    }
    rm -rf "$T"
}

job() { # SEED TIME
    printf '{"particles":30,"length":60,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"time_step_error":"skipped","observables":{"energy":{}},"potential":{"type":"cosine","amplitude":6}}'
}
as_admin() { # METHOD PATH [curl ...]
    ask "$@" -H "Authorization: Bearer $ADMIN"
}
start() {
    daemon_start "$T/data" --backend slurm --slurm "$T/slurm.conf" --workers 12 --lease 6 --log changes
}
soon() { # SECONDS COMMAND ...: until it succeeds
    end=$(($(date +%s) + $1))
    shift
    until "$@"; do
        [ "$(date +%s)" -lt "$end" ] || return 1
        sleep 0.2
    done
}
pilots() { # PATTERN LEAST
    timeout 20 squeue -h -r --name=bcdd-test -o '%T %N' >"$T/pilots" 2>"$T/said"
    [ "$(grep -c "$1" "$T/pilots")" -ge "$2" ]
}
no_pilots() { # on the first node: of a dead one Slurm believes for a minute that they run
    timeout 20 squeue -h -r -t R,CG -w n1 --name=bcdd-test >"$T/pilots" 2>"$T/said" && [ ! -s "$T/pilots" ]
}
sweep_has() { # jq condition
    as_admin GET "/v1/sweeps/$SWEEP"
    jq -e "$1" "$T/body" >"$T/said"
}
job_is() { # STATE
    as_admin GET "/v1/jobs/$ID"
    [ "$(jq -r .state "$T/body")" = "$1" ]
}
moves() {
    as_admin GET "/v1/jobs/$ID"
    jq -e '.progress > 0' "$T/body" >"$T/said"
}
holds_leases() { # HOW_MANY
    [ "$(metric bcd_leases_held)" = "$1" ]
}
granted_more_than() {
    [ "$(metric bcd_leases_granted_total)" -gt "$1" ]
}
submit() { # SEED TIME
    job "$1" "$2" >"$T/job"
    as_admin POST /v1/jobs --data-binary "@$T/job"
    ID=$(jq -r .id "$T/body")
}
metric() { # NAME
    as_admin GET /metrics
    awk -v name="$1" '$1 == name { print $2 }' "$T/body"
}
same_bits() {
    as_admin GET "/v1/jobs/$ID/results"
    jq -S . "$T/body" >"$T/theirs"
    "$B/bcd" run --quiet "$T/job" | jq -S . | cmp - "$T/theirs"
}

cluster_start "$T/cluster" "$NODES" || skip
CLUSTER_UP=yes
ADMIN=$("$B/bcdd" token create --data "$T/data" --owner root --role admin 2>"$T/said")
"$B/bcdd" token create --data "$T/data" --owner cluster --role worker >"$T/token" 2>"$T/said"
chmod 600 "$T/token"
cat >"$T/slurm.conf" <<CONF
pilots = $((2 * NODES))
idle = 2
poll = 1
timeout = 5
name = bcdd-test
time = 10
memory = 100M
partition = all
command = $(realpath "$B/bcd")
token_file = $T/token
CONF

# ---- the same sweep here and there; there a node dies in the middle
sweep="{\"base\":$(job 1 "${TIME:-60}"),\"axes\":{\"/seed\":{\"first\":1,\"count\":$POINTS}}}"
start
LISTEN=127.0.0.1:${URL##*:} # the one that workers know
# A job that has no end keeps workers until all is as it is to be.
as_admin POST /v1/jobs -d "$(job 1 1e6 | sed "s/^{/{\"realizations\":$((2 * NODES)),/")"
ID=$(jq -r .id "$T/body")
check "workers run on all nodes" soon 60 pilots "RUNNING n$NODES" 1
touch "$T/running"
check "all have a chunk" soon 60 holds_leases $((2 * NODES))
check "no more than the file says" test "$(wc -l <"$T/pilots")" -le $((2 * NODES))
check "in arrays that Slurm takes" sh -c "
    grep -o 'event=slurm_pilots .*' '$T/stderr' | sed 's/.*pilots=//' | awk '\$1 > 4 { exit 1 } { sum += \$1 } END { exit sum != 2 * $NODES }'"
# A controller that is killed before it has saved its state, some seconds late, gives numbers of jobs
# out once more, and takes the nodes out of service ("Duplicate jobid"), for an operator to look at.
soon 6 test "$CLUSTER/state/job_state" -nt "$T/running"
as_admin POST /v1/sweeps -d "$sweep"
check "a sweep" status_is 202
SWEEP=$(jq -r .id "$T/body")
as_admin DELETE "/v1/jobs/$ID"
check "some points are done" soon 60 sweep_has ".states.done >= $POINTS / 10"
cluster_kill slurmctld KILL
cluster_dies "n$NODES"
check "a node is dead, and there is more to do" sweep_has ".states.done < $POINTS"
cluster_daemon slurmctld
[ "$NODES" -gt 1 ] || cluster_daemon n1
check "half of it is done" soon 120 sweep_has ".states.done >= $POINTS / 2"
daemon_end KILL
start
timeout 20 scontrol requeue "$(timeout 20 squeue -h -r -t R --name=bcdd-test -o %A | head -n 1)" 2>"$T/said"
check "the daemon was killed and a worker requeued; all of it is done" soon 200 sweep_has ".states.done == $POINTS"
check "no point failed" sweep_has '.states.failed == 0'
check "no result came with other bits" test "$(metric bcd_leases_differed_total)" = 0
as_admin GET "/v1/sweeps/$SWEEP/results/energy.ndjson"
jq -cS 'del(.job)' "$T/body" >"$T/theirs"
kept=$PID
PID=
there=$URL
LISTEN=127.0.0.1:0
daemon_start "$T/here" --workers 2 --log changes
LOCAL=$PID
PID=$kept
ask POST /v1/sweeps -d "$sweep"
here=$(jq -r .id "$T/body")
here_is_done() {
    ask GET "/v1/sweeps/$here"
    jq -e ".states.done == $POINTS" "$T/body" >"$T/said"
}
check "the same sweep without Slurm" soon 200 here_is_done
ask GET "/v1/sweeps/$here/results/energy.ndjson"
jq -cS 'del(.job)' "$T/body" >"$T/ours"
check "every point is there" test "$(wc -l <"$T/theirs")" = "$POINTS"
check "bit for bit" cmp "$T/ours" "$T/theirs"
kill "$LOCAL"
wait "$LOCAL"
LOCAL=
URL=$there
LISTEN=127.0.0.1:${URL##*:}
[ "$NODES" -eq 1 ] || cluster_daemon "n$NODES"

# ---- cancelled
submit 1 1e6
check "a long job is under way" soon 90 pilots RUNNING 1
check "in a worker's hands" soon 60 holds_leases 1
as_admin DELETE "/v1/jobs/$ID"
check "cancelled, its worker lets go of it" soon 60 holds_leases 0
check "and ends" soon 90 no_pilots

# ---- the end of a worker's time: SIGTERM to the batch script, a minute before
submit 99 "${TERM_TIME:-10000}"
check "another is under way" soon 90 moves # its worker has it, and has said so
granted=$(metric bcd_leases_granted_total) expired=$(metric bcd_leases_expired_total)
timeout 20 squeue -h -r -t R --name=bcdd-test -o '%i %N' >"$T/pilots" # Slurm takes dead ones for running
[ "$NODES" -eq 1 ] || sed -i "/ n$NODES\$/d" "$T/pilots"
# shellcheck disable=SC2046
timeout 20 scancel --batch --signal=TERM $(cut -d ' ' -f 1 "$T/pilots")
check "told that its time ends, a worker lets go, and another goes on" soon 60 granted_more_than "$granted"
check "nobody had to wait for it" test "$(metric bcd_leases_expired_total)" = "$expired"
check "the job is done" soon 120 job_is done
check "to the same bits" same_bits

# ---- Slurm that does not answer is no failure
check "workers end when there is nothing to do" soon 60 no_pilots
cluster_kill slurmctld TERM
soon 20 test ! -e "$CLUSTER/slurmctld.pid"
submit 5 20
check "without slurmctld that is told" soon 60 grep -q 'event=slurm_silent' "$T/stderr"
as_admin GET "/v1/jobs/$ID"
check "and a job waits" holds '.state == "running" or .state == "queued"'
cluster_daemon slurmctld
check "and runs when it is back" soon 200 job_is done

# ---- a real limit of time
if [ -n "${LONG:-}" ]; then
    check "workers end" soon 60 no_pilots
    sed -i 's/^time = .*/time = 2/' "$T/slurm.conf"
    daemon_end TERM
    start
    submit 7 1e6
    check "a worker has a minute until its time ends" soon 90 holds_leases 1
    check "then another goes on" soon 150 granted_more_than 1
    check "for which no lease ran out" test "$(metric bcd_leases_expired_total)" = 0
    as_admin DELETE "/v1/jobs/$ID"
    check "until it is cancelled" soon 60 holds_leases 0
fi

if [ "$FAILED" -gt 0 ]; then
    grep -h -e event=slurm -e event=lease_expired "$T/stderr" | tail -n 30
    timeout 20 squeue -r --states=all -o '%i %T %r %S %N'
    timeout 20 sinfo -N
    tail -n 30 "$CLUSTER/slurmctld.log"
fi 2>&1 | sed 's/^/# /'
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
finish
