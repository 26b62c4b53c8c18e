#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# bcd against a server with tokens: who may, who may not, and that no token is ever shown again.
. tests/api/_lib.sh
. tests/api/_client.sh

ADMIN=$("$B/bcdd" token create --data "$T/data" --owner root --role admin 2>/dev/null)
check "the first token comes from bcdd" [ "${#ADMIN}" -gt 20 ]
daemon_start "$T/data" --workers 1
BCD_URL=$URL
export BCD_URL

bcd list
check "no token: exit status 4" exits 4
check "no token: where they come from" says 'BCD_TOKEN or --token-file'
BCD_TOKEN=bcd_wrong
export BCD_TOKEN
bcd list
check "a wrong token: exit status 4" exits 4
BCD_TOKEN="$(printf 'x\r\nX-Evil: 1')"
bcd list
check "a token that would be a header: exit status 2" exits 2
BCD_TOKEN=$ADMIN
bcd whoami
check "whoami" prints "root, admin, at $URL"
check "whoami: quotas" prints 'queued points: 0 of .*'
bcd token list
check "token list: the first one" prints '.*root +admin.*'

bcd token create ann --role reader --name 'a b' --expires 30d -o "$T/ann"
check "token create -o: exit status 0" exits 0
check "token create -o: nobody else may read it" \
    sh -c "[ \"\$(stat -c %a '$T/ann')\" = 600 ] && [ \$(wc -l <'$T/ann') -eq 1 ]"
bcd token create ann -o "$T/ann"
check "token create -o: no file is overwritten" exits 1
"$B/bcd" token create bob --expires 90min >"$T/bob" 2>"$T/err"
check "token create: the token alone on stdout" grep -qxE 'bcd_[a-z0-9]+' "$T/bob"
check "token create: it ends when asked to" \
    sh -c "'$B/bcd' token list --json | jq -e '[.tokens[] | select(.owner == \"bob\")][0] |
           (.expires_at | sub(\"[.].*\"; \"Z\") | fromdate) -
           (.created_at | sub(\"[.].*\"; \"Z\") | fromdate) | . >= 5399 and . <= 5401'"
chmod 600 "$T/bob"

printf '%s' '{"particles":4,"length":8,"time":1e6,"time_step":1e-3,"method":"bcd","observables":{"energy":{}},
"potential":{"type":"cosine","amplitude":1}}' >"$T/job.json"
unset BCD_TOKEN
bcd whoami --token-file "$T/ann"
check "--token-file: is who it says" prints 'ann, reader.*'
bcd submit --token-file "$T/ann" "$T/job.json"
check "a reader may not submit: exit status 4" exits 4
check "a reader may not submit: in words" says 'submitter'
bcd submit --token-file "$T/bob" "$T/job.json"
check "a submitter may" exits 0
JOB=$(cat "$T/out")
bcd get --token-file "$T/bob" "$JOB"
check "it is his" prints 'owner +bob'
bcd list --token-file "$T/ann" --owner bob
check "others may see it" prints "$JOB.*"
bcd cancel --token-file "$T/ann" "$JOB"
check "but not cancel it" exits 4
bcd cancel --token-file "$T/bob" "$JOB"
check "he may" exits 0
bcd token list --token-file "$T/bob"
check "tokens are for admins" exits 4

BCD_TOKEN=$ADMIN
export BCD_TOKEN
ANN=$("$B/bcd" token list --json | jq -r '[.tokens[] | select(.owner == "ann")][0].id')
bcd token revoke "$ANN"
check "token revoke" prints "$ANN revoked.*"
bcd list --token-file "$T/ann"
check "a revoked token: exit status 4" exits 4
bcd token revoke tnone
check "token revoke: there is none: exit status 1" exits 1
bcd token revoke ../jobs
check "token revoke: no id: exit status 2" exits 2
bcd token create ann --role king
check "token create: no such role: exit status 2" exits 2
bcd token create ann --expires soon
check "token create: no such time: exit status 2" exits 2
bcd token create 'no body'
check "token create: no such owner: exit status 1" exits 1
bcd token
check "token alone: exit status 2" exits 2

# ---- owners, quotas, audit
bcd owners
check "owners: a table" prints 'bob +0 +1000000 .*'
bcd owners --json
check "owners --json: what the server says" out '.owners[0] | .owner == "bob" and .quotas.queued_points.default'
bcd quota bob --queued-points 5
check "quota: is changed" prints 'bob +0 +5 .*'
bcd quota bob --stored-bytes 1e10 --json
check "quota: what is not named stays" out '.quotas | .queued_points.limit == 5 and .stored_bytes.limit == 1e10
    and (.queued_points.default | not) and .core_seconds_per_day.default'
bcd quota bob --queued-points default --json
check "quota: back to everybody's" out '.quotas | .queued_points.limit == 1000000 and .queued_points.default
    and (.stored_bytes.default | not)'
bcd quota carol --core-seconds-per-day 0.5
check "quota: of somebody new" prints 'carol .* 0\.5 .*'
bcd quota bob
check "quota: shown" prints 'bob .* 10 GB'
bcd quota nobody
check "quota: of nobody: exit status 1" exits 1
bcd quota bob --token-file "$T/bob"
check "quota: for admins" exits 4
bcd owners --token-file "$T/bob"
check "owners: for admins" exits 4
for wrong in '--queued-points 1.5' '--queued-points -1' '--queued-points nan' '--stored-bytes 1e16' \
    '--stored-bytes many' '--core-seconds-per-day 0x1'; do
    # shellcheck disable=SC2086
    usage_error "quota bob $wrong" quota bob $wrong
done
usage_error "quota Bob" quota Bob
bcd audit
check "audit: a table, newest first" sh -c "sed -n 2p '$T/out' | grep -qE '^20[0-9-]+ [0-9:]+ +root +owner.quota +carol +'"
bcd audit --action job.cancel --json
check "audit --json: a line for each" out --arg id "$JOB" \
    '.owner == "bob" and .action == "job.cancel" and .object == $id'
bcd audit --all --json
check "audit --all" sh -c "[ \$(wc -l <'$T/out') -ge 8 ]"
bcd audit --limit 2 --json
check "audit --limit" sh -c "[ \$(wc -l <'$T/out') -eq 2 ]"
bcd audit --action job.eat
check "audit: no such action: exit status 2" exits 2
bcd audit --owner 'no body'
check "audit: no such owner: exit status 1" exits 1
bcd audit --token-file "$T/bob"
check "audit: for admins" exits 4
check "no token was told to a terminal or a log" \
    sh -c "! grep -F -e '$ADMIN' -e \"\$(cat '$T/bob')\" -e \"\$(cat '$T/ann')\" '$T/all' '$T/stderr'"
daemon_end TERM
finish
