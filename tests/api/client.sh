#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcd against a server: jobs. Every command, its forms, wrong input, a server that is not there, one
# that goes away and comes back, a terminal.
. tests/api/_lib.sh
. tests/api/_client.sh

job='{"particles":10,"length":20,"diameter":0.5,"potential":{"type":"cosine","amplitude":6},
"method":"bcd","time_step":1e-3,"time":1,"realizations":2,"observables":{"density":{"bins":4},"energy":{}}}'
printf '%s' "$job" >"$T/job.json"
printf '%s' "$job" | sed 's/"time":1,/"time":1e6,/' >"$T/long.json"
printf '%s' "$job" | sed 's/"time":1,/"time":2,"seed":5,/' >"$T/other.json"
printf '%s' "$job" | sed 's/"time":1,/"time":1500,"seed":6,/' >"$T/medium.json"
printf '{"particles":-1,"frobnicate":2}' >"$T/bad.json"

# --- nobody there
BCD_URL=http://127.0.0.1:1
export BCD_URL
for command in "submit $T/job.json" "list" "get jx" "watch jx" "cancel jx" "estimate $T/job.json" \
    "export sx msd"; do
    # shellcheck disable=SC2086
    bcd $command
    check "no server: ${command%% *}: exit status 3" exits 3
    check "no server: ${command%% *}: says where" says "no answer from http://127.0.0.1:1"
done

daemon_start "$T/data" --workers 2
BCD_URL=$URL

# --- submit
bcd submit "$T/job.json"
check "submit: exit status 0" exits 0
check "submit: the id alone" prints 'j[a-z0-9]+'
check "submit: a pipe's stderr stays empty" silent err
ID=$(cat "$T/out")
bcd submit --wait "$T/job.json"
check "submit --wait: exit status 0" exits 0
check "submit: the same job is the same id" sh -c "[ \"\$(head -n 1 '$T/out')\" = $ID ]"
check "submit --wait: how it ended" prints "$ID done( in .*)?"
"$B/bcd" submit - <"$T/job.json" >"$T/out"
check "submit -: stdin" prints "$ID"
bcd submit --label 'a "b" ä' --tag one --tag two --priority 7 --force --json "$T/job.json"
check "submit: label, tags, priority" \
    out '."label" == "a \"b\" ä" and .tags == ["one", "two"] and .priority == 7'
check "submit --force: another job" sh -c "! grep -q $ID '$T/out'"
bcd submit "$T/job.json" "$T/bad.json" "$T/other.json"
check "submit: a wrong file among right ones: exit status 1" exits 1
check "submit: the others are taken" sh -c "[ \$(wc -l <'$T/out') -eq 2 ]"
check "submit: faults with their pointers" says '/particles: must be'
check "submit: all of them" says '/frobnicate: unknown key'
check "submit: whose" says 'bad.json: The job has faults (422)'
bcd submit --label x "$T/bad.json"
check "submit: the server's words with a label too" says '/frobnicate: unknown key'
printf '{"particles":1e400}' >"$T/huge.json"
bcd submit --label x "$T/huge.json"
check "submit: numbers reach the server as they are" says '1e400 is too large'
bcd submit "$T/none.json"
check "submit: a missing file: exit status 1" exits 1

# --- get
bcd get "$ID"
check "get: what is known of it" prints 'state +done'
check "get: parameters" prints 'job.potential.amplitude +6'
bcd get "$ID" --json
cp "$T/out" "$T/record"
ask GET "/v1/jobs/$ID"
check "get --json: the server's bytes" cmp "$T/record" "$T/body"
bcd get "$ID" density
check "get: a table of an observable" \
    sh -c "head -n 1 '$T/out' | grep -qE '^ *x +density +stderr' && [ \$(wc -l <'$T/out') -eq 5 ]"
for form in csv svg json; do
    bcd get "$ID" density -o "$T/got.$form"
    ask GET "/v1/jobs/$ID/results/density$([ $form = json ] || echo .$form)"
    check "get -o FILE.$form: the server's bytes" cmp "$T/got.$form" "$T/body"
    bcd get "$ID" density --$form
    check "get --$form: the same on stdout" cmp "$T/out" "$T/body"
done
bcd get "$ID" msd -o "$T/absent.csv"
check "get: not asked for: exit status 1" exits 1
check "get: in words" says 'the job did not ask for it'
check "get: and no file is left" sh -c "! ls '$T'/absent*"
ln -s /dev/full "$T/full.csv" 2>/dev/null
bcd get "$ID" density -o "$T/full.csv"
check "get: a full disk: exit status 1" exits 1
check "get: a full disk: the cause" says 'No space left'
check "get: a device is not replaced by a file" [ -c /dev/full ]
bcd get jnone
check "get: no such job: exit status 1" exits 1
check "get: no such job: in words" says 'there is no such job'

# --- list
bcd list
check "list: a head" sh -c "head -n 1 '$T/out' | grep -qE '^ID +STATE +DONE +AGE'"
check "list: parameters that differ" sh -c "head -n 1 '$T/out' | grep -qE ' time +.*seed'"
check "list: a line for each" sh -c "[ \$(wc -l <'$T/out') -eq 4 ]"
check "list: no colours in a file" sh -c "! grep -q '\[' '$T/out'"
bcd list --json
check "list --json: a line of JSON for each" sh -c "[ \$(jq -c .id <'$T/out' | wc -l) -eq 3 ]"
bcd list --json seed=5
check "list: a filter" out '.job.seed == 5'
bcd list --json --limit 1
check "list --limit" sh -c "[ \$(wc -l <'$T/out') -eq 1 ]"
bcd list --columns 'seed,label,derived.method' seed=1
check "list --columns" sh -c "head -n 1 '$T/out' | grep -qE 'AGE +seed +label +derived.method$'"
bcd list frobnicate=1
check "list: an unknown filter: exit status 1" exits 1
check "list: an unknown filter: its name" says 'frobnicate'

# --- estimate, cancel
bcd estimate "$T/long.json"
check "estimate: memory" prints 'memory bytes +[0-9.]+ [kM]?B'
bcd estimate --json "$T/long.json"
check "estimate --json: the server's" out '.memory_bytes > 0'
bcd submit "$T/long.json"
LONG=$(cat "$T/out")
bcd cancel "$LONG"
check "cancel: exit status 0" exits 0
check "cancel: says so" prints "$LONG cancelled"
bcd watch "$LONG"
check "watch: a cancelled job: exit status 1" exits 1
check "watch: a cancelled job: says so" prints "$LONG cancelled"
bcd cancel "$ID"
check "cancel: a job that is done: exit status 1" exits 1
check "cancel: a job that is done: in words" says 'is done already'

# --- watch, while the server goes away and comes back
port=${URL##*:}
bcd submit "$T/medium.json"
MEDIUM=$(cat "$T/out")
: >"$T/watched"
"$B/bcd" watch "$MEDIUM" "$ID" >"$T/watched" 2>"$T/err" &
watch=$!
eventually grep -qE "^$MEDIUM (running [1-9]|done)" "$T/watched"
check "watch: it runs" grep -q "^$MEDIUM running" "$T/watched"
daemon_end KILL
sleep 0.2
LISTEN=127.0.0.1:$port
daemon_start "$T/data" --workers 2
wait $watch
EXIT=$?
check "watch: a restart: exit status 0" exits 0
check "watch: a restart: followed to the end" grep -q "^$MEDIUM done" "$T/watched"
check "watch: one that was done already" grep -q "^$ID done" "$T/watched"
check "watch: plain lines, no escapes" sh -c "! grep -q '$(printf '\033')' '$T/watched'"
bcd watch --json "$MEDIUM" "$ID"
check "watch --json: records" sh -c "[ \$(jq -r .state <'$T/out' | grep -c done) -eq 2 ]"

# --- Ctrl-C
bcd submit --force "$T/long.json"
LONG=$(cat "$T/out")
for signal in INT:130 TERM:143; do
    signalled "${signal%:*}" watch "$LONG"
    check "watch: ${signal%:*}: exit status ${signal#*:}" exits "${signal#*:}"
    check "watch: ${signal%:*}: the job goes on" says 'on the server all goes on'
done

# --- a terminal (script makes one)
if command -v script >/dev/null; then
    terminal() { # ENVIRONMENT COMMAND
        timeout -k 10 "${3:-60}" script -qec "env TERM=xterm $1 $B/bcd $2" /dev/null </dev/null >"$T/tty" 2>&1
    }
    escape=$(printf '\033')
    for seconds in 1 5 30; do # until there was time for a picture
        terminal LC_ALL=C.UTF-8 "watch $LONG" $seconds
        ! grep -q "running" "$T/tty" || break
    done
    check "terminal: a bar" grep -q "$LONG.*running.*░.* %" "$T/tty"
    check "terminal: colours" grep -q "$escape\[36mrunning" "$T/tty"
    terminal "LC_ALL=C NO_COLOR=1" "watch $ID"
    check "terminal: plain signs where there is no UTF-8" grep -q '\[####*\] 100.0 %' "$T/tty"
    check "terminal: NO_COLOR" sh -c "! grep -q '$escape\[3' '$T/tty'"
    terminal LC_ALL=C.UTF-8 "list"
    check "terminal: a coloured list" grep -q "$escape\[32mdone" "$T/tty"
fi
bcd cancel "$LONG"
daemon_end TERM

# --- wrong command lines
usage_error "no job" submit
usage_error "a priority that is none" submit --priority high "$T/job.json"
usage_error "a URL that is none" list --url 127.0.0.1:8080
usage_error "a URL with a password" list --url http://me:secret@127.0.0.1:8080
check "usage: the password is not told again" sh -c "! grep -q secret '$T/err'"
usage_error "a URL that is a file" list --url file:///etc/passwd
usage_error "a time-out that is none" list --timeout 0
usage_error "forms that exclude one another" get jx msd --csv --svg
usage_error "an id that is none" get ../../etc
usage_error "an observable that is none" get jx ../msd
usage_error "a filter that is none" list diameter
usage_error "a state that is none" list --state frozen
usage_error "watching nothing" watch
usage_error "exporting nothing" export sx
printf 'bcd_secret\n' >"$T/token"
chmod 644 "$T/token"
usage_error "a token file that others may read" list --token-file "$T/token"
check "usage: why" says 'others than its owner may read it'
usage_error "a token file that is not there" list --token-file "$T/absent"
chmod 600 "$T/token"
: >"$T/empty"
chmod 600 "$T/empty"
usage_error "a token file that is empty" list --token-file "$T/empty"

finish
