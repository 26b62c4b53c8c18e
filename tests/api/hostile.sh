#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Clients that mean no good, on raw sockets; afterwards a job is done as ever.
. tests/api/_lib.sh
ulimit -n "$(ulimit -H -n)"
daemon_start "$T/data" --workers 1
BCD_URL=$URL BCD_PID=$PID node tests/node/hostile.mjs
status=$?
[ "$(curl -sS -m 60 -o /dev/null -w '%{http_code}' "$URL/healthz")" = 200 ] || status=1
daemon_end TERM
[ "$EXIT" = 0 ] || status=1
exit $status
