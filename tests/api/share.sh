#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Workers that do not reach the daemon, and meet it in a directory: one is killed, one told to end,
# the daemon is killed and started again, files are torn; the results are those of one machine, bit
# for bit.
# Waits: for looks into a directory, and for leases to end.
. "$(dirname "$0")/_lib.sh"
. "$(dirname "$0")/_workers.sh"

job() { # SEED TIME REALIZATIONS
    printf '{"particles":30,"length":60,"diameter":0.5,"time":%s,"time_step":0.001,"seed":%s,' "$2" "$1"
    printf '"realizations":%s,"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{}}}' "$3"
}
worker() { # [options]
    worker_start --share "$T/share" "$@"
}
start() {
    daemon_start "$T/data" --backend workers --share "$T/share" --workers 8 --lease 4
}
metric() { # NAME LEAST
    [ "$(curl -sS -m 60 "$URL/metrics" | awk -v name="$1" '$1 == name { print $2 }')" -ge "$2" ]
}
same_bits() { # ID FILE
    ask GET "/v1/jobs/$1/results"
    jq -S . "$T/body" >"$T/theirs"
    "$B/bcd" run --quiet "$2" | jq -S . | cmp - "$T/theirs"
}

timeout 60 "$B/bcdd" --data "$T/data" --listen 127.0.0.1:0 --backend workers --share "$T/nowhere" >"$T/out" 2>"$T/err"
check "a directory that is not there" sh -c "[ $? = 1 ] && grep -q 'shared directory .*nowhere: No such file' '$T/err'"
timeout 60 "$B/bcdd" --data "$T/data" --listen 127.0.0.1:0 --share "$T" >"$T/out" 2>"$T/err"
check "a directory for nobody" test "$?" = 2
"$B/bcd" worker --share "$T/nowhere" >"$T/out" 2>"$T/err"
check "nor does a worker make it" test "$?" = 2

mkdir "$T/share"
start
timeout 60 "$B/bcdd" --data "$T/other" --listen 127.0.0.1:0 --backend workers --share "$T/share" >"$T/out" 2>"$T/err"
check "a second daemon is refused" grep -q "is another daemon's" "$T/err"
worker
worker
worker
job 1 20 24 >"$T/first"
post "$T/first"
check "a job is done" until_state "$ID" done
check "with the bits of one machine" same_bits "$ID" "$T/first"

# ---- kill -9, SIGTERM, and a daemon that is away for a while
job 2 800 8 >"$T/second"
post "$T/second"
second=$ID
check "three have a chunk" eventually metric bcd_leases_held 3
sleep 0.5
check "told to end one ends" kill_one_end_another
worker
daemon_end KILL
echo '{"job":"j1","chunk":0,"core' >"$T/share/returns/l0000"
ln -s /etc/passwd "$T/share/returns/l0001"
mkdir -p "$T/share/returns/l0002/x" "$T/share/refused/l0002/x" # cannot be moved away
LISTEN=127.0.0.1:${URL##*:}
start
check "the daemon was killed; workers went on" eventually metric bcd_leases_held 1
refused() { # HOW_MANY
    [ "$(grep -c 'event=share_refused file=l000' "$T/stderr")" = "$1" ]
}
check "torn files are refused" eventually refused 3
check "the job is done" until_state "$second" done
check "with the bits of one machine" same_bits "$second" "$T/second"
check "no result differed" sh -c "curl -sS $URL/metrics | grep -qx 'bcd_leases_differed_total 0'"

# ---- one is killed, and the job is cancelled
worker
post_text "$(job 3 100000 8)"
check "another is under way" eventually metric bcd_leases_held 3
expired=$(curl -sS "$URL/metrics" | awk '$1 == "bcd_leases_expired_total" { print $2 }')
kill -9 "$LAST"
check "who is not heard of any more loses it" eventually metric bcd_leases_expired_total $((expired + 1))
worker
check "another takes it" eventually metric bcd_leases_held 3
check "who lived kept what it had" sh -c "curl -sS $URL/metrics | grep -qx 'bcd_leases_expired_total $((expired + 1))'"
ask DELETE "/v1/jobs/$ID"
job 4 2 8 >"$T/fourth"
post "$T/fourth"
check "a cancelled one makes room for the next" until_state "$ID" done
nothing_lies_about() {
    find "$T/share" -path '*refused' -prune -o -type f ! -name '.*' -print >"$T/said"
    [ ! -s "$T/said" ]
}
check "nothing is left lying about" eventually nothing_lies_about
check "and nothing else was refused" test "$(grep -c 'event=share_refused' "$T/stderr")" = 3
check "workers had nothing to complain of" sh -c "! grep . '$T/worker.err'"
daemon_end TERM
check "the daemon ends" test "$EXIT" = 0
finish
