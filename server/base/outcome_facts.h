/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * outcome_facts.h - what is told of how a job came to its end, by name: jobs are found by it, and
 * SQL has a column for each. outcome_json.c prints them.
 */
#ifndef OUTCOME_FACTS_H
#define OUTCOME_FACTS_H

#include <stddef.h>

enum outcome_kind { OUTCOME_NUMBER, OUTCOME_TEXT, OUTCOME_FLAG, OUTCOME_STOP };
struct outcome_fact {
    const char *path; /* within the outcome: "target.reached" */
    enum outcome_kind kind;
};

/* NULL past the last. */
const struct outcome_fact *outcome_fact_at(size_t index);

#endif
