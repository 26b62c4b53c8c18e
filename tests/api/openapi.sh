#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The description of the API as a document; tests/api/requests.sh asks all that it says.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 1
BCD_URL=$URL node tests/node/openapi.mjs
