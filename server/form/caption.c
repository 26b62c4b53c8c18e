/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "caption.h"
#include "text.h"

#include <inttypes.h>
#include <math.h>

static void add_group(struct text *text, const struct bcd_group *group);
static bool is_default(const struct bcd_group *group, const struct bcd_param *row);

char *caption_print(const struct bcd_scene *scene)
{
    struct text text = {0};
    add_group(&text, bcd_scene_job_view(scene));
    for (int slot = 0; slot < BCD_SLOT_COUNT; slot++) {
        const struct bcd_group *part = bcd_scene_part(scene, slot, 0);
        if (!bcd_slot_typed(slot) || !part)
            continue;
        text_add(&text, ", %s %s", part->type, bcd_slot_key(slot));
        add_group(&text, part);
    }
    return text_take(&text);
}

static void add_group(struct text *text, const struct bcd_group *group)
{
    for (const struct bcd_param *row = group->rows; row->name; row++) {
        const char *word = bcd_group_text(group, row);
        if (is_default(group, row))
            continue;
        text_add(text, "%s%s ", text->size ? ", " : "", row->name);
        if (word)
            text_add(text, "%s", word);
        else if (row->type == BCD_PARAM_INTEGER)
            text_add(text, "%" PRId64, bcd_group_integer(group, row));
        else if (row->type == BCD_PARAM_NUMBERS)
            text_add(text, "of %zu numbers", bcd_group_numbers(group, row).count);
        else
            text_add_number(text, bcd_group_number(group, row));
    }
}

static bool is_default(const struct bcd_group *group, const struct bcd_param *row)
{
    if (row->type == BCD_PARAM_TEXT)
        return bcd_group_text(group, row)[0] == '\0';
    if (row->type == BCD_PARAM_NUMBERS)
        return bcd_group_numbers(group, row).count == 0;
    double value = bcd_group_number(group, row);
    bool is_auto = isnan(value) && isnan(row->fallback);
    return !row->required && (is_auto || value == row->fallback);
}
