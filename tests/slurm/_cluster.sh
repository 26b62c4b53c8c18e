#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# _cluster.sh - a Slurm of the test's own: munged with its own key, slurmctld and as many slurmd on
# loopback, without cgroups or accounting. Root only. Read with `.`:
#
#   cluster_possible           false, with the reason in CLUSTER_REASON, where it cannot be started
#   cluster_start DIR NODES    until all nodes are idle; SLURM_CONF is exported
#   cluster_daemon NAME        (re)starts munged, slurmctld or nK
#   cluster_kill NAME SIGNAL
#   cluster_dies NODE          kill -9 of a node with all that runs on it
#   cluster_stop               ends all of it
PATH=$PATH:/usr/sbin
cluster_possible() {
    CLUSTER_REASON=
    [ "$(id -u)" -eq 0 ] || CLUSTER_REASON="slurmd needs root"
    for program in munged slurmctld slurmd sbatch; do
        command -v $program >/dev/null || CLUSTER_REASON="there is no $program"
    done
    [ -z "$CLUSTER_REASON" ]
}
cluster_start() {
    CLUSTER=$1 NODES=$2
    mkdir -p "$CLUSTER/state"
    chmod 755 "$CLUSTER"
    ports=$(node -e 'const n = require("net"), s = Array.from({length: +process.argv[1] + 1}, () => n.createServer().listen(0, "127.0.0.1"));
        setTimeout(() => { console.log(s.map((x) => x.address().port).join(" ")); process.exit() }, 50)' "$NODES")
    dd if=/dev/urandom of="$CLUSTER/key" bs=128 count=1 2>"$CLUSTER/dd"
    chmod 400 "$CLUSTER/key"
    host=$(hostname -s)
    {
        cat <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports%% *}
AuthType=auth/munge
AuthInfo=socket=$CLUSTER/munge.socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$CLUSTER/state
SlurmdSpoolDir=$CLUSTER/spool.%n
SlurmctldPidFile=$CLUSTER/slurmctld.pid
SlurmdPidFile=$CLUSTER/%n.pid
SlurmctldLogFile=$CLUSTER/slurmctld.log
SlurmdLogFile=$CLUSTER/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
SlurmctldTimeout=10
KillWait=5
MinJobAge=30
InactiveLimit=0
MaxArraySize=${MAX_ARRAY_SIZE:-64}
SlurmdParameters=config_overrides
CONF
        i=1
        for port in ${ports#* }; do
            echo "NodeName=n$i NodeHostname=$host NodeAddr=127.0.0.1 Port=$port CPUs=2 RealMemory=1000 State=UNKNOWN"
            i=$((i + 1))
        done
        echo "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP"
    } >"$CLUSTER/slurm.conf"
    SLURM_CONF=$CLUSTER/slurm.conf
    export SLURM_CONF
    cluster_daemon munged
    cluster_daemon slurmctld
    for i in $(seq "$NODES"); do
        cluster_daemon "n$i"
    done
    for try in $(seq 300); do
        [ "$(timeout 20 sinfo -h -N -o %T 2>/dev/null | grep -c '^idle')" = "$NODES" ] && return
        sleep 0.2
    done
    tail -n 5 "$CLUSTER"/*.log "$CLUSTER"/*.err
    return 1
}
# One that was just killed may still have its port: it is started until it stays.
cluster_daemon() {
    case $1 in
    munged)
        munged --force --key-file="$CLUSTER/key" --socket="$CLUSTER/munge.socket" \
            --pid-file="$CLUSTER/munged.pid" --log-file="$CLUSTER/munged.log" --seed-file="$CLUSTER/seed" \
            2>>"$CLUSTER/munged.err"
        return
        ;;
    slurmctld) set -- slurmctld slurmctld ;;
    *) set -- "$1" slurmd -N "$1" ;;
    esac
    name=$1
    shift
    for try in $(seq 20); do
        "$@" 2>>"$CLUSTER/$name.err"
        sleep 0.3
        kill -0 "$(cat "$CLUSTER/$name.pid")" 2>/dev/null && return
    done
    return 1
}
cluster_kill() { # NAME SIGNAL
    kill "-$2" "$(cat "$CLUSTER/$1.pid" 2>/dev/null)" 2>/dev/null
}
# Its slurmd, and workers with their slurmstepd: those that were started with what is below DIR.
cluster_dies() {
    cluster_kill "$1" KILL
    for environment in $(grep -lz "^SLURMD_NODENAME=$1$" /proc/[0-9]*/environ 2>/dev/null); do
        process=${environment%/environ}
        grep -qz "$(dirname "$CLUSTER")" "$process/cmdline" 2>/dev/null || continue
        # shellcheck disable=SC2046
        kill -9 "${process#/proc/}" $(awk '$1 == "PPid:" { print $2 }' "$process/status") 2>/dev/null
    done
    return 0
}
cluster_stop() {
    for i in $(seq "$NODES"); do
        cluster_kill "n$i" TERM
    done
    cluster_kill slurmctld TERM
    sleep 0.5
    cluster_kill slurmctld KILL
    cluster_kill munged TERM
}
