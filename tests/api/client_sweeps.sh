#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcd sweep, and what watch, list, get, export and cancel do with sweeps.
. tests/api/_lib.sh
. tests/api/_client.sh

job='{"particles":4,"length":8,"diameter":0.5,"potential":{"type":"cosine","amplitude":6},"method":"bcd",
"time_step":1e-3,"time":0.5,"realizations":2,"observables":{"density":{"bins":4},"energy":{}}}'
printf '%s' "$job" >"$T/job.json"
printf '%s' "$job" | sed 's/"time":0.5/"time":1e6/' >"$T/long.json"
daemon_start "$T/data" --workers 2
BCD_URL=$URL
export BCD_URL

# --- by axes on the command line
bcd sweep "$T/job.json" --axis /diameter=0.1,0.5 --axis /seed=1..3 --axis /potential/amplitude=0..6:2 \
    --label abc --tag one --wait
check "sweep --wait: exit status 0" exits 0
ID=$(head -n 1 "$T/out")
check "sweep: an id" sh -c "echo $ID | grep -qxE 's[a-z0-9]+'"
check "sweep: all combinations" prints "$ID done 12/12 jobs.*"
bcd get "$ID" --json
check "sweep: axes, label, tag" \
    out '.axes["/diameter"] == [0.1, 0.5] and .axes["/seed"] == [1, 2, 3] and
         .axes["/potential/amplitude"] == [0, 6] and ."label" == "abc" and .tags == ["one"]'
bcd get "$ID"
check "get: counts" prints 'states.done +12'
bcd list --sweeps
check "list --sweeps" prints "$ID +done +100 % .* 12"
bcd list --sweep "$ID" --all
check "list --sweep: its jobs" sh -c "[ \$(grep -c '^j' '$T/out') -eq 12 ]"
check "list --sweep: what they differ in" prints 'ID .* diameter .* seed .*potential.amplitude.*'
bcd watch "$ID"
check "watch: it has ended" exits 0

# --- files, zips, ranges
printf '{"base":%s,"axes":{"/diameter":[0.2,0.3]}}' "$job" >"$T/sweep.json"
bcd sweep "$T/sweep.json" --json --label file
check "sweep FILE: taken as it is" out '.jobs == 2 and ."label" == "file"'
"$B/bcd" sweep - <"$T/sweep.json" >"$T/out"
check "sweep -: the same sweep again" prints 's.*'
bcd sweep "$T/job.json" --axis /diameter=0.1,0.2,0.3 --axis /length=8,9,10 --zip /diameter,/length --json
check "sweep --zip: side by side" out '.jobs == 3'
bcd sweep "$T/job.json" --axis /tolerance=0.001..0.1:3 --log --json
check "sweep --log: equal ratios" out '.axes["/tolerance"] | (.[1] - 0.01 | fabs) < 1e-12'

# --- export
for form in csv ndjson json; do
    bcd export "$ID" density -o "$T/got.$form"
    check "export -o .$form: exit status 0" exits 0
    ask GET "/v1/sweeps/$ID/results/density$([ $form = json ] || echo .$form)"
    check "export -o .$form: the server's bytes" cmp "$T/got.$form" "$T/body"
    bcd export "$ID" density --$form
    check "export --$form: the same on stdout" cmp "$T/out" "$T/body"
done
check "export: a row for each job and bin" sh -c "[ \$(wc -l <'$T/got.csv') -eq 49 ]"
check "export: a line for each job" sh -c "[ \$(wc -l <'$T/got.ndjson') -eq 12 ]"
bcd export "$ID" density -o "$T/got.npz"
check "export -o .npz: a zip archive" sh -c "head -c 2 '$T/got.npz' | grep -q PK"
bcd export "$ID" msd -o "$T/absent.csv"
check "export: nobody asked for it: exit status 1" exits 1
check "export: and no file is left" sh -c "! ls '$T'/absent* 2>/dev/null"

# --- extend, retry, cancel
bcd sweep --extend "$ID" --axis /seed=4..5 --wait
check "sweep --extend: exit status 0" exits 0
check "sweep --extend: more of them" prints "$ID done 20/20 jobs.*"
bcd sweep --retry "$ID" --json
check "sweep --retry: nothing had failed" out '.jobs == 20'
bcd sweep "$T/long.json" --axis /seed=1..5
LONG=$(cat "$T/out")
bcd cancel "$LONG"
check "cancel: exit status 0" exits 0
bcd watch "$LONG"
check "watch: a cancelled sweep: exit status 1" exits 1
check "watch: how it ended" prints "$LONG cancelled 0/5 jobs, 5 cancelled.*"

# --- what is wrong
bcd sweep "$T/job.json" --axis /diameter=0.1,-1
check "a wrong point: exit status 1" exits 1
check "a wrong point: its pointer" says '/diameter: must be'
bcd sweep "$T/job.json" --axis /frobnicate=1,2
check "an axis that is no parameter: exit status 1" exits 1
usage_error "no file" sweep
usage_error "an axis without values" sweep "$T/job.json" --axis /diameter
usage_error "a range without points" sweep "$T/job.json" --axis /diameter=0.1..0.5
check "usage: how ranges are written" says '0..6:7'
usage_error "extend without values" sweep --extend "$ID"
usage_error "extend and a file" sweep --extend "$ID" "$T/job.json" --axis /seed=9
usage_error "retry of a job" sweep --retry jx
usage_error "extend and retry" sweep --extend "$ID" --retry "$ID"
printf '{,' >"$T/bad.json"
usage_error "a base that is not JSON" sweep "$T/bad.json" --axis /seed=1..2
check "usage: where it is not" says 'line 1, column 2'
daemon_end TERM
finish
