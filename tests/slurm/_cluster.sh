#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# _cluster.sh - a Slurm of the test's own: munged with its own key, slurmctld and as many slurmd on
# loopback, without cgroups; with ACCOUNTING=yes slurmdbd before a database of its own, too. Root only.
# Read with `.`:
#
#   cluster_possible           false, with the reason in CLUSTER_REASON, where it cannot be tried
#   cluster_start DIR NODES    until all nodes are idle; SLURM_CONF is exported. False, with the
#                              reason, where its programs do not run: no privileges, no loopback
#   cluster_daemon NAME        (re)starts munged, slurmctld or nK
#   cluster_kill NAME SIGNAL
#   cluster_dies NODE          kill -9 of a node with all that runs on it
#   cluster_stop               ends all of it
PATH=$PATH:/usr/sbin
cluster_possible() {
    CLUSTER_REASON=
    [ "$(id -u)" -eq 0 ] || CLUSTER_REASON="slurmd needs root"
    for program in munged slurmctld slurmd sbatch ${ACCOUNTING:+slurmdbd mariadbd mariadb-install-db}; do
        command -v $program >/dev/null || CLUSTER_REASON="there is no $program"
    done
    [ -z "$CLUSTER_REASON" ]
}
cluster_start() {
    CLUSTER=$1 NODES=$2
    mkdir -p "$CLUSTER/state"
    chmod 755 "$CLUSTER"
    ports=$(node -e 'const n = require("net"), s = Array.from({length: +process.argv[1] + 2}, () => n.createServer().listen(0, "127.0.0.1"));
        s.at(-1).on("listening", () => n.connect(s[0].address().port, "127.0.0.1").on("connect", () => {
            console.log(s.map((x) => x.address().port).join(" ")); process.exit() }))' "$NODES" 2>"$CLUSTER/ports")
    [ -n "$ports" ] || {
        CLUSTER_REASON="nothing can be reached on 127.0.0.1"
        return 1
    }
    dd if=/dev/urandom of="$CLUSTER/key" bs=128 count=1 2>"$CLUSTER/dd"
    chmod 400 "$CLUSTER/key"
    host=$(hostname -s) storage=none
    database=${ports%% *} ports=${ports#* }
    [ -z "${ACCOUNTING:-}" ] || storage="slurmdbd
AccountingStorageHost=127.0.0.1
AccountingStoragePort=$database
AccountingStoragePass=$CLUSTER/munge.socket"
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
AccountingStorageType=accounting_storage/$storage
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
SlurmctldTimeout=10
KillWait=5
MinJobAge=${MIN_JOB_AGE:-30}
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
    cluster_daemon munged || {
        CLUSTER_REASON="munged does not start: $(tail -n 1 "$CLUSTER/munged.err")"
        return 1
    }
    [ -z "${ACCOUNTING:-}" ] || cluster_accounting || return 1
    cluster_daemon slurmctld
    for i in $(seq "$NODES"); do
        cluster_daemon "n$i"
    done
    end=$(($(date +%s) + 120))
    while [ "$(timeout 20 sinfo -h -N -o %T 2>"$CLUSTER/sinfo" | grep -c '^idle')" != "$NODES" ]; do
        CLUSTER_REASON="nodes do not come up: $(grep -h -i -e error -e fatal "$CLUSTER"/*.err | tail -n 1)"
        [ "$(date +%s)" -lt "$end" ] && [ ! -e "$CLUSTER/gave_up" ] || return 1
        sleep 0.2
    done
}
# slurmdbd, which knows the cluster. The database is reached by its socket alone.
cluster_accounting() {
    CLUSTER_REASON="slurmdbd, or a database for it, does not start"
    mkdir "$CLUSTER/sql"
    cat >"$CLUSTER/slurmdbd.conf" <<CONF
AuthType=auth/munge
AuthInfo=socket=$CLUSTER/munge.socket
DbdHost=$host
DbdAddr=127.0.0.1
DbdPort=$database
SlurmUser=root
StorageType=accounting_storage/mysql
StorageHost=localhost
StorageUser=root
LogFile=$CLUSTER/slurmdbd.log
PidFile=$CLUSTER/slurmdbd.pid
CONF
    chmod 600 "$CLUSTER/slurmdbd.conf"
    MYSQL_UNIX_PORT=$CLUSTER/sql.socket
    export MYSQL_UNIX_PORT
    mariadb-install-db --no-defaults --user=root --datadir="$CLUSTER/sql" --skip-test-db \
        --auth-root-authentication-method=normal >"$CLUSTER/install.err" 2>&1 || return 1
    cluster_daemon mariadbd
    cluster_soon mariadb --no-defaults -u root -e 'CREATE DATABASE IF NOT EXISTS slurm_acct_db' || return 1
    cluster_daemon slurmdbd
    cluster_soon timeout 20 sacctmgr -i add cluster test
}
cluster_soon() { # COMMAND ...: until it succeeds
    for try in $(seq 200); do
        "$@" >>"$CLUSTER/soon.err" 2>&1 && return
        sleep 0.2
    done
    return 1
}
# One that was just killed may still have its port: what ends by a fault of its own is started again.
cluster_daemon() {
    case $1 in
    munged)
        munged --force --key-file="$CLUSTER/key" --socket="$CLUSTER/munge.socket" \
            --pid-file="$CLUSTER/munged.process" --log-file="$CLUSTER/munged.log" --seed-file="$CLUSTER/seed" \
            >"$CLUSTER/munged.err" 2>&1
        return
        ;;
    slurmctld | slurmdbd) set -- "$1" "$1" -D ;;
    mariadbd)
        set -- mariadbd mariadbd --no-defaults --user=root --datadir="$CLUSTER/sql" \
            --socket="$CLUSTER/sql.socket" --skip-networking --pid-file="$CLUSTER/sql.pid"
        ;;
    *) set -- "$1" slurmd -D -N "$1" ;;
    esac
    name=$1
    shift
    (
        trap - EXIT INT TERM
        for try in $(seq 12); do
            [ ! -e "$CLUSTER/stops" ] || exit 0
            "$@" &
            echo $! >"$CLUSTER/$name.process"
            wait $!
            code=$?
            [ $code -ne 0 ] && [ $code -lt 128 ] || exit 0
            sleep 0.3
        done
        touch "$CLUSTER/gave_up"
    ) >>"$CLUSTER/$name.err" 2>&1 &
}
cluster_kill() { # NAME SIGNAL
    kill "-$2" "$(cat "$CLUSTER/$1.process" 2>/dev/null)" 2>/dev/null
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
    touch "$CLUSTER/stops"
    for signal in TERM KILL; do
        for daemon in $(seq -f n%g "$NODES") slurmctld slurmdbd mariadbd munged; do
            cluster_kill "$daemon" $signal
        done
        sleep 0.5
    done
    # Those that slurmd began.
    for environment in $(grep -lz "^SLURM_CONF=$SLURM_CONF$" /proc/[0-9]*/environ 2>/dev/null); do
        process=${environment%/environ}
        kill -9 "${process#/proc/}" 2>/dev/null
    done
    return 0
}
