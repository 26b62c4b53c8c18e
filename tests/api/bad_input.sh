#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Everything that can be wrong with a request: status, type, and the pointer to each fault. After all
# of it the server still takes a job.
. "$(dirname "$0")/_lib.sh"
daemon_start "$T/data" --workers 1

job() { # a sound job with $1 put before its members
    printf '{%s"particles":5,"length":10,"diameter":0.5,"time":1,"time_step":0.01,' "$1"
    printf '"observables":{"energy":{}}}'
}
problem() { # is the last answer a problem with this status?
    [ "$STATUS $TYPE" = "$1 application/problem+json" ] &&
        jq -e --argjson s "$1" '.status == $s and (.type | type) == "string" and
            (.title | length) > 0 and (.detail | length) > 0' "$T/body"
}
refuse() { # TEXT STATUS POINTERS-as-JSON-list BODY
    printf '%s' "$4" >"$T/job"
    refuse_file "$1" "$2" "$3" "$T/job"
}
refuse_file() {
    post "$4"
    check "$1: $2" problem "$2"
    check "$1: at $3" holds --argjson p "$3" '[.errors[].pointer] | sort == ($p | sort)'
}

# ---- jobs
refuse "unknown key" 422 '["/temprature"]' "$(job '"temprature":1,')"
refuse "unknown key inside" 422 '["/potential/hight"]' \
    "$(job '"potential":{"type":"cosine","amplitude":1,"hight":2},')"
refuse "key with / and ~" 422 '["/a~1b~0c"]' "$(job '"a/b~c":1,')"
refuse "wrong type" 422 '["/mobility","/seed"]' "$(job '"mobility":"fast","seed":[1],')"
refuse "boolean for a number" 422 '["/force"]' "$(job '"force":true,')"
refuse "object for a number" 422 '["/force"]' "$(job '"force":{},')"
refuse "null for a number" 422 '["/force"]' "$(job '"force":null,')"
refuse "text for an object" 422 '["/potential"]' "$(job '"potential":"cosine",')"
refuse "fraction for an integer" 422 '["/realizations"]' "$(job '"realizations":1.5,')"
refuse "NaN" 422 '["/force"]' "$(job '"force":NaN,')"
refuse "Infinity" 422 '["/force"]' "$(job '"force":-Infinity,')"
refuse "1e400" 422 '["/force"]' "$(job '"force":1e400,')"
refuse "1e-400, which would silently become 0" 422 '["/force"]' "$(job '"force":1e-400,')"
refuse "an integer beyond 64 bits" 422 '["/seed"]' "$(job '"seed":99999999999999999999999,')"
refuse "duplicate key" 422 '["/force"]' "$(job '"force":1,"force":2,')"
refuse "duplicate key inside" 422 '["/potential/amplitude"]' \
    "$(job '"potential":{"type":"cosine","amplitude":1,"amplitude":1},')"
refuse "unknown choice" 422 '["/boundary"]' "$(job '"boundary":"open",')"
refuse "unknown potential" 422 '["/potential/type"]' "$(job '"potential":{"type":"cosin"},')"
refuse "unknown method" 422 '["/method"]' "$(job '"method":"magic",')"
refuse "N sigma > L" 422 '["/diameter"]' '{"particles":10,"length":4.9,"diameter":0.5,"time":1,
    "time_step":0.01,"observables":{"energy":{}}}'
refuse "negative sizes, all at once" 422 '["/diameter","/length","/particles","/time"]' \
    '{"particles":-5,"length":-10,"diameter":-0.5,"time":-1,"time_step":0.01,
    "observables":{"energy":{}}}'
refuse "zero of everything" 422 '["/length","/mobility","/particles","/time","/time_step"]' \
    '{"particles":0,"length":0,"mobility":0,"time":0,"time_step":0,"observables":{"energy":{}}}'
refuse "nothing" 422 '["/length","/observables","/particles","/time"]' '{}'
refuse "unknown observable" 422 '["/observables/mds"]' \
    '{"particles":5,"length":10,"time":1,"time_step":0.01,"observables":{"mds":{},"energy":{}}}'
refuse "N of 10^12" 422 '["/particles"]' '{"particles":1000000000000,"length":1e10,"time":1,
    "observables":{"energy":{}}}'
refuse "10^9 lags" 422 '["/observables/msd/points"]' '{"particles":5,"length":10,"time":1,
    "observables":{"msd":{"first":0.1,"last":1,"points":1000000000}}}'
refuse "a year of a core exceeded" 422 '[""]' '{"particles":1000,"length":2000,"time":1e9,
    "time_step":1e-6,"observables":{"energy":{}}}'
check "the answer carries limit and estimate" holds '
    (.errors[0].detail | test("LIMIT_CORE_SECONDS_MAX")) and .estimate.core_seconds > 3.2e7'
refuse "a list" 422 '[""]' '[]'
refuse "a number" 422 '[""]' '5'

# ---- bodies
refuse "not JSON" 400 '[""]' 'particles=5&length=10'
refuse "an empty body" 400 '[""]' ''
refuse "two jobs in a row" 400 '[""]' "$(job '')$(job '')"
refuse "a comma too many" 400 '[""]' '{"particles":5,}'
printf '{"particles":5,"le\0ngth":10}' >"$T/nul"
refuse_file "an embedded NUL" 400 '[""]' "$T/nul"
{
    job ''
    printf '\0'
} >"$T/nul"
refuse_file "a NUL at the end" 400 '[""]' "$T/nul"
printf '{"\377\376":5}' >"$T/utf8"
refuse_file "invalid UTF-8" 400 '[""]' "$T/utf8"
awk 'BEGIN { for (i = 0; i < 500000; i++) printf "["; for (i = 0; i < 500000; i++) printf "]" }' \
    >"$T/deep"
refuse_file "deep nesting" 422 '[""]' "$T/deep"
awk 'BEGIN { printf "{\"a\":"; for (i = 0; i < 17; i++) printf "["
             for (i = 0; i < 17; i++) printf "]"; printf "}" }' >"$T/deep"
refuse_file "nesting just above the limit" 422 '[""]' "$T/deep"
awk 'BEGIN { printf "{"; for (i = 0; i < 5000; i++) printf "\"k%d\":1,", i; printf "\"x\":1}" }' \
    >"$T/many"
post "$T/many"
check "thousands of faults: 422" problem 422
check "of which the first are told and all are counted" holds '
    (.errors | length) == 32 and (.detail | test("^50[0-9][0-9] faults"))'
head -c 1048577 /dev/zero | tr '\0' ' ' >"$T/big"
post "$T/big"
check "a body of 1 MiB and one byte: 413" problem 413
ask POST /v1/jobs -H 'Transfer-Encoding: chunked' --data-binary "@$T/big"
check "the same in chunks: 413" problem 413
job '' >"$T/padded"
head -c $((1048576 - $(wc -c <"$T/padded"))) /dev/zero | tr '\0' ' ' >>"$T/padded"
post "$T/padded"
check "a job padded to exactly 1 MiB is taken" status_is 202
ask POST /v1/jobs -H 'Content-Type: text/plain' -d "$(job '')"
check "another content type: 415" problem 415
ask POST /v1/jobs -H 'Content-Type: application/json; charset=utf-8' -d "$(job '')"
check "JSON with a charset is fine" status_is 200
ask POST /v1/jobs -H "Idempotency-Key: $(printf %0256d 0)" -d "$(job '')"
check "too long an idempotency key: 400" problem 400
ask POST /v1/estimate -d '{"particles":0}'
check "an estimate of a faulty job: 422" problem 422
check "with its pointers" holds '[.errors[].pointer] | index("/particles")'

# ---- addresses
for query in limit=0 limit=-1 limit=1001 limit=99999999999999999999 limit=ten limit= cursor=abc \
    cursor=-1 cursor=0 'cursor=1%27' state=sleeping diametr=1 potential.amplitud=6 \
    'limit=1&limit=2'; do
    ask GET "/v1/jobs?$query"
    check "?$query: 400" problem 400
    check "?$query is named" holds --arg p "${query%%=*}" '.errors[0].parameter == $p'
done
for query in 'state=%' 'state=%zz' 'state=%00' 'state=%ff'; do
    ask GET "/v1/jobs?$query"
    check "?$query: 400" problem 400
done
ask GET '/healthz?verbose=1'
check "a parameter where none belongs: 400" problem 400
for path in /v1/jobs/UPPER /v1/jobs/.. /v1/jobs/%2e%2e /v1/jobs/../../etc/passwd /v1/jobs/a%00 \
    /v1/jobs/nosuchjob /v1/jobs/ /v2 /v1/jobs/x/results/../.. \
    "/v1/jobs/$(printf %0500d 0)" /v1/jobs/nosuchjob/results/msd.csv; do
    ask GET "$path" --path-as-is
    check "GET $(printf %.40s "$path"): 404" problem 404
done
ask DELETE /v1/jobs/nosuchjob
check "DELETE of no job: 404" problem 404
ask PUT /v1/jobs -d '{}'
check "PUT /v1/jobs: 405" problem 405
check "with what is allowed" header_is Allow "POST, GET, HEAD"
ask DELETE /healthz
check "DELETE /healthz: 405" problem 405
ask BREW /v1/jobs
check "a method of no kind: 405" problem 405
ask GET "/$(head -c 40000 /dev/zero | tr '\0' a)"
check "a path of 40 kB: 414" status_is 414
ask GET /healthz -H 'Host: evil.example'
check "another host's name: 421" problem 421
ask POST /v1/jobs -H 'Origin: http://evil.example' -d "$(job '')"
check "a page of another origin: 403" problem 403

# ---- and it goes on
post_text "$(job '"seed":9,')"
check "after all this a job is taken" status_is 202
check "and done" until_state "$ID" done
ask GET /v1/jobs
check "nothing else got in" holds '(.jobs | length) == 2'
daemon_end TERM
check "and the end is clean" test "$EXIT" = 0
finish
