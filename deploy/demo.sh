#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# demo.sh - one real job through a throw-away server, as a user with curl would do it: start bcdd on
# a free loopback port, submit rods in a periodic potential (the 2022 paper, sigma .5, rho .5), watch
# the progress, print density and mean squared displacement, save the pictures in $B/demo, stop.
# Exit status 0 only if all of it worked.
set -eu
LC_ALL=C
export LC_ALL
cd "$(dirname "$0")/.."
B=${B:-build}
scene=tests/scenes/2022-fig3-sigma0.5-rho0.5.json
pictures=$B/demo

work=$(mktemp -d)
server=
stop_server() {
    [ -n "$server" ] || return 0
    pid=$server
    server=
    kill "$pid" 2>/dev/null || true
    wait "$pid"
}
clean_up() {
    status=$?
    trap - EXIT INT TERM
    stop_server || true
    if [ "$status" -ne 0 ]; then
        echo "demo: failed" >&2
        cat "$work/log" >&2 2>/dev/null || true
    fi
    rm -rf "$work"
    exit "$status"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

say() {
    printf '\n== %s\n' "$*"
}
fail() {
    echo "demo: $*" >&2
    exit 1
}
# request CURL-ARGUMENTS: the body on stdout; any status of 400 and more is shown and ends the demo.
request() {
    curl -sS --max-time 30 --fail-with-body -o "$work/body" "$@" || {
        cat "$work/body" >&2 2>/dev/null || true
        fail "the request failed: $*"
    }
    cat "$work/body"
}

say "Starting the server"
workers=$(nproc 2>/dev/null || echo 1)
"$B/bcdd" --listen 127.0.0.1:0 --data "$work/data" --workers "$workers" >"$work/out" 2>"$work/log" &
server=$!
tries=0
until grep -q . "$work/out"; do
    kill -0 "$server" 2>/dev/null || fail "the server did not start"
    tries=$((tries + 1))
    [ "$tries" -le 100 ] || fail "the server is not ready after 10 s"
    sleep 0.1
done
first=$(head -n 1 "$work/out")
case $first in
"listening on http://127.0.0.1:"[0-9]*) url=${first#listening on } ;;
*) fail "unexpected first line: $first" ;;
esac
echo "$first, $workers workers, data in $work/data"

# The paper's scene with a bit more of everything to look at.
jq '.realizations = 32 | .observables = {
        density: {bins: 40}, contact_density: {bins: 40, gap: 0.001},
        msd: {first: 0.001, last: 10, points: 21}, energy: {}, current: {}, cluster_sizes: {gap: 0.05}}' \
    "$scene" >"$work/job.json"
say "Submitting the job: POST $url/v1/jobs"
jq -c . "$work/job.json"
request -H 'Content-Type: application/json' --data-binary "@$work/job.json" \
    "$url/v1/jobs" >"$work/record"
id=$(jq -er .id "$work/record")
jq -r '"job \(.id): \(.job.particles) rods of length \(.job.diameter) on a ring of \(.job.length), " +
       "U0 = \(.job.potential.amplitude)\nmethod \(.derived.method), time step \(.derived.time_step), " +
       "\(.derived.steps) steps"' "$work/record"

say "Running: GET /v1/jobs/$id"
line_end='\n'
[ ! -t 1 ] || line_end='\r'
polls=0
while :; do
    request "$url/v1/jobs/$id" >"$work/record"
    state=$(jq -er .state "$work/record")
    jq -r '"\(.state) \(.progress)"' "$work/record" | awk -v end="$line_end" '{
        bar = sprintf("%*s", int(40 * $2), ""); gsub(/ /, "#", bar)
        printf "%-8s [%-40s] %3d %%" end, $1, bar, 100 * $2 }'
    case $state in
    done) break ;;
    queued | running) ;;
    *) fail "the job ended as $state: $(jq -r .error "$work/record")" ;;
    esac
    polls=$((polls + 1))
    [ "$polls" -le 1200 ] || fail "the job is not done after five minutes"
    sleep 0.25
done
echo

request "$url/v1/jobs/$id/results" >"$work/results"

say "Density over one period: GET /v1/jobs/$id/results/density (every second bin)"
# Columns of one observable as text: missing ones (null) as dashes.
columns() { # observable, value's name
    jq -r --arg o "$1" --arg v "$2" '.[$o] | . as $t | range($t[$v] | length) as $i |
        [($t.x // $t.lag)[$i], $t[$v][$i], $t.stderr[$i] // "-",
         (if ($t.theory | type) == "array" then $t.theory[$i] // "-" else "-" end)] | @tsv' \
        "$work/results"
}
columns density density >"$work/density"
columns msd msd >"$work/msd"
print_table() { # heading of x, heading of the value, file, every
    awk -v every="$4" -v x="$1" -v v="$2" '
        BEGIN { printf "%10s %12s %12s %12s\n", x, v, "stderr", "theory" }
        (NR - 1) % every == 0 {
            printf "%10.5g %12.6g %12s %12s\n", $1, $2,
                   $3 == "-" ? "-" : sprintf("%.2g", $3), $4 == "-" ? "-" : sprintf("%.6g", $4) }' "$3"
}
# What the result says about a missing theory; null is an answer, no answer at all is not.
about_theory() {
    jq -r --arg o "$1" '.[$o] | if (.theory | type) != "null" then
        "theory: exact equilibrium of this job. What differs from it by more than the error bars is" +
        "\nthe error of the finite time step (method bcd: its square root), or not yet equilibrium." else
        "no exact theory in this result" + (if .theory_reason then ": " + .theory_reason else "" end)
        end' "$work/results"
}
print_table x density "$work/density" 2
about_theory density

# A picture of it: simulation as #, exact theory as o.
awk '
    { s[NR] = $2; t[NR] = $4; top = $2 > top ? $2 : top; if ($4 != "-" && $4 > top) top = $4 }
    END {
        rows = 16
        for (r = rows; r >= 1; r--) {
            line = ""
            for (i = 1; i <= NR; i++) {
                h = int(rows * s[i] / top + 0.5)
                mark = t[i] != "-" && int(rows * t[i] / top + 0.5) == r
                line = line (mark ? "oo" : h >= r ? "##" : "  ")
            }
            label = r == rows ? sprintf("%7.3g", top) : r == rows / 2 ? sprintf("%7.3g", top / 2) : ""
            sub(/ +$/, "", line)
            printf "%7s |%s\n", label, line
        }
        axis = sprintf("%*s", 2 * NR, ""); gsub(/ /, "-", axis)
        printf "%7s +%s\n%9s%-*s%s\n", "0", axis, "", 2 * NR - 1, "0", "1"
        printf "%9s%*s\n", "", NR + 9, "x / wavelength"
    }' "$work/density"

# The mean over the period is N / L, whatever the noise.
jq -e --slurpfile r "$work/record" '
    ((.density.density | add / length) - $r[0].job.particles / $r[0].job.length) | fabs < 1e-9' \
    "$work/results" >"$work/norm" || fail "the mean density is not N / L"

say "Mean squared displacement of a tagged rod: GET /v1/jobs/$id/results/msd"
print_table lag msd "$work/msd" 1
about_theory msd

say "Numbers"
jq -r '"energy per rod   \(.energy.energy) +- \(.energy.stderr)   theory \(.energy.theory // "-")",
       "current          \(.current.current) +- \(.current.stderr)",
       "clusters of 1, 2, 3 rods (gaps below \(.cluster_sizes.gap)): " +
       ([.cluster_sizes.fraction[:3][] | . * 1000 | round / 1000 | tostring] | join(", "))' \
    "$work/results"

say "Pictures"
mkdir -p "$pictures"
for observable in density contact_density msd cluster_sizes; do
    request "$url/v1/jobs/$id/results/$observable.svg" >"$pictures/$observable.svg"
    grep -q '</svg>' "$pictures/$observable.svg" || fail "$observable.svg is no picture"
    echo "$pictures/$observable.svg"
done

say "Stopping the server"
stop_server || fail "the server ended with status $?"
echo "done"
