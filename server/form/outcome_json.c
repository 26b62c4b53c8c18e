/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "outcome_json.h"
#include "text.h"

#include <inttypes.h>

static void add_target(struct text *text, const struct bcd_verdict *verdict);

char *outcome_json_print(const struct outcome *outcome)
{
    const struct bcd_verdict *verdict = outcome->verdict;
    struct text text = {0};
    if (verdict)
        text_add(&text, "{\"realizations\":%" PRId64, verdict->realizations);
    else
        text_add(&text, "{\"realizations\":null");
    text_add(&text, ",\"reused_realizations\":%" PRId64 ",\"reused_from\":", outcome->reused);
    if (outcome->reused_from)
        text_add_json_string(&text, outcome->reused_from);
    else
        text_add(&text, "null");
    if (outcome->core_seconds > 0) {
        text_add(&text, ",\"core_seconds\":");
        text_add_number(&text, outcome->core_seconds);
    }
    if (verdict && verdict->stop != BCD_STOP_ALL)
        add_target(&text, verdict);
    text_add(&text, "}");
    return text_take(&text);
}

static void add_target(struct text *text, const struct bcd_verdict *verdict)
{
    const struct {
        const char *name;
        double value;
    } shares[] = {{"relative_error", verdict->error},
                  {"statistical", verdict->statistical},
                  {"time_step_error", verdict->time_step}};
    text_add(text, ",\"target\":{\"reached\":%s,\"stopped_by\":\"%s\"",
             verdict->stop == BCD_STOP_TARGET ? "true" : "false", bcd_stop_name(verdict->stop));
    for (size_t i = 0; i < sizeof(shares) / sizeof(shares[0]); i++) {
        text_add(text, ",\"%s\":", shares[i].name);
        text_add_number(text, shares[i].value);
    }
    text_add(text, "}");
}
