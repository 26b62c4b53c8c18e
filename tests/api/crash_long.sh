#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A thousand kills; see _crash.sh.
KILLS=1000
SEED=${CRASH_SEED:-20260101}
. "$(dirname "$0")/_crash.sh"
