#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# accounting_long.sh - a Slurm with slurmdbd, which forgets jobs between two looks of the daemon:
# that workers failed is told by sacct alone.
. tests/api/_lib.sh
. tests/slurm/_cluster.sh
ACCOUNTING=yes NODES=1 MIN_JOB_AGE=2
skip() {
    echo "1..1"
    echo "ok 1 - # SKIP Slurm: $CLUSTER_REASON"
    exit 0
}
cleanup() {
    [ -z "$PID" ] || kill -9 "$PID" 2>/dev/null
    [ -z "${CLUSTER:-}" ] || cluster_stop
    rm -rf "$T"
}
soon() { # SECONDS COMMAND ...: until it succeeds
    end=$(($(date +%s) + $1))
    shift
    until "$@" >"$T/soon" 2>&1; do
        [ "$(date +%s)" -lt "$end" ] || return 1
        sleep 0.5
    done
}
gone() { # from squeue, whatever their state
    timeout 20 squeue -h -r --states=all --name=bcdd-test -o %i >"$T/queue" 2>"$T/said" && [ ! -s "$T/queue" ]
}
cluster_possible || {
    sh deploy/install-packages.sh long >"$T/said" 2>&1
    cluster_possible || skip
}
cluster_start "$T/cluster" 1 || skip
# Two looks: the second comes long after Slurm has forgotten what it was asked at the first.
cat >"$T/slurm.conf" <<CONF
pilots = 2
poll = ${POLL:-150}
name = bcdd-test
time = 10
memory = 100M
command = /bin/false
CONF
check "Slurm has accounting" sh -c "timeout 20 scontrol show config | grep -q 'AccountingStorageType *= accounting_storage/slurmdbd'"
daemon_start "$T/data" --backend slurm --slurm "$T/slurm.conf" --log changes
post_text '{"particles":10,"length":20,"diameter":0.5,"time":1000,"time_step":0.001,"realizations":2,
    "observables":{"energy":{}},"potential":{"type":"cosine","amplitude":6}}'
check "a job" status_is 202
daemon_end TERM
# It looks as it starts, and then sees the job.
daemon_start "$T/data" --backend slurm --slurm "$T/slurm.conf" --log changes
check "workers are asked for" soon 200 grep -q 'event=slurm_pilots ' "$T/stderr"
JOB=$(sed -n 's/.*event=slurm_pilots job=\([0-9]*\).*/\1/p' "$T/stderr" | head -n 1)
check "they fail, which accounting knows" soon 60 sh -c "
    timeout 20 sacct --noheader --parsable2 --allocations --jobs $JOB --format=JobID,State | grep -q '|FAILED'"
check "and squeue forgets" soon 140 gone
check "the daemon has not seen it" sh -c "! grep -q event=slurm_pilots_failed '$T/stderr'"
check "it is told by sacct" soon 200 grep -q "event=slurm_pilots_failed job=${JOB}_[01] state=FAILED" "$T/stderr"
check "and the job waits" until_state "$ID" running 5
if [ "$FAILED" -gt 0 ]; then
    grep -h event=slurm "$T/stderr" | tail -n 20
    tail -n 20 "$CLUSTER/slurmdbd.log" "$CLUSTER/slurmctld.log" "$CLUSTER"/*.err
fi 2>&1 | sed 's/^/# /'
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
finish
