#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Error against run time: the service measures it once, on request, and keeps it; it gets out of the
# way when the daemon ends. And the same on the command line.
. tests/api/_lib.sh
WORK=/v1/reports/work-precision
STABILITY=/v1/reports/stability

until_measured() {
    end=$(($(date +%s) + 240))
    while ask GET $WORK && [ "$STATUS" = 202 ]; do
        [ "$(date +%s)" -lt "$end" ] || return 1
        sleep 0.05
    done
    [ "$STATUS" = 200 ]
}
# What a work-precision report is, whatever was measured (contract, section 3).
shape='(.machine | type) == "object" and (.scenes | length) > 0 and all(.scenes[];
    (.name | type) == "string" and .job.particles > 0 and .job.realizations > 0 and
    .job.time_step > 0 and .job.time > .job.time_step and (.entries | length) > 0 and
    all(.order[]; . == null or . > 0) and
    all(.orders[][]; (.order > 0 and .stderr <= .order) or (.order == null and (.reason | length) > 9)) and
    (.order | type) == "object" and (.cost_at_tolerance | type) == "object" and
    all(.entries[]; (.method | type) == "string" and .time_step > 0 and .cost > 0 and
        ([.energy_error, .density_l1, .contact_error, .stderr.energy_error, .stderr.density_l1,
          .stderr.contact_error] | all(type == "number")) and
        (.drift_error != null or (.drift_error_reason | length) > 0)) and
    ((.order | keys) == ([.entries[].method] | unique)) and
    ((.cost_at_tolerance | keys) == (.order | keys)))'

# all_valid FILE: every scene's job is one that is accepted.
all_valid() {
    scenes=$(jq '.scenes | length' "$1")
    [ "$scenes" -gt 0 ] || return 1
    while [ "$scenes" -gt 0 ]; do
        scenes=$((scenes - 1))
        jq ".scenes[$scenes].job" "$1" >"$T/job"
        "$B/bcd" check "$T/job" >"$T/checked" 2>&1 || return 1
        [ "$(jq .job.time "$T/checked")" = "$(jq .time "$T/job")" ] || return 1
    done
}

daemon_start "$T/data" --workers 1
ask HEAD $WORK --head
check "a look at its head finds no report" status_is 404
ask DELETE $WORK
check "nor starts a measurement" test "$STATUS $TYPE" = "409 application/problem+json"
check "there is none to stop" holds '.title | contains("report")'
ask GET $WORK
check "the first request starts a measurement" test "$STATUS $TYPE" = "202 application/json"
check "and says so" holds '.state == "measuring" and .progress >= 0 and .progress <= 1'
check "with the time to come again" header_is Retry-After 1
ask GET $WORK.svg
check "nor is there a picture yet" status_is 202
ask POST $WORK
check "a second measurement has to wait" test "$STATUS $TYPE" = "409 application/problem+json"
check "for the report's state" holds '.title | contains("report")'
ask DELETE $WORK
check "it is told to stop" test "$STATUS $TYPE" = "200 application/json"
check "and does" holds '.state == "stopping" and .progress >= 0'
end=$(($(date +%s) + 60))
while ask DELETE $WORK && [ "$STATUS" = 200 ] && [ "$(date +%s)" -lt "$end" ]; do
    sleep 0.05
done
check "soon" status_is 409
posts=
for i in 1 2 3 4; do
    curl -s -o "$T/post$i" -w '%{http_code}\n' -X POST "$URL$WORK" >"$T/status$i" &
    posts="$posts $!"
done
wait $posts
check "of measurements asked for together one begins" test \
    "$(sort "$T"/status[1-4] | tr '\n' ' ')" = "202 409 409 409 "
before=$(date +%s)
daemon_end TERM
check "the daemon ends in the midst of it" test "$EXIT" = 0
# By itself a measurement lasts a minute or more.
check "at once" test $(($(date +%s) - before)) -lt 20

daemon_start "$T/data" --workers 1
ask POST "$WORK?budget=0"
check "no budget" test "$STATUS $TYPE" = "400 application/problem+json"
ask POST "$WORK?budget=nan"
check "a budget that is no number" status_is 400
ask POST "$WORK?budget=0.009"
check "too small a budget" status_is 400
ask POST "$WORK?scene=sparse"
check "a part of the report" status_is 400
ask POST "$WORK?speed=1"
check "no such parameter" status_is 400
ask GET "$WORK?budget=1"
check "nor does reading take any" status_is 400
ask POST "$STABILITY?budget=1"
check "stability has no budget" status_is 400
ask HEAD $STABILITY --head
check "nor a report unasked" status_is 404
ask GET /v1/reports
check "the list of reports says so" holds '[.reports[] | [.name, .measured_at, .state, .progress]] ==
    [["work-precision", null, "idle", null], ["stability", null, "idle", null]]'
ask GET $STABILITY.csv
check "asked for it is measured" test "$STATUS $TYPE" = "202 application/json"
ask GET /v1/reports
check "which the list tells" holds '.reports[1] | .state == "measuring" and .progress >= 0 and .measured_at == null'
ask GET $WORK
check "and nothing else meanwhile" test "$STATUS $TYPE" = "409 application/problem+json"
ask DELETE $WORK
check "the other one cannot be stopped" status_is 409
end=$(($(date +%s) + 60))
while ask GET $STABILITY && ! holds '.entries | length >= 2' >/dev/null && [ "$(date +%s)" -lt "$end" ]; do
    sleep 0.1
done
check "what is found is told at once" holds '.state == "measuring" and .progress > 0 and
    (.entries | length) >= 2 and all(.entries[]; .extreme == "U0 = 100" and .job.particles == 8 and
        (.failed | not) and (.verdict == "refused") == (.off == null and (.reason | length) > 9))'
ask DELETE $STABILITY
check "it is told to stop" test "$STATUS $TYPE" = "200 application/json"
end=$(($(date +%s) + 60))
while ask GET "$STABILITY?begin=false" && [ "$STATUS" != 404 ] && [ "$(date +%s)" -lt "$end" ]; do
    sleep 0.05
done
check "and leaves no report" status_is 404
ask POST "$WORK?budget=0.01"
check "a short one is begun" test "$STATUS $TYPE" = "202 application/json"
daemon_end KILL
daemon_start "$T/data" --workers 1
ask POST "$WORK?budget=0.01"
check "kill -9 leaves nothing in the way" status_is 202
check "it is measured" until_measured
check "as JSON" type_is application/json
check "in the form that is promised" holds "$shape"
check "of all scenes and methods" holds '(.scenes | length) == 5 and all(.scenes[];
    .order | has("auto") and has("bcd") and has("strang"))'
check "with jobs that are accepted" all_valid "$T/body"
cp "$T/body" "$T/report"
ask GET $WORK.csv
check "the same as CSV" test "$STATUS $TYPE" = "200 text/csv; charset=utf-8; header=present"
check "a line for each entry" test "$(($(wc -l <"$T/body") - 1))" = \
    "$(jq '[.scenes[].entries[]] | length' "$T/report")"
check "with the same numbers" sh -c '[ "$(tr -d "\r" <"$1" | cut -d , -f 3,4 | tail -n +2)" = \
    "$(jq -r ".scenes[].entries[] | [.time_step, .cost] | join(\",\")" "$2")" ]' \
    - "$T/body" "$T/report"
ask GET $WORK.svg
check "and as a picture" test "$STATUS $TYPE" = "200 image/svg+xml"
if command -v xmllint >/dev/null; then
    check "that is XML" xmllint --noout "$T/body"
fi
check "with four panels a scene" test "$(grep -c 'class="panel"' "$T/body")" = 20
ask HEAD $WORK --head
check "its head alone" status_is 200
ask GET /v1/reports
check "the list has the moment" holds '.reports[0] | .state == "idle" and (.measured_at | test("^20.*Z$"))'
daemon_end TERM
daemon_start "$T/data" --workers 1
ask GET $WORK
check "a restart keeps it" status_is 200
check "to the byte" cmp "$T/body" "$T/report"
daemon_end TERM

# ---- on the command line
"$B/bcd" report work-precision --scene sparse --method bcd --budget 0.01 --out "$T/out" >"$T/table" 2>&1
check "bcd report work-precision" test $? = 0
cp "$T/out/work-precision.json" "$T/body"
check "writes the same form" holds "$shape"
check "with a job that is accepted" all_valid "$T/body"
check "and a picture" grep -q '</svg>' "$T/out/work-precision.svg"
check "prints a table with a row for each entry, then the method's orders" \
    test "$(grep -c '^sparse *bcd ' "$T/table")" = 6
"$B/bcd" report work-precision --scene none >"$T/table" 2>&1
check "no such scene there" test $? = 2
"$B/bcd" report work-precision --budget nan >"$T/table" 2>&1
check "nor such a budget" test $? = 2

# ---- stability: what must be refused is, and what runs is right or says how wrong
"$B/bcd" report stability --only "h = " --json "$T/body" >"$T/table" 2>&1
check "steps that would melt a profile, miss wells or silence stickiness" test $? = 0
check "are refused, in words; but metropolis is exact with any" holds '.failed == 0 and .tried >= 9 and
    all(.entries[]; (.verdict == "refused" and (.reason | length) > 10) or
        (.method == "metropolis" and (.verdict == "right" or .verdict == "ran")))'
"$B/bcd" report stability --only "ell < 0" >"$T/table" 2>&1
check "so are rods that have no room" test $? = 0
"$B/bcd" report stability --only "N = 2" --method strang --json "$T/body" >"$T/table" 2>&1
check "two rods in a field" test $? = 0
check "are right, or off by what is told" holds '.tried == 1 and .failed == 0 and
    (.entries[0] | (.verdict == "right" or .verdict == "biased") and .stderr > 0 and
        (.off | fabs) < .time_step_error + 4 * .stderr and .time_step_error < 0.02)'
"$B/bcd" report stability --only "kT = 0" --method bcd --json "$T/body" >"$T/table" 2>&1
check "rods without noise lie still in their wells" holds '.failed == 0 and
    .entries[0].verdict == "right" and (.entries[0].off | fabs) < 1e-6'
"$B/bcd" report stability --only "N = 1" --json "$T/body" >"$T/table" 2>&1
check "one rod, by every method" test $? = 0
check "is right by its error bars alone, and biased beyond them" holds '.tried >= 9 and all(.entries[];
    .verdict == "refused" or .verdict == "ran" or (3 * .stderr + 1e-6 <= .bound and
    (.off | fabs) <= .bound and (.verdict == "right") == ((.off | fabs) <= 3 * .stderr + 1e-6)))'
"$B/bcd" report stability --only "sigma = 0.999" --method bcd --json "$T/body" >"$T/table" 2>&1
check "a run too short to tell" test $? = 0
check "does not count as right" holds '.entries[0] | (.verdict == "ran" and .time < 0.02 and
    (.reason | contains("too short"))) or .verdict == "refused" or .time > 0.02'
"$B/bcd" report stability --only "kT = 1e-9" --method metropolis --json "$T/body" >"$T/table" 2>&1
check "nor is a chain that hardly moves too late" test $? = 0
check "it ran, no more" holds '.entries[0].verdict | . == "ran" or . == "refused"'
rm -f "$T/body"
"$B/bcd" report stability --json "$T/body" >"$T/table" 2>&1 &
PATIENT=$!
end=$(($(date +%s) + 60))
while ! grep -q verdict "$T/body" 2>/dev/null && [ "$(date +%s)" -lt "$end" ]; do
    sleep 0.05
done
kill -TERM $PATIENT
wait $PATIENT 2>/dev/null
check "ended early it ends" test $? = 143
check "and leaves what it has" holds '.interrupted and .tried >= 1 and .tried == (.entries | length)'
"$B/bcd" report stability --only nothing >"$T/table" 2>&1
check "no such extreme" test $? = 2
finish
