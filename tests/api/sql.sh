#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcd sql, and the same tables in the sqlite3 shell: what they give is what the service answers; it
# can neither change anything nor go on for ever.
. "$(dirname "$0")/_lib.sh"
daemon_start "$T/data" --workers 2

for diameter in 0.5 0.25; do
    post_text '{"particles":20,"length":40,"diameter":'$diameter',"time":2,"time_step":0.001,
        "potential":{"type":"cosine","amplitude":6},"label":"half, or \"less\"","tags":["a","b"],
        "observables":{"msd":{"first":0.01,"last":1,"points":10},"density":{"bins":25},"energy":{},
                       "cluster_sizes":{}}}'
    until_state "$ID" done
done
ask GET "/v1/jobs/$ID/results"
cp "$T/body" "$T/results"

sql() { # WORDS...: the answer to $T/out, words to $T/err, EXIT
    "$B/bcd" sql --data "$T/data" "$@" >"$T/out" 2>"$T/err"
    EXIT=$?
}
out() {
    jq -e "$@" <"$T/out"
}
refused() {
    [ "$EXIT" = 1 ] && [ ! -s "$T/out" ] && grep -q -- "$1" "$T/err"
}

question='select j.diameter, m.lag, m.msd from jobs j, msd(j.id) m
          where j.diameter = 0.25 order by m.lag'
sql --json "$question"
check "the issue's question is answered" out 'length == 10 and (.[0] | keys) == ["diameter","lag","msd"]'
check "with the very numbers of the service" out --slurpfile r "$T/results" \
    'map(.msd) == $r[0].msd.msd and map(.lag) == $r[0].msd.lag'
cp "$T/out" "$T/answer"
sqlite3 -json "file:$T/data/bcd.sqlite?mode=ro" ".load $B/bcd_sqlite" "$question" >"$T/out" 2>"$T/err"
check "the sqlite3 shell with the extension says the same" test "$(jq -c . "$T/out")" = \
    "$(jq -c . "$T/answer")"
sql --csv "$question"
check "CSV: a header and ten rows" test "$(head -n 1 "$T/out") $(wc -l <"$T/out")" = "diameter,lag,msd 11"
check "CSV: the same numbers" test "$(sed 1d "$T/out" | cut -d , -f 3)" = "$(jq -r '.[].msd' "$T/answer")"
sql "select id, label, diameter from jobs order by diameter"
check "a table: names, then rows of one width each" awk 'NR == 1 { ok = /^id +label +diameter$/ }
    NR == 2 { ok = ok && /half, or "less" +0.25$/ } END { exit !ok || NR != 3 }' "$T/out"
sql --csv "select label from jobs limit 1"
check "CSV quotes" test "$(sed -n 2p "$T/out")" = '"half, or ""less"""'
sql --json 'select j.id, e.energy, e.stderr, e.job from energy e join jobs j on j.id = e.job
          order by j.seq'
check "without a job: of all jobs" out --slurpfile r "$T/results" \
    'length == 2 and .[1].energy == $r[0].energy.energy and .[0].id == .[0].job'
sql --json "select x, density, theory, z from density('$ID')"
check "columns that are lists" out --slurpfile r "$T/results" \
    'map(.density) == $r[0].density.density and map(.theory) == $r[0].density.theory'
sql --json "select count(*) n from msd('nosuchjob')"
check "of no job: nothing" out '. == [{"n": 0}]'
sql --json "select value from notes('$ID') where observable = 'density' and name = 'p_value'"
check "notes" out --slurpfile r "$T/results" '.[0].value == $r[0].density.p_value'
sql --json "select state, owner, tags, priority, potential, potential_amplitude, derived_steps,
    progress, method, submitted_at from jobs limit 1"
check "jobs has what a record has" out '.[0] | .state == "done" and .tags == "a b"
    and .potential == "cosine" and .potential_amplitude == 6 and .derived_steps == 2000
    and .progress == 1 and .method == "auto" and (.submitted_at | test("Z$"))'
sql --json "select 1 where 0"
check "nothing is an empty list" out '. == []'
"$B/bcd" sql --file "$T/data/bcd.sqlite" - >"$T/out" 2>"$T/err" <<'END'
select count(*) as n from jobs
END
check "a question on stdin, to a file" test "$(tr -d ' \n' <"$T/out")" = n2
"$B/bcd" sql --schema >"$T/out"
check "the schema is told, with comments" grep -q -- '--   msd(job): lag, msd, stderr' "$T/out"
for table in msd density energy notes cluster_sizes trajectory; do
    sql "select count(*) from $table"
    check "$table is there" test "$EXIT" = 0
done

# ---- what it does not do
for word in 'delete from main.jobs' 'update main.jobs set label = 1' 'drop table results' \
    'create table t (a)' "attach '$T/x' as x" 'pragma journal_mode = delete' 'vacuum' 'begin'; do
    sql "$word"
    check "not: $word" refused .
done
check "nothing was changed" test "$(sqlite3 "$T/data/bcd.sqlite" 'select count(*) from jobs')" = 2
sql "select load_extension('x')"
check "not: another extension" refused 'load_extension'
sql "select 1; select 2"
check "not two at once" refused 'one statement'
sql "selec"
check "a slip is told" refused 'near "selec"'
sql "select a from jobs"
check "so is a column that is none" refused 'no such column: a'
sql --timeout 0.3 "with recursive n(i) as (select 1 union all select i + 1 from n) select max(i) from n"
check "it ends in time" refused 'longer than 0.3 s'
before=$(date +%s%N)
sql --timeout 0.3 "select instr(zeroblob(90000000), zeroblob(45000000) || x'01')"
check "and in the middle of one function" refused 'longer than 0.3 s, in one function'
check "not much later" test $((($(date +%s%N) - before) / 1000000)) -lt 20000
sql "select length(hex(zeroblob(100000000)))"
check "no text is longer than what is bearable" refused 'longer than 104857600 bytes'
"$B/bcd" sql --file "$T/nothing" "select 1" >"$T/out" 2>"$T/err"
EXIT=$?
check "no such file" refused 'no such file'
echo 'no database' >"$T/text"
"$B/bcd" sql --file "$T/text" "select 1" >"$T/out" 2>"$T/err"
EXIT=$?
check "no database" refused 'not a database'
sqlite3 "$T/other" 'create table jobs (a)'
"$B/bcd" sql --file "$T/other" "select 1" >"$T/out" 2>"$T/err"
EXIT=$?
check "a database of another program" refused 'no database of bcdd'
"$B/bcd" sql "select 1" >"$T/out" 2>"$T/err"
check "which database must be said" test $? = 2

# ---- after the daemon
daemon_end KILL
sql --json "$question"
check "after kill -9 the same is answered" cmp "$T/out" "$T/answer"
finish
