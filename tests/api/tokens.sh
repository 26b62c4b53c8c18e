#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Tokens as an operator meets them: bcdd token, addresses that others can reach, names of the server.
# Waits: for a token to expire.
. "$(dirname "$0")/_lib.sh"

token() { # the options of bcdd token; sets EXIT, $T/out and $T/err
    "$B/bcdd" token "$@" >"$T/out" 2>"$T/err"
    EXIT=$?
}
with() { # TOKEN METHOD PATH [curl ...]
    bearer=$1
    shift
    ask "$@" -H "Authorization: Bearer $bearer"
}

# ---- without a daemon
token list --data "$T/none"
check "a list of nothing is a mistake" test "$EXIT" = 1 -a ! -e "$T/none"
for words in "" "make" "create --data $T/d" "create --data $T/d --owner Anna --role admin" \
    "create --data $T/d --owner anna --role root" "revoke --data $T/d" "list" \
    "create --data $T/d --owner anna --role admin --expires 0" "list --data $T/d --turbo"; do
    # shellcheck disable=SC2086
    token $words
    check "token $words: exit 2, in words" test "$EXIT" = 2 -a -s "$T/err" -a ! -s "$T/out"
done
token --help
check "token --help" grep -q "bcdd token create --data DIR" "$T/out"
token create --data "$T/d" --owner anna --role submitter
check "the first token must be an admin's" test "$EXIT" = 1
token create --data "$T/d" --owner root --role admin --name 'the first' --expires 30
admin=$(cat "$T/out")
check "a token is one line on stdout" \
    sh -c "printf %s '$admin' | grep -qxE 'bcd_[a-z2-7]{52}'"
token create --data "$T/d" --owner anna --role reader
reader=$(cat "$T/out")
token list --data "$T/d"
check "the list has both" test "$(grep -c -E '^t[a-z2-7]+ +(root|anna) +(admin|reader) ' "$T/out")" = 2
check "and no secrets" sh -c "! grep -q bcd_ '$T/out'"
check "nor has the database" sh -c "! grep -q -e '$admin' -e '$reader' $T/d/bcd.sqlite*"

# ---- a daemon
daemon_start "$T/d" --workers 1 --host-name bcd.lab.example
token create --data "$T/d" --owner x --role admin
check "while it runs, it has to be asked" grep -q "POST /v1/tokens" "$T/err"
ask GET /v1/jobs
check "nobody comes in without" status_is 401
check "and is told how" header_is WWW-Authenticate 'Bearer realm="bcdd"'
ask GET /healthz
check "but for the state of its health" status_is 200
with "$admin" GET /v1/me
check "the admin does" holds '.owner == "root" and .role == "admin" and .token'
with "$reader" POST /v1/jobs -d '{}'
check "a reader submits nothing" status_is 403
with "$admin" POST /v1/tokens -d '{"owner": "bert", "role": "submitter", "expires_in": 4}'
bert=$(jq -r .token "$T/body")
with "$bert" GET /v1/me
check "a token made over HTTP opens at once" status_is 200
curl -sSN -m 60 -o "$T/stream" -H "Authorization: Bearer $bert" "$URL/v1/events" &
STREAM=$!
ask GET /healthz -H "Host: evil.example"
check "other names are refused" status_is 421
ask GET /healthz -H "Host: bcd.lab.example:443"
check "its own is not" status_is 200
wait "$STREAM"
check "a stream that it opened has ended by itself, with the reason" \
    test "$? $(grep -c '^event: end' "$T/stream") $(grep -c 'the token has expired' "$T/stream")" = "0 1 1"
with "$bert" GET /v1/me
check "and closes when it expires" status_is 401
with "$admin" DELETE "/v1/tokens/$bert"
check "a token is not called by its secret" status_is 404
with "$admin" GET '/v1/audit?action=token.create'
check "the audit log knows" holds '.entries | length == 3'
daemon_end TERM
check "no token is in the log" sh -c "! grep -q -e '$admin' -e '$reader' -e '$bert' '$T/stderr'"
check "nor what is refused for being none" sh -c "! grep -q bcd_[a-z] '$T/stderr'"

# ---- an address that others can reach. This machine has it not, so nothing ever listens there.
elsewhere() {
    timeout 60 "$B/bcdd" --listen 192.0.2.1:0 --data "$T/d" >"$T/out" 2>"$T/err"
    EXIT=$?
}
token list --data "$T/d"
ids=$(sed -n 's/^\(t[a-z2-7]*\) *root .*/\1/p' "$T/out")
elsewhere
check "with an admin's token it would" grep -q "cannot listen on 192.0.2.1" "$T/err"
for id in $ids; do
    token revoke --data "$T/d" "$id"
done
check "revoked" grep -q "is revoked" "$T/out"
elsewhere
check "without one it does not even try" \
    test "$EXIT" = 1 -a ! -s "$T/out" -a "$(grep -c 'bcdd token create' "$T/err")" = 1
daemon_start "$T/d" --workers 1
with "$admin" GET /v1/me
check "a revoked token opens nothing" status_is 401
ask GET /v1/me
check "nor is loopback open again" status_is 401
daemon_end TERM
daemon_start "$T/d" --workers 1 --auth open
ask GET /v1/me
check "unless it is told to be" status_is 200
daemon_end TERM
finish
