#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The web page, in a browser.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 1
BCD_URL=$URL node tests/node/page.mjs
