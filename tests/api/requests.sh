#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Random requests for everything that the description tells of: each answer is one that it declares.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 1
BCD_URL=$URL node tests/node/requests.mjs
