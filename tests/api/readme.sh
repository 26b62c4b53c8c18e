#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The commands of README.md do what it says.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 2
BCD_URL=$URL BCD_DATA=$T/data node tests/node/readme.mjs
