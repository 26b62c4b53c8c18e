#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcd on the command line: results, forms, faults, exit statuses, progress, Ctrl-C; and the same
# numbers as the daemon's, byte for byte.
. tests/api/_lib.sh
. tests/api/_client.sh

job='{"particles":20,"length":40,"diameter":0.5,"potential":{"type":"cosine","amplitude":6},
"time_step":1e-3,"time":5,"equilibration_time":1,"realizations":6,"seed":7,"observables":{
"msd":{"first":0.001,"last":2,"points":15},"density":{"bins":20},"current":{},"energy":{},
"cluster_sizes":{}}}'
printf '%s' "$job" >"$T/job.json"
printf '%s' "$job" | sed 's/"time":5/"time":1e7/' >"$T/long.json"
printf '%s' "$job" | sed 's/"time":5/"time":1000/' >"$T/medium.json"

# --- results
bcd run "$T/job.json"
check "run: exit status 0" exits 0
check "run: a pipe's stderr stays empty" silent err
check "run: what was asked for, no more" out 'keys == ["cluster_sizes", "current", "density", "energy", "msd"]'
check "run: 15 lags with errors" out '.msd | (.lag | length) == 15 and (.stderr | length) == 15'
check "run: mean density is N/L" out '.density.density | (add / length - 0.5 | fabs) < 1e-9'
cp "$T/out" "$T/reference"
for workers in 1 2 5; do
    bcd run --workers $workers "$T/job.json"
    check "run: the same bytes from $workers workers" cmp "$T/out" "$T/reference"
done
bcd run - <"$T/job.json"
check "run: the same bytes from stdin" cmp "$T/out" "$T/reference"

bcd run --record "$T/job.json"
check "run --record: job, derived, outcome, results" out 'keys == ["derived", "job", "outcome", "results"]'
check "run --record: the results are those of run" \
    sh -c "jq -S .results '$T/out' >'$T/a'; jq -S . '$T/reference' >'$T/b'; cmp '$T/a' '$T/b'"
jq .job "$T/out" >"$T/completed.json"
bcd run "$T/completed.json"
check "run: the completed job gives the same bytes" cmp "$T/out" "$T/reference"

bcd run --csv msd "$T/job.json"
check "run --csv: a header and 15 rows" \
    sh -c "head -1 '$T/out' | grep -q '^lag,msd,stderr' && [ \$(wc -l <'$T/out') -eq 16 ]"
bcd run --svg density "$T/job.json"
check "run --svg: a picture" grep -q '^<svg xmlns="http://www.w3.org/2000/svg"' "$T/out"
if command -v xmllint >/dev/null; then
    check "run --svg: well-formed" xmllint --noout "$T/out"
fi
check "run --svg: tells the parameters" grep -q 'particles 20, length 40, diameter 0.5' "$T/out"

# --- check
bcd check "$T/job.json"
check "check: exit status 0" exits 0
check "check: job, derived, estimate, hash" out 'keys == ["derived", "estimate", "hash", "job"]'
check "check: steps are counted" out '.derived.steps == 5000 and .estimate.steps == 42000'
check "check: defaults are filled in" out '.job.temperature == 1 and .job.potential.wavelength == 1'
bcd check "$T/long.json"
check "check: a long job is only checked" out '.estimate.core_seconds > 100'

# --- faults
printf '{"particles":-1,"frobnicate":2,"length":1e400,"potential":{"type":"cosin"}}' >"$T/bad.json"
bcd run "$T/bad.json"
check "faults: 1e400, with its field" says '/length: 1e400 is too large'
check "faults: exit status 1" exits 1
check "faults: nothing on stdout" silent out
printf '{"particles":-1,"frobnicate":2,"length":"x","potential":{"type":"cosin"}}' >"$T/bad.json"
for command in run check; do
    bcd $command "$T/bad.json"
    check "$command: exit status 1 for a wrong job" exits 1
    check "$command: range" says '/particles: '
    check "$command: unknown key" says '/frobnicate: unknown key'
    check "$command: type" says '/length: '
    check "$command: part, with a suggestion" says '/potential/type: unknown; did you mean "cosine"?'
    check "$command: required" says '/time: is required'
done
printf '{"particles":1,,}' | "$B/bcd" run - >"$T/out" 2>"$T/err"
EXIT=$?
check "not JSON: exit status 1" exits 1
check "not JSON: line and column" says 'is not JSON: line 1, column '
printf '{"\\u001b[31m":1}' | "$B/bcd" run - >"$T/out" 2>"$T/err"
check "faults: no control characters reach the terminal" \
    sh -c "! LC_ALL=C grep -q '[[:cntrl:]]' '$T/err'"
bcd run "$T/none.json"
check "a missing file: exit status 1" exits 1
check "a missing file: the cause" says 'none.json cannot be read: No such file'
bcd run "$T"
check "a directory: exit status 1" exits 1

# --- wrong command lines
usage_error "no command"
usage_error "unknown command" frobnicate
usage_error "no job" run
usage_error "two jobs" run "$T/job.json" "$T/job.json"
usage_error "no such option" run --frobnicate "$T/job.json"
usage_error "workers 0" run --workers 0 "$T/job.json"
usage_error "workers x" run --workers 2x "$T/job.json"
usage_error "option without its value" run "$T/job.json" --csv
usage_error "forms that exclude one another" run --csv msd --record "$T/job.json"
usage_error "help for an unknown command" help frobnicate
usage_error "an observable that was not asked for" run --csv contact_density "$T/job.json"
check "usage: names those that were" says 'msd, density'
bcd --version
check "--version" grep -qx 'bcd [0-9]*\.[0-9]*\.[0-9]*' "$T/out"
for arguments in --help 'help run' 'run --help' 'check --help'; do
    # shellcheck disable=SC2086
    bcd $arguments
    check "$arguments: exit status 0" exits 0
    check "$arguments: usage" grep -q '^usage: bcd ' "$T/out"
done

# --- a full disk
if [ -e /dev/full ]; then
    "$B/bcd" run "$T/job.json" >/dev/full 2>"$T/err"
    EXIT=$?
    check "a full disk: exit status 1" exits 1
    check "a full disk: the cause" says 'No space left'
fi

# --- signals
for signal in INT:130 TERM:143; do
    signalled "${signal%:*}" run "$T/long.json"
    check "${signal%:*}: exit status ${signal#*:}" exits "${signal#*:}"
    check "${signal%:*}: no results" silent out
    check "${signal%:*}: says so" says 'bcd: ended by '
done

# --- progress, on a terminal only (script makes one)
if command -v script >/dev/null; then
    terminal() { # OPTION
        timeout -k 10 120 script -qec "$B/bcd run $1 $T/medium.json >$T/out" /dev/null \
            </dev/null >"$T/err"
    }
    terminal ""
    check "progress: percentage, steps/s and remaining time" \
        grep -Eq '[0-9]\.[0-9] %, [0-9.e+]+ steps/s, [0-9]+:[0-9]+:[0-9]+ left' "$T/err"
    terminal --quiet
    check "progress: none with --quiet" silent err
fi

# --- the daemon's numbers
daemon_start "$T/data" --workers 2
post "$T/job.json"
check "daemon: accepts the job" status_is 202
check "daemon: finishes it" until_state "$ID" done
ask GET "/v1/jobs/$ID/results"
check "daemon: the same bytes as bcd run" cmp "$T/body" "$T/reference"
for form in csv svg; do
    ask GET "/v1/jobs/$ID/results/msd.$form"
    bcd run --$form msd "$T/job.json"
    check "daemon: the same $form as bcd run --$form" cmp "$T/body" "$T/out"
done
ask GET "/v1/jobs/$ID"
bcd check "$T/job.json"
check "daemon: the same completed job and derived facts" \
    sh -c "jq -S '.job, .derived' '$T/body' >'$T/a'; jq -S '.job, .derived' '$T/out' >'$T/b'; cmp '$T/a' '$T/b'"
daemon_end TERM

finish
