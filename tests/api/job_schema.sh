#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The schema of a job is what the server serves, and both say the same of jobs at random.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 1
BCD_URL=$URL node tests/node/job_schema.mjs
