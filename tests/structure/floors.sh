#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Includes point downwards only (the floors of the house): who may know what.
set -u

. tests/structure/_report.sh

# "file header" of every include of ours ("...") or of the system (<...>) below the given places.
ours() {
    grep -rHE '^[ 	]*#[ 	]*include[ 	]*"' --include='*.[ch]' "$@" |
        sed -E 's/^([^:]*):[^"]*"([^"]*)".*/\1 \2/'
}
system() {
    grep -rHE '^[ 	]*#[ 	]*include[ 	]*<' --include='*.[ch]' "$@" |
        sed -E 's/^([^:]*):[^<]*<([^>]*)>.*/\1 \2/'
}

echo 1..15
report "includes are found" "$([ "$(ours engine server | wc -l)" -gt 100 ] || echo "too few")"

report "only http*.c and http_internal.h know libmicrohttpd" \
    "$(system engine server | awk '$2 == "microhttpd.h" && $1 !~ /^server\/http\/http([a-z_]*\.c|_internal\.h)$/')"

report "only *_json.c and main.c know jansson" \
    "$(system engine server | awk '$2 == "jansson.h" && $1 !~ /^server\/(form\/[a-z_]*_json|main)\.c$/')"

report "only store*.c know SQLite" \
    "$(system engine server | awk '$2 ~ /^sqlite3(ext)?\.h$/ && $1 !~ /^server\/store\/store[a-z_]*\.[ch]$/')"

# SQLite before 3.51.3 may lose a transaction where two connections write or checkpoint.
report "one connection is opened to write, and that one alone checkpoints" "$(
    [ "$(grep -rhoE 'SQLITE_OPEN_READWRITE, &[a-z.>-]+' server --include='*.c' | LC_ALL=C sort)" = \
        "$(printf '%s\n' 'SQLITE_OPEN_READWRITE, &copying->copy' \
            'SQLITE_OPEN_READWRITE, &opening.store->writer')" ] ||
        grep -rnE 'SQLITE_OPEN_READWRITE' server --include='*.c'
    grep -rn 'sqlite3_open[a-z0-9_]*(' server --include='*.c' |
        grep -vE '^server/store/(store|store_backup|store_sql)\.c:'
    grep -rnE 'wal_checkpoint(_v2)?\(' server --include='*.c' | grep -vF '(store->writer,'
)"
report "only client.c knows libcurl" \
    "$(system engine server | awk '$2 ~ /^curl\// && $1 != "server/cli/client.c"')"

# cli_schema.c alone prints what the route table says.
report "the command line knows no handler and no socket" "$(
    ours server/cli | grep -v '^server/cli/cli_schema.c openapi.h$' | while read -r file header; do
        [ ! -e "server/api/$header" ] && [ ! -e "server/http/$header" ] || echo "$file $header"
    done
)"

report "no handler calls another file's" "$(
    for file in server/api/handle_*.c; do
        grep -ohE '\bhandle_[a-z_]+[ ]*\(' "$file" | sort -u | while read -r call; do
            grep -qE "^[a-z].*\b${call%(}\(" "$file" || echo "$file $call"
        done
    done
)"

report "the engine includes nothing of the server" "$(
    ours engine | while read -r file header; do
        base=${header##*/}
        if [ -n "$(find server -name "$base")" ] && [ -z "$(find engine -name "$base")" ]; then
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
        [ "$header" = bcd.h ] || [ "${header%.inc}" != "$header" ] ||
            [ -n "$(find server -name "$header")" ] || echo "$file $header"
    done
)"

report "only worker*.c, cli*.c and report_run.c run simulations" "$(
    grep -rlE '\bbcd_(run|team)_[a-z]+[ ]*\(' --include='*.[ch]' server |
        grep -vE '^server/(work/worker(_checkpoint|_chunks)?|report/report_run|cli/cli[a-z_]*)\.c$'
)"

# The rooms of the server, from the top: the programs, what is asked for (api/), how it comes and goes
# (http/: also the vocabulary of requests and replies), jobs and reports in work, their forms, what is
# kept, what knows no other. A header is looked up by its name, which no other room may have.
report "the server includes downwards only" "$({
    find server -name '*.h' | sed -E 's,(.*/)([^/]*)$,room \2 \1,'
    ours server
} | awk '
        function floor_of(path) {
            if (path ~ /^server\/(cli\/)?[^\/]*$/)   return 6
            if (path ~ /^server\/api\//)            return 5
            if (path ~ /^server\/http\//)           return 4
            if (path ~ /^server\/(work|report)\//)  return 3
            if (path ~ /^server\/form\//)           return 2
            if (path ~ /^server\/store\//)          return 1
            return 0
        }
        $1 == "room" { if ($2 in room) print "two rooms have " $2
                       room[$2] = $3; next }
        $2 == "bcd.h" || $2 ~ /[.]inc$/ { next }
        floor_of(room[$2]) > floor_of($1)'
)"
