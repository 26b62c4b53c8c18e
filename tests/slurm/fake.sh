#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The daemon before a Slurm that does all that a real one does too seldom for a test: commands that
# hang or fail, arrays that are limited, workers that fail as they start, accounting that is asked for
# those that vanished. Programs of our own stand for Slurm's.
# Waits: for polls.
. tests/api/_lib.sh
cleanup() {
    [ -z "$PID" ] || kill -9 "$PID" 2>/dev/null
    rm -rf "$T"
}

mkdir "$T/bin"
: >"$T/queue"
: >"$T/sacct.says"
: >"$T/calls"
echo 'accounting_storage/slurmdbd' >"$T/storage"
echo 4 >"$T/array"
fake() { # NAME: its body on stdin
    {
        echo '#!/bin/sh'
        echo "T=$T"
        # shellcheck disable=SC2016
        echo 'echo "${0##*/} $*" >>"$T/calls"'
        cat
    } >"$T/bin/$1"
    chmod +x "$T/bin/$1"
}
fake squeue <<'E2'
if [ -e "$T/hangs" ]; then
    sleep 4321 &
    echo $! >>"$T/sleeping"
    wait
fi
cat "$T/queue"
E2
fake scontrol <<'E2'
echo "AccountingStorageType   = $(cat "$T/storage")"
echo "MaxArraySize            = $(cat "$T/array")"
E2
fake sacct <<'E2'
cat "$T/sacct.says"
E2
fake scancel <<'E2'
E2
fake sbatch <<'E2'
[ ! -e "$T/refuses" ] || exit 1
cat >"$T/script.new"
mv "$T/script.new" "$T/script"
job=$(($(cat "$T/last" 2>/dev/null || echo 100) + 1))
echo $job >"$T/last"
tasks=$(echo "$*" | sed -n 's/.*--array=0-\([0-9]*\).*/\1/p')
if [ -n "$tasks" ]; then
    seq 0 "$tasks" | sed "s/.*/${job}_& PENDING Resources/" >>"$T/queue"
else
    echo "$job PENDING Resources" >>"$T/queue"
fi
echo "$job;cluster"
E2
start() { # [options]
    cat >"$T/slurm.conf" <<CONF
pilots = 10
poll = 1
timeout = 1
partition = all
bin = $T/bin
CONF
    daemon_start "$T/data" --backend slurm --slurm "$T/slurm.conf" --workers 16 "$@"
}
soon() { # until the command succeeds, 20 s at most
    for try in $(seq 100); do
        "$@" >"$T/soon" && return
        sleep 0.2
    done
    return 1
}
calls() { # PATTERN LEAST
    [ "$(grep -c "$1" "$T/calls")" -ge "$2" ]
}
logged() { # PATTERN
    grep -q "$1" "$T/stderr"
}
metric() { # NAME VALUE
    curl -sS -m 5 "$URL/metrics" | grep -qx "$1 $2"
}

# ---- arrays are limited
start
post_text '{"particles":10,"length":20,"diameter":0.5,"time":1000,"time_step":0.001,"realizations":16,
    "observables":{"energy":{}},"potential":{"type":"cosine","amplitude":6}}'
check "a job" status_is 202
check "ten workers are asked for, in arrays that Slurm takes" soon calls '^sbatch ' 3
check "with as many tasks as MaxArraySize says, and no more" sh -c "
    grep -o 'array=[-0-9]*' '$T/calls' | tr '\n' ' ' | grep -qx 'array=0-3 array=0-3 array=0-1 '"
check "in the partition of the file" calls '^sbatch .*--requeue .*--partition all' 3
check "which is the script of a worker" grep -qE "^exec bcd worker --idle 60 --url $URL " "$T/script"
check "and counted" soon metric bcd_slurm_pilots_waiting 10
sleep 1.5
check "while they wait no more are asked for" sh -c "[ \$(grep -c '^sbatch ' '$T/calls') = 3 ]"
check "one squeue asks for all" calls '^squeue .*--array --me --name bcdd --states=all' 3
check "sacct is not asked while squeue knows" sh -c "! grep '^sacct ' '$T/calls'"

# ---- they vanish, and accounting tells that they failed
: >"$T/queue"
: >"$T/calls"
printf '101_%d|FAILED\n' 0 1 2 3 >"$T/sacct.says"
printf '102_%d|COMPLETED\n' 0 1 2 3 >>"$T/sacct.says"
printf '103_0|OUT_OF_MEMORY\n103_1|CANCELLED by 0\n' >>"$T/sacct.says"
check "sacct is asked for all that vanished" soon calls '^sacct .*--jobs 101,102,103' 1
check "those that failed are told" soon logged 'event=slurm_pilots_failed job=103_0 state=OUT_OF_MEMORY pilots=5'
check "and counted" metric bcd_slurm_pilots_failed_total 5
echo '999_0 RUNNING None' >"$T/queue" # of another daemon
check "the next are asked for" soon grep '^106_0 ' "$T/queue"
: >"$T/calls"
sed 's/PENDING Resources/FAILED NonZeroExitCode/' "$T/queue" >"$T/next"
mv "$T/next" "$T/queue"
sleep 3
check "where they fail as they start they become fewer" sh -c "[ \$(grep -c '^sbatch ' '$T/calls') -le 3 ]"
check "by squeue's word alone, where it has one" sh -c "! grep '^sacct ' '$T/calls'"

# ---- tasks that wait for ever
echo '101_1 PENDING launch failed requeued held' >"$T/queue"
check "held ones are dropped" soon calls '^scancel 101_1' 1
seq 0 9 | sed 's/.*/55_& PENDING BeginTime/' >"$T/queue"
: >"$T/calls"
check "those that wait for a time are, when they are in the way" soon calls '^scancel 55_0 .*55_9' 1
check "and others asked for" soon calls '^sbatch ' 1
: >"$T/queue"

# ---- a command that hangs
touch "$T/hangs"
check "a command that hangs is told" soon logged 'event=slurm_silent command=squeue'
: >"$T/calls"
check "ended, with what it started" soon sh -c "! kill -0 \$(head -1 '$T/sleeping')"
check "asked again" soon calls '^squeue ' 2
check "and seen in the metrics" metric bcd_slurm_answers 0
check "no more workers are asked for meanwhile" sh -c "! grep '^sbatch ' '$T/calls'"
ask GET "/v1/jobs/$ID"
check "the job knows nothing of it" holds '.state == "running"'
daemon_end TERM
check "the daemon ends all the same" test "$EXIT" = 0
check "and what hung with it" soon sh -c "! kill -0 \$(tail -1 '$T/sleeping')"
rm "$T/hangs"
: >"$T/queue"

# ---- no arrays, no accounting, a directory, a Slurm that refuses
echo 0 >"$T/array"
echo 'accounting_storage/none' >"$T/storage"
mkdir "$T/share"
touch "$T/refuses"
: >"$T/calls"
start --share "$T/share"
check "sbatch that refuses is told" soon logged 'event=slurm_silent command=sbatch status=1'
rm "$T/refuses"
check "and tried again" soon grep -q "PENDING" "$T/queue"
check "without arrays" sh -c "! grep -e '--array=' '$T/calls'"
check "a worker is told of the directory" grep -qE "^exec bcd worker --idle 60 --share $T/share --name" "$T/script"
: >"$T/queue"
: >"$T/calls"
check "and those that vanish are made up for" soon calls '^sbatch ' 1
check "without asking who does not know" sh -c "! grep '^sacct ' '$T/calls'"
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
finish
