# SPDX-License-Identifier: GPL-3.0-or-later
# _crash.sh - kill -9 again and again, at random moments (seeded): while jobs are submitted, run and
# make checkpoints, while a backup is made, while the daemon starts, while it migrates. What was
# acknowledged is done in the end, with the bits of a daemon that was left alone. Read with `.` after
# KILLS and SEED are set.
. "$(dirname "$0")/_lib.sh"

below() { # N: a random number 0..N-1 in R
    SEED=$(((SEED * 1103515245 + 12345) % 2147483648))
    R=$((SEED / 65536 % $1))
}
nap() { # milliseconds
    sleep "$(printf '%d.%03d' $(($1 / 1000)) $(($1 % 1000)))"
}

# Every tenth is one long chunk, every other of these one whose checkpoints are files; the rest are
# short, in several chunks.
job() { # NUMBER
    case $(($1 % 20)) in
    11) printf '{"particles":4000,"length":8000,"diameter":0.5,"time":12,"time_step":0.001,"seed":%s,' "$1" ;;
    1) printf '{"particles":100,"length":200,"diameter":0.5,"time":400,"time_step":0.001,"seed":%s,' "$1" ;;
    *) printf '{"particles":30,"length":60,"diameter":0.5,"time":30,"time_step":0.001,"seed":%s,' "$1"
        printf '"realizations":3,' ;;
    esac
    printf '"potential":{"type":"cosine","amplitude":6},"observables":{"energy":{},"msd":{"first":0.01,'
    printf '"last":1,"points":10},"density":{"bins":20}}}'
}
submit() { # NUMBER: what was acknowledged goes to $T/acked, in one write
    answer=$(curl -s -m 60 "$URL/v1/jobs" -d "$(job "$1")" | jq -r '.id // empty' 2>/dev/null)
    [ -z "$answer" ] || echo "$1 $answer" >>"$T/acked"
}
sweep() { # NUMBER: four points that no job has
    printf '{"base":%s,"axes":{"/seed":{"first":%s,"count":4}}}' "$(job 2)" $((100000 + 4 * $1))
}
submit_sweep() { # NUMBER
    answer=$(curl -s -m 60 "$URL/v1/sweeps" -d "$(sweep "$1")" | jq -r '.id // empty' 2>/dev/null)
    [ -z "$answer" ] || echo "$1 $answer" >>"$T/acked.sweeps"
}
start() { # DIR: without waiting until it listens
    : >"$T/stdout"
    "$B/bcdd" --listen "$LISTEN" --data "$1" --nice 0 --workers 2 >"$T/stdout" 2>>"$T/stderr" &
    PID=$!
    URL=
}
await() {
    end=$(($(date +%s) + 60))
    while [ -z "$URL" ] && [ "$(date +%s)" -lt $end ]; do
        URL=$(sed -n '1s/^listening on //p' "$T/stdout")
        sleep 0.01
    done
    [ -n "$URL" ] || stuck=$((stuck + 1))
}
whole() { # FILE
    [ "$(sqlite3 "$1" 'PRAGMA integrity_check; PRAGMA foreign_key_check' 2>&1)" = ok ]
}

ended() { # ID: waits until it is done, on a loaded machine, too
    for try in 1 2 3 4 5; do
        [ "$(curl -s -m 70 "$URL/v1/jobs/$1?wait=60" | jq -r .state)" = done ] && return
    done
    return 1
}

sweep_ended() { # ID
    curl -sS -m 60 "$URL/v1/sweeps/$1" | jq -e '.jobs == 4 and .states.done == 4' >/dev/null
}

# A database of version 6 with jobs in it, as that version made it.
make_old() { # FILE
    for file in schema/00[1-6]_*.sql; do
        { echo "BEGIN;" && cat "$file" && echo "COMMIT;"; } | sqlite3 "$1" || return 1
    done
    sqlite3 "$1" "PRAGMA application_id = 0x62636464; PRAGMA user_version = 6;
        WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 500)
        INSERT INTO jobs (id, hash, submitted_ms, chunks, job, derived)
        SELECT 'jold' || i, CAST(printf('%032d', i) AS BLOB), i, 1, '{\"seed\":' || i || '}', '{}'
        FROM n;
        UPDATE jobs SET state = 'cancelled', finished_ms = 9;"
}

killed=0 stuck=0 torn=0
number=0
: >"$T/acked"
: >"$T/acked.sweeps"

kill_while_it_runs() { # $1 = "backup" or not
    start "$T/data"
    await
    [ -z "$1" ] || curl -s -m 60 -o "$T/copy" "$URL/v1/backup" &
    copying=$!
    number=$((number + 1))
    submit $number
    number=$((number + 1))
    case $((number % 24)) in # one of the sweeps is acknowledged for certain, however slow the machine
    2) submit_sweep $number ;;
    14) submit_sweep $number & ;;
    *) submit $number & ;;
    esac
    submitting=$!
    case $1,$((killed % 10)) in # in a backup; around the first checkpoint of a long chunk; elsewhere
    backup,*) below 40 ;;
    ,[05]) below 150 && R=$((R + 450)) ;;
    *) below 200 ;;
    esac
    nap "$R"
    daemon_end KILL
    wait "$submitting" 2>/dev/null
    [ -z "$1" ] || wait "$copying" 2>/dev/null
}
kill_while_it_starts() {
    start "$T/data"
    below 50
    nap "$R"
    daemon_end KILL
}
kill_while_it_migrates() {
    rm -rf "$T/old"
    mkdir "$T/old"
    cp "$T/old.sqlite" "$T/old/bcd.sqlite"
    start "$T/old"
    below 120
    nap "$R"
    daemon_end KILL
    for backup in "$T"/old/*.bak; do
        [ ! -e "$backup" ] || whole "$backup" || torn=$((torn + 1))
    done
    start "$T/old"
    await
    daemon_end TERM
    [ "$(sqlite3 "$T/old/bcd.sqlite" "SELECT count(*) FROM jobs, pragma_user_version
        WHERE user_version > 6")" = 500 ] && whole "$T/old/bcd.sqlite" || torn=$((torn + 1))
}

check "an old database" make_old "$T/old.sqlite"
while [ $killed -lt "$KILLS" ]; do
    case $((killed % 10)) in
    3) kill_while_it_migrates ;;
    2 | 6) kill_while_it_starts ;;
    4 | 8) kill_while_it_runs backup ;;
    *) kill_while_it_runs "" ;;
    esac
    killed=$((killed + 1))
    [ $((killed % 25)) -ne 0 ] || whole "$T/data/bcd.sqlite" || torn=$((torn + 1))
done
acked=$(wc -l <"$T/acked")
check "it starts after every one of $killed kills" test "$stuck" = 0
check "databases and backups are whole ($torn are not)" test "$torn" = 0
check "jobs were acknowledged ($acked)" test "$acked" -ge $((killed / 2))

# ---- what became of them
daemon_start "$T/data" --workers 2
lost=0
while read -r n id; do
    ended "$id" || { lost=$((lost + 1)) && echo "# job $n $id is not done"; }
done <"$T/acked"
check "every acknowledged job is done ($lost are not)" test "$lost" = 0
while read -r n id; do
    eventually sweep_ended "$id" || { lost=$((lost + 1)) && echo "# sweep $n $id is not done"; }
done <"$T/acked.sweeps"
check "every point of $(wc -l <"$T/acked.sweeps") acknowledged sweeps too" test "$lost" = 0
check "none is left" test "$(curl -sS "$URL/v1/jobs?state=queued&state=running&state=failed" | jq '.jobs | length')" = 0
check "none is blamed" test "$(sqlite3 "$T/data/bcd.sqlite" 'SELECT sum(attempts_failed) FROM jobs')" = 0
check "attempts were lost" test "$(sqlite3 "$T/data/bcd.sqlite" 'SELECT sum(attempts_lost) FROM jobs')" -ge 5
check "nothing half is left behind" sh -c "! ls $T/data $T/data/checkpoints | grep -E 'partial|^j'"
mkdir "$T/one" "$T/two"
while read -r n id; do
    curl -sS "$URL/v1/jobs/$id/results" | jq -c 'del(.id)' >"$T/one/$n"
done <"$T/acked"
while read -r n id; do
    curl -sS "$URL/v1/sweeps/$id/results/msd" | jq -c '[.rows[] | del(.job)]' >"$T/one/sweep$n"
done <"$T/acked.sweeps"
daemon_end TERM

# ---- the same, left alone
daemon_start "$T/calm" --workers 2
while read -r n id; do
    curl -sS "$URL/v1/jobs" -d "$(job "$n")" | jq -r --arg n "$n" '$n + " " + .id' >>"$T/calm.ids"
done <"$T/acked"
while read -r n id; do
    ended "$id"
    curl -sS "$URL/v1/jobs/$id/results" | jq -c 'del(.id)' >"$T/two/$n"
done <"$T/calm.ids"
while read -r n id; do
    id=$(curl -sS "$URL/v1/sweeps" -d "$(sweep "$n")" | jq -r .id)
    until sweep_ended "$id"; do sleep 0.1; done
    curl -sS "$URL/v1/sweeps/$id/results/msd" | jq -c '[.rows[] | del(.job)]' >"$T/two/sweep$n"
done <"$T/acked.sweeps"
daemon_end TERM
check "all of them with the same bits" diff -rq "$T/one" "$T/two"
sweeps=$(wc -l <"$T/acked.sweeps")
check "all were compared" test "$(ls "$T/two" | wc -l) $(cat "$T"/one/* | grep -c '"msd"')" = \
    "$((acked + sweeps)) $((acked + sweeps))"
check "sweeps among them" test "$sweeps" -ge $((killed / 25))
finish
