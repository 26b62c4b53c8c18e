#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# slurm.sh with one node and with three, a larger sweep, and workers that come to the real end of
# their time.
status=0
for nodes in 1 3; do
    NODES=$nodes POINTS=400 LONG=1 TIME=100 sh tests/slurm/slurm.sh || status=1
done
exit $status
