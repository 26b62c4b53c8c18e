#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# hostile.sh with all crowds, and larger ones.
# Alone: it measures.
BCD_RUNS=2 exec sh tests/api/hostile.sh
