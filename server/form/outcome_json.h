/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * outcome_json.h - what became of a job beside its results: how many realizations there were, which
 * of them it took over from another job, how well its target was met.
 */
#ifndef OUTCOME_JSON_H
#define OUTCOME_JSON_H

#include "bcd.h"

struct outcome {
    const struct bcd_verdict *verdict; /* NULL = it has not ended */
    int64_t reused;                    /* realizations taken over */
    const char *reused_from;           /* the id of the job that ran them; NULL = none */
    double core_seconds;               /* used in all attempts; 0 = is not told */
};

/* {"realizations":..,"reused_realizations":..,"reused_from":..,"core_seconds":..,"target":{..}},
 * the target only of a job that has one (malloc'ed, NULL = out of memory). */
char *outcome_json_print(const struct outcome *outcome);

#endif
