#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Thousands of jobs in five minutes: memory and descriptors stay as they are.
# Alone: it measures.
BCD_SECONDS=${BCD_SECONDS:-300} exec sh tests/api/soak.sh
