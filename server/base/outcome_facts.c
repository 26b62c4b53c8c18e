/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "outcome_facts.h"

static const struct outcome_fact facts[] = {
    {"realizations", OUTCOME_NUMBER},
    {"reused_realizations", OUTCOME_NUMBER},
    {"reused_from", OUTCOME_TEXT},
    {"core_seconds", OUTCOME_NUMBER},
    {"target.reached", OUTCOME_FLAG},
    {"target.stopped_by", OUTCOME_STOP},
    {"target.relative_error", OUTCOME_NUMBER},
    {"target.statistical", OUTCOME_NUMBER},
    {"target.time_step_error", OUTCOME_NUMBER},
};

const struct outcome_fact *outcome_fact_at(size_t index)
{
    return index < sizeof(facts) / sizeof(facts[0]) ? &facts[index] : NULL;
}
