#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Every endpoint of a job's life: submit, look, list, filter, cancel, results in all forms.
. "$(dirname "$0")/_lib.sh"
daemon_start "$T/data" --workers 2

small() { # a job of the 2022 paper's kind; $1 = further members
    printf '{"particles":20,"length":40,"diameter":0.5,"time":2,"time_step":0.001,%s' "$1"
    printf '"potential":{"type":"cosine","amplitude":6},"observables":{"msd":{"first":0.01,"last":1,'
    printf '"points":10},"density":{"bins":25},"contact_density":{"bins":10},"current":{},'
    printf '"energy":{},"cluster_sizes":{}}}'
}
long='{"particles":100,"length":400,"time":100000,"time_step":0.001,"observables":{"energy":{}}}'

# ---- submit
post_text "$(small '')"
first=$ID
check "a job is accepted" status_is 202
check "as JSON" type_is application/json
check "with its place" header_is Location "/v1/jobs/$first"
check "and a record" holds --arg id "$first" '
    .id == $id and ($id | test("^[a-z0-9-]+$")) and (.state == "queued" or .state == "running")
    and .progress >= 0 and .progress <= 1 and .error == null and .deduplicated == false
    and (.submitted_at | test("^[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}\\.[0-9]{3}Z$"))
    and .finished_at == null
    and .links == {"self": "/v1/jobs/\($id)", "results": "/v1/jobs/\($id)/results",
                   "events": "/v1/jobs/\($id)/events"}'
check "whose job is completed with defaults" holds '
    .job.model == "hard_rods" and .job.particles == 20 and .job.mobility == 1
    and .job.temperature == 1 and .job.boundary == "periodic" and .job.seed == 1
    and .job.potential == {"type":"cosine","amplitude":6,"wavelength":1,"phase":0,"velocity":0}
    and (.job.observables | keys) == ["cluster_sizes","contact_density","current","density",
                                      "energy","msd"]'
check "and tells what was derived" holds '
    .derived.diffusion == 1 and .derived.time_step == 0.001 and .derived.method == "strang"
    and .derived.steps == 2000'
check "it runs to its end" until_state "$first" done
ask GET "/v1/jobs/$first"
check "its record is there" status_is 200
check "and complete" holds '
    .state == "done" and .progress == 1 and .error == null
    and .submitted_at <= .started_at and .started_at <= .finished_at
    and (has("deduplicated") | not)'

# ---- the same job again, written otherwise
printf '%s' "$(small '"mobility":1.0, "seed": 1, ')" | jq -S . >"$T/other"
post "$T/other"
check "the same job again is 200" status_is 200
check "and the job that stands" test "$ID" = "$first"
check "and says so" holds '.deduplicated == true and .state == "done"'
post_text "$(small '"seed":2,')"
check "another seed is another job" test "$STATUS" = 202 -a "$ID" != "$first"
second=$ID
ask POST /v1/jobs -H 'Idempotency-Key: key-1' -d "$(small '"seed":3,')"
check "an idempotency key passes" status_is 202
ask POST /v1/jobs -H 'Idempotency-Key: key-1' -d "$(small '"seed":3,')"
check "and again" status_is 200
ask POST /v1/jobs -H 'Idempotency-Key: key-1' -d "$(small '"seed":4,')"
check "but not with another job" test "$STATUS $TYPE" = "422 application/problem+json"
for i in 1 2 3 4 5 6 7 8; do
    curl -sS -o "$T/par.$i" -w '%{http_code}\n' -d "$(small '"seed":77,')" "$URL/v1/jobs" \
        >"$T/code.$i" &
    eval "par$i=$!"
done
wait "$par1" "$par2" "$par3" "$par4" "$par5" "$par6" "$par7" "$par8"
check "eight at once make one job" test "$(jq -r .id "$T"/par.* | sort -u | wc -l)" = 1
check "of which one is new" test "$(sort "$T"/code.* | uniq -c | tr -s ' \n' ' ')" = " 7 200 1 202 "

# ---- results
check "the second is done" until_state "$second" done
ask GET "/v1/jobs/$first/results"
cp "$T/body" "$T/all"
check "results are there" test "$STATUS $TYPE" = "200 application/json"
check "of what was asked for, no more" holds '
    keys == ["cluster_sizes","contact_density","current","density","energy","msd"]'
check "lists are of one length, in the contract's names" holds '
    def same(names): [.[names[]] | length] | unique | length == 1;
    (.msd | same(["lag","msd","stderr","samples"]))
    and (.density | same(["x","density","stderr"])) and (.density.x | length) == 25
    and (.contact_density | same(["x","contact_density","stderr"]))
    and (.cluster_sizes | same(["size","fraction","stderr"]))
    and (.current.current | type) == "number" and (.energy.energy | type) == "number"
    and (.current | has("stderr")) and (.energy | has("stderr") and has("theory"))'
check "the density's mean is N/L" holds '
    (.density.density | add / length - 0.5 | fabs) < 1e-9'
for name in msd density contact_density current energy cluster_sizes; do
    ask GET "/v1/jobs/$first/results/$name"
    check "$name alone is the same as in all" test "$(jq -cS . "$T/body")" = \
        "$(jq -cS ".$name" "$T/all")"
    ask GET "/v1/jobs/$first/results/$name.csv"
    check "$name.csv is CSV" test "$STATUS $TYPE" = "200 text/csv; charset=utf-8; header=present"
    check "$name.csv has rows as long as its header" awk -F, '
        NR == 1 { n = NF } NF != n { bad = 1 } END { exit NR < 2 || bad }' "$T/body"
    ask GET "/v1/jobs/$first/results/$name.svg"
    check "$name.svg is a picture" test "$STATUS $TYPE" = "200 image/svg+xml"
    check "$name.svg is closed" grep -q '</svg>' "$T/body"
done
ask GET "/v1/jobs/$first/results/msd.csv"
check "CSV and JSON hold the same numbers" test \
    "$(sed 1d "$T/body" | cut -d , -f 2)" = "$(jq -r '.msd.msd[]' "$T/all")"
check "results may be kept" header_is Cache-Control "private, max-age=86400, immutable"
ask GET "/v1/jobs/$first/results/trajectory"
check "what was not asked for is 404" test "$STATUS $TYPE" = "404 application/problem+json"
ask GET /v1/jobs/nosuchjob/results
check "results of no job are 404" status_is 404

# ---- list
ask GET /v1/jobs
check "the list is newest first" holds --arg a "$first" --arg b "$second" '
    .next == null and (.jobs | length) == 4 and .jobs[3].id == $a and .jobs[2].id == $b
    and (.jobs[0].job.seed == 77)'
ask GET '/v1/jobs?limit=3'
next=$(jq -r .next "$T/body")
check "a page has its limit" holds '(.jobs | length) == 3 and (.next | type) == "string"'
ask GET "/v1/jobs?limit=3&cursor=$next"
check "and the next page the rest" holds --arg a "$first" '[.jobs[].id] == [$a] and .next == null'
ask GET '/v1/jobs?seed=2&potential.amplitude=6.0'
check "filters find by parameters" holds --arg b "$second" '[.jobs[].id] == [$b]'
ask GET '/v1/jobs?potential.amplitude=7'
check "and find nothing" body_is '{"jobs":[],"next":null}'

ask GET '/v1/jobs?results.energy.energy>=-1e3&sort=-results.energy.energy&state=done'
check "results are found and sorted by" holds '
    (.jobs | length) >= 2 and ([.jobs[].state] | unique) == ["done"]'
sorted=$(for id in $(jq -r '.jobs[].id' "$T/body"); do
    curl -sS "$URL/v1/jobs/$id/results/energy" | jq .energy
done | jq -s '. == (sort | reverse)')
check "from the largest down" test "$sorted" = true
ask GET '/v1/jobs?sort=seed&limit=2&derived.steps=2000'
seeds=$(jq -c '[.jobs[].job.seed]' "$T/body")
ask GET "/v1/jobs?sort=seed&limit=2&derived.steps=2000&cursor=$(jq -r .next "$T/body")"
check "pages of a sort follow one another" test "$seeds $(jq -c '[.jobs[].job.seed]' "$T/body")" = \
    "[1,2] [3,77]"
ask GET '/v1/jobs?results.energy.energi=1'
check "a misspelt result is told, with the right one" holds '
    .status == 400 and (.errors[0].detail | contains("results.energy.energy"))'

# ---- cancel
post_text "$long"
check "a long job runs" until_state "$ID" running
ask GET "/v1/jobs/$ID/results"
check "it has no results yet" test "$STATUS $TYPE" = "409 application/problem+json"
p1=$(curl -sS "$URL/v1/jobs/$ID" | jq .progress)
goes_on() {
    p2=$(curl -sS "$URL/v1/jobs/$ID" | jq .progress)
    jq -ne "$p1 < $p2 and $p2 < 1" >"$T/said"
}
check "its progress is live" eventually goes_on
ask GET '/v1/jobs?state=running'
check "the list of running jobs has it, progress too" holds --arg id "$ID" --argjson p "$p2" '
    ([.jobs[].state] | unique) == ["running"]
    and (.jobs[] | select(.id == $id) | .progress >= $p)'
ask DELETE "/v1/jobs/$ID"
check "it is cancelled" status_is 200
check "and says so" holds '.state == "cancelled" and .finished_at != null'
ask DELETE "/v1/jobs/$ID"
check "cancelling again changes nothing" test "$STATUS" = 200
ask GET "/v1/jobs/$ID/results"
check "it has no results" status_is 409
cancelled=$ID
post_text "$long"
check "but may be submitted again" test "$STATUS" = 202 -a "$ID" != "$cancelled"
check "and runs" until_state "$ID" running
ask DELETE "/v1/jobs/$ID"
ask DELETE "/v1/jobs/$first"
check "a finished job cannot be cancelled" test "$STATUS $TYPE" = "409 application/problem+json"
post_text "$(small '"seed":5,')"
check "workers are free after that" until_state "$ID" done

# ---- the rest
ask POST /v1/estimate -d "$(small '')"
check "an estimate tells the cost" holds '
    .steps == 2500 and .rod_steps == 50000 and .core_seconds > 0 and .memory_bytes > 0
    and .result_bytes > 0'
ask GET /healthz
check "healthz" test "$STATUS $(cat "$T/body")" = '200 {"status":"ok"}'
ask GET /readyz
check "readyz" status_is 200
ask GET /openapi.json
check "all requests are described" holds '.paths | has("/v1/jobs/{id}/results/{name}.csv")'
curl -sSI "$URL/v1/jobs/$first/results" | tr -d '\r' >"$T/body"
check "HEAD works like GET" grep -qx "Content-Length: $(wc -c <"$T/all")" "$T/body"
for header in "X-Content-Type-Options: nosniff" "Referrer-Policy: no-referrer" \
    "Content-Security-Policy: default-src 'none'; frame-ancestors 'none'"; do
    check "every answer has $header" grep -qx "$header" "$T/body"
done
finish
