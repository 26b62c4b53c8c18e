#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Fifty kills; see _crash.sh.
KILLS=${CRASH_KILLS:-50}
SEED=${CRASH_SEED:-7}
. "$(dirname "$0")/_crash.sh"
