#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Sweeps through a daemon: run to the end, killed on the way, extended, cancelled, and their results
# in every form, the same numbers in each.
. "$(dirname "$0")/_lib.sh"

base='"particles":8,"length":16,"time":0.5,"time_step":0.005,"initial":"lattice",
      "observables":{"msd":{"points":5},"energy":{},"density":{"bins":4}}'
sweep() { # axes [more]
    printf '{"base":{%s,"potential":{"type":"cosine","amplitude":2}},"axes":{%s}%s}' \
        "$base" "$1" "${2:-}" >"$T/sweep"
    ask POST /v1/sweeps --data-binary "@$T/sweep"
    SWEEP=$(jq -r '.id // empty' "$T/body")
}
until_ended() {
    end=$(($(date +%s) + 120))
    while [ "$(date +%s)" -lt "$end" ]; do
        ask GET "/v1/sweeps/$SWEEP"
        holds '.progress == 1' && return
        sleep 0.05
    done
    return 1
}
result() { # observable and form, where to
    ask GET "/v1/sweeps/$SWEEP/results/$1"
    cp "$T/body" "$T/$2"
}

daemon_start "$T/data" --workers 2
sweep '"/diameter":{"from":0.1,"to":0.5,"points":3},"/seed":{"first":1,"count":4}' \
    ',"label":"small","tags":["t1"]'
check "a sweep is taken" status_is 202
check "where it is" header_is location "/v1/sweeps/$SWEEP"
check "all points wait or run" holds '.jobs == 12 and (.states | add) == 12 and .label == "small"'
check "axes are given in full" holds '.axes["/diameter"] == [0.1,0.3,0.5]'
first=$SWEEP

# A 202 means on disk.
daemon_end KILL
daemon_start "$T/data" --workers 2
ask GET "/v1/sweeps/$SWEEP"
check "it survives a kill -9" holds '.jobs == 12 and (.states | add) == 12'
check "it runs to its end" until_ended
check "every point is done" holds '.states.done == 12'

result msd msd.json
check "one table as JSON" type_is application/json
check "a row for each point, with the axes' values" jq -e \
    '.next == null and (.rows | length) == 12 and .axes == ["/diameter","/seed"] and
     (.rows[5] | .state == "done" and .["/diameter"] == 0.3 and .["/seed"] == 2 and
      (.msd | length) == (.lag | length))' "$T/msd.json"
job=$(jq -r '.rows[5].job' "$T/msd.json")
ask GET "/v1/jobs/$job/results/msd"
check "the numbers are the job's" jq -e --slurpfile all "$T/msd.json" \
    '.msd == $all[0].rows[5].msd and .stderr == $all[0].rows[5].stderr' "$T/body"
result msd.ndjson msd.ndjson
check "the same in lines" jq -es --slurpfile all "$T/msd.json" '. == $all[0].rows' "$T/msd.ndjson"
result msd.csv msd.csv
check "the same as CSV" sh -c "[ \"\$(head -1 $T/msd.csv)\" = \
    job,/diameter,/seed,lag,msd,stderr,samples,theory,time_step_error ]"
jq -r '.rows[] | . as $r | range(.lag | length) |
       [$r.job, $r["/diameter"], $r["/seed"], $r.lag[.], $r.msd[.]] | @csv' "$T/msd.json" |
    tr -d '"' >"$T/want.csv"
check "its lines are those numbers" sh -c \
    "tail -n +2 $T/msd.csv | cut -d, -f1-5 | awk -F, 'NR == FNR { w[NR] = \$0; next }
     { split(w[FNR], v, \",\"); for (i = 1; i <= 5; i++) if (v[i] != \$i && v[i] - \$i) exit 1; n++ }
     END { if (n != 60) exit 1 }' $T/want.csv -"
result msd.npz msd.npz
check "the same for numpy" type_is application/zip
cat >"$T/read.py" <<'PYTHON'
import json, sys, zipfile
import numpy as np
folder = sys.argv[1]
rows = json.load(open(folder + "/msd.json"))["rows"]
assert zipfile.ZipFile(folder + "/msd.npz").testzip() is None
z = np.load(folder + "/msd.npz")
assert list(z["job"]) == [r["job"] for r in rows]
assert list(z["state"]) == ["done"] * 12
assert z["seed"].dtype == np.int64 and list(z["seed"]) == [r["/seed"] for r in rows]
assert list(z["diameter"]) == [r["/diameter"] for r in rows]
for name in ("lag", "msd", "stderr"):
    assert z[name].shape == (12, 5)
    assert (z[name] == np.array([r[name] for r in rows])).all()
assert np.isnan(z["theory"]).all() == (rows[0]["theory"] is None)
PYTHON
check "numpy.load gives the same numbers" /usr/bin/python3 "$T/read.py" "$T"
result energy energy.json
check "numbers of one row are numbers" jq -e '.rows[0].energy | type == "number"' "$T/energy.json"
result energy.svg energy.svg
check "a picture" type_is image/svg+xml
check "of the number along the first axis, seeds averaged" sh -c \
    "grep -q '>diameter<' $T/energy.svg && grep -q 'mean over seeds' $T/energy.svg"
result 'msd.svg?curves=/diameter' msd.svg
check "a curve for each value of an axis" sh -c \
    "grep -q 'diameter = 0.1<' $T/msd.svg && grep -q 'diameter = 0.5<' $T/msd.svg"
check "both are XML" /usr/bin/python3 -c \
    "import xml.dom.minidom as m; m.parse('$T/energy.svg'); m.parse('$T/msd.svg')"
ask GET "/v1/sweeps/$SWEEP/results/energy.svg?y=/diameter"
check "a map needs two axes" holds '.errors[0].parameter == "x"'
ask GET "/v1/sweeps/$SWEEP/results/energy.svg?scale=log"
check "and curves have no scale of colours" holds '.errors[0].parameter == "scale"'
ask GET "/v1/sweeps/$SWEEP/results/msd.svg?curves=/nix"
check "of axes that there are" status_is 400
ask GET "/v1/sweeps/$SWEEP/results/current"
check "what no job measures is not there" status_is 404
ask GET "/v1/sweeps/$SWEEP/results/msd.xml"
check "nor are other forms" status_is 404

ask POST /v1/sweeps --data-binary "@$T/sweep"
check "the same sweep again is the one that stands" holds ".deduplicated and .id == \"$first\""
ask POST "/v1/sweeps/$first/extend" -d '{"axes":{"/diameter":[0.7]}}'
check "it is extended" holds '.jobs == 16 and .states.done == 12'
result msd part.json
check "points without a result are rows without columns" jq -e \
    '(.rows | length) == 16 and (.rows[15] | has("msd") == (.state == "done"))' "$T/part.json"
SWEEP=$first
check "the new points run, too" until_ended
ask POST "/v1/sweeps/$first/retry"
check "nothing failed" holds '.retried == 0'

printf '{"base":{%s},"axes":{"/time":[1e5,2e5,3e5],"/seed":[1,2]}}' "$base" >"$T/long"
ask POST /v1/sweeps --data-binary "@$T/long" -H "Idempotency-Key: long"
SWEEP=$(jq -r .id "$T/body")
job=$(curl -sS -m 60 "$URL/v1/sweeps/$SWEEP/results/msd" | jq -r '.rows[0].job')
until_state "$job" running
ask DELETE "/v1/sweeps/$SWEEP"
check "cancelled: what runs and what waits" holds '.states.cancelled == 6 and .cancelled_at != null'
ask GET "/v1/jobs/$job"
check "its jobs say so" holds '.state == "cancelled"'
ask POST /v1/sweeps --data-binary "@$T/long" -H "Idempotency-Key: long"
check "a key answers with the sweep it was used for" holds \
    ".deduplicated and .id == \"$SWEEP\" and .cancelled_at != null"
result msd none.csv
result msd.csv none.csv
check "no results, no lines" sh -c "[ \"\$(cat $T/none.csv)\" = job,/time,/seed ]"
result msd.npz none.npz
check "nor rows for numpy" /usr/bin/python3 -c "
import numpy as np
z = np.load('$T/none.npz')
assert list(z['state']) == ['cancelled'] * 6 and 'msd' not in z"

sweep '"/diameter":[0.5,2.5]'
check "one wrong point is no sweep at all" status_is 422
check "it says which" holds '.errors[0].pointer == "/diameter" and
    (.errors[0].detail | test("point 1: /diameter = 2.5"))'
ask GET '/v1/sweeps?limit=1'
check "sweeps are listed by pages" holds '(.sweeps | length) == 1 and .next != null'
ask GET "/v1/sweeps?limit=1&cursor=$(jq -r .next "$T/body")"
check "the second page" holds '.sweeps[0].id == "'"$first"'" and .next == null'
ask GET '/v1/sweeps?cursor=x'
check "a wrong cursor" status_is 400
daemon_end TERM
check "stops at once" [ "$EXIT" = 0 ]
finish
