#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A few seconds of everything at once: memory and descriptors stay as they are. soak_long.sh takes
# minutes.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 2 --log changes
BCD_URL=$URL BCD_PID=$PID BCD_DATA=$T/data BCD_SECONDS=${BCD_SECONDS:-6} node tests/node/soak.mjs
status=$?
daemon_end TERM
[ "$EXIT" = 0 ] || status=1
exit $status
