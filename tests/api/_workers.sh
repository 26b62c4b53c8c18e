# SPDX-License-Identifier: GPL-3.0-or-later
# _workers.sh - workers beside the daemon, for scripts that read this one after _lib.sh: whatever
# becomes of a test, none of them is left.
WORKERS=
cleanup() {
    for pid in $WORKERS $PID; do
        kill -9 "$pid" 2>/dev/null
    done
    rm -rf "$T"
}
worker_start() { # bcd worker's options: adds one to WORKERS; its pid in LAST
    env -u BCD_URL -u BCD_TOKEN "$B/bcd" worker "$@" >>"$T/worker.out" 2>>"$T/worker.err" &
    LAST=$!
    WORKERS="$WORKERS $LAST"
}
kill_one_end_another() { # the last one by SIGKILL, the one before by SIGTERM; its exit status
    before=${WORKERS% *}
    before=${before##* }
    kill -9 "$LAST"
    kill -TERM "$before"
    wait "$before"
}
