#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The web page with 10^5 jobs, and all its views; BCD_PICTURES=DIR keeps pictures of them.
# Alone: it measures.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 1
BCD_URL=$URL BCD_RUNS=2 node tests/node/page_long.mjs
