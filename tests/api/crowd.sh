#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Fifty workers, some of whom vanish, come late, give back twice or give back rubbish: no chunk is
# lost, none counts twice, and people are served meanwhile. crowd_long.sh does it with 500.
. "$(dirname "$0")/_crowd.sh"

crowd_daemon 64 2
crowd_sweep 1000 250 4
crowd_sweep 50000 20 64
crowd_work --workers 50 --seconds 150 --work 500 --gone 30 --late 30 --twice 30 --broken 20
crowd_ledger
check "of each kind there were some" says '.gone > 0 and .late > 0 and .doubled > 0 and .broken > 0'
check "jobs have the bits of one machine" same_bits 1007 4
check "also those of several chunks" same_bits 50003 64
check "who looks or submits has an answer within a second" says \
    '[.ms.healthz, .ms.job, .ms.list, .ms.page, .ms.metrics, .ms.submit] | all(.p95 < 1000)'
check "what workers say a thousand times is not in a log of changes" sh -c \
    "grep -q 'path=/v1/jobs ' '$T/stderr' && ! grep -m 3 'path=/v1/leases.*status=200' '$T/stderr'"
finish
