#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Many more random jobs and requests than make check sends, others every day.
. tests/api/_lib.sh
BCD_RUNS=${BCD_RUNS:-20}
BCD_SEED=${BCD_SEED:-$(date +%Y%m%d)}
export BCD_RUNS BCD_SEED
echo "# BCD_SEED=$BCD_SEED"
daemon_start "$T/data" --workers 1
BCD_URL=$URL node tests/node/job_schema.mjs # before there are tokens
status=$?
BCD_URL=$URL node tests/node/requests.mjs || status=$?
exit $status
