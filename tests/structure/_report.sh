# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=sh
# Read by the tests beside it: one line of TAP for each thing looked at.
count=0

# report "text" "offenders, one a line; nothing = passed"
report() {
    count=$((count + 1))
    if [ -z "$2" ]; then
        echo "ok $count - $1"
    else
        echo "not ok $count - $1"
        printf '%s\n' "$2" | sed 's/^/# /'
    fi
}
