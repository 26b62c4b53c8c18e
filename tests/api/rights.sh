#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Who may do what, on every operation of the description; and that no token of it all is in the log
# or, as it stands, in the database.
. tests/api/_lib.sh
daemon_start "$T/data" --workers 1
BCD_URL=$URL BCD_TOKENS=$T/tokens node tests/node/rights.mjs
status=$?
daemon_end TERM
[ "$EXIT" = 0 ] || status=1
if [ "$(grep -cxE 'bcd_[a-z2-7]{52}' "$T/tokens")" -lt 6 ] ||
    [ "$(grep -c 'event=request' "$T/stderr")" -lt 500 ]; then
    echo "# the walk left too little to look at"
    status=1
fi
if grep -qF -f "$T/tokens" "$T/stderr" || grep -qE 'bcd_[a-z2-7]{8}' "$T/stderr"; then
    echo "# a token is in the log"
    status=1
fi
if cat "$T"/data/bcd.sqlite* | grep -aqF -f "$T/tokens"; then
    echo "# a token is in the database"
    status=1
fi
exit $status
