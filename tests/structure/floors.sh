#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Includes point downwards only (the floors of the house): who may know what.
set -u

count=0
# report "text" "offenders, one a line; nothing = passed"
report() {
    count=$((count + 1))
    if [ -z "$2" ]; then
        echo "ok $count - $1"
    else
        echo "not ok $count - $1"
        printf '%s\n' "$2" | sed 's/^/# /'
    fi
}

# "file header" of every include of ours ("...") or of the system (<...>) below the given places.
ours() {
    grep -rHE '^[ 	]*#[ 	]*include[ 	]*"' --include='*.[ch]' "$@" |
        sed -E 's/^([^:]*):[^"]*"([^"]*)".*/\1 \2/'
}
system() {
    grep -rHE '^[ 	]*#[ 	]*include[ 	]*<' --include='*.[ch]' "$@" |
        sed -E 's/^([^:]*):[^<]*<([^>]*)>.*/\1 \2/'
}

echo 1..11
report "includes are found" "$([ "$(ours engine server | wc -l)" -gt 100 ] || echo "too few")"

report "only http.c knows libmicrohttpd" \
    "$(system engine server | awk '$2 == "microhttpd.h" && $1 != "server/http.c"')"

report "only *_json.c and main.c know jansson" \
    "$(system engine server | awk '$2 == "jansson.h" && $1 !~ /^server\/(.*_json|main)\.c$/')"

report "only store*.c know SQLite" \
    "$(system engine server | awk '$2 == "sqlite3.h" && $1 !~ /^server\/store[a-z_]*\.[ch]$/')"

report "the engine includes nothing of the server" "$(
    ours engine | while read -r file header; do
        base=${header##*/}
        if [ -e "server/$base" ] && [ -z "$(find engine -name "$base")" ]; then
            echo "$file $header"
        fi
    done
)"

report "the engine knows no thread, clock, socket, file or process" "$(
    system engine | awk '$2 ~ /^(pthread|threads|time|unistd|fcntl|signal|syslog|spawn|stdio)\.h$/ ||
                         $2 ~ /^sys\// || $2 ~ /^(netinet|arpa)\// {
        if ($2 == "stdio.h") next # snprintf; printing is looked for below
        print }'
    grep -rnE '\b(printf|puts|putchar|fopen|exit|abort|perror)[ ]*\(' --include='*.c' engine |
        grep -vE '\b(sn|vsn)printf'
)"

report "kernels include kernels only" "$(
    ours engine/kernels | while read -r file header; do
        [ -e "engine/kernels/$header" ] || echo "$file $header"
    done
)"

# parts.c is where they meet; above them stand the scene, the run and the reference. theory/ is
# mathematics on plain data, a floor with the kernels.
report "parts include neither one another nor what stands above them" "$(
    for kind in methods potentials pairs observables; do
        [ -d "engine/$kind" ] || continue
        ours "engine/$kind" | while read -r file header; do
            own=$(basename "${file%.[ch]}").h
            [ "$header" != "$own" ] || continue
            case $header in
            scene.h | plan.h | parts.h | tally.h | reference.h | run.h | checkpoint.h)
                echo "$file $header"
                ;;
            *)
                for other in methods potentials pairs observables; do
                    [ ! -e "engine/$other/${header##*/}" ] || echo "$file $header"
                done
                ;;
            esac
        done
    done
)"

report "the server enters the engine by its one door" "$(
    ours server | while read -r file header; do
        [ "$header" = bcd.h ] || [ -e "server/${header#*/}" ] || [ "$header" = migrations.inc ] ||
            echo "$file $header"
    done
)"

report "only worker.c, cli*.c and report_run.c run simulations" "$(
    grep -rlE '\bbcd_run_[a-z]+[ ]*\(' --include='*.[ch]' server |
        grep -vE '^server/(worker|report_run|cli[a-z_]*)\.c$'
)"

# The floors of the server, from the top: 5 programs, 4 the way of a request (http.h is its
# vocabulary), 3 queue and reports, 2 forms, 1 store, 0 what knows no other.
report "the server includes downwards only" "$(
    ours server | awk '
        function floor_of(file) {
            sub(/.*\//, "", file); sub(/\.[ch]$/, "", file)
            if (file ~ /^(main|cli|config)/)                return 5
            if (file ~ /^(http|routes|handle|reply)/)       return 4
            if (file ~ /^(queue|worker|report_)/)                   return 3
            if (file ~ /_(json|print)$/ || file ~ /^(plot|table)_/) return 2
            if (file ~ /^store/)                            return 1
            return 0
        }
        $2 == "bcd.h" || $2 == "migrations.inc" { next }
        floor_of($2) > floor_of($1)'
)"
