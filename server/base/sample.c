/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sample.h"

#include <string.h>

static void give(struct bcd_group *group, const char *name, double value, struct bcd_errors *errors)
{
    const struct bcd_param *row = bcd_group_find(group, name);
    if (row && row->type == BCD_PARAM_INTEGER)
        bcd_group_set_integer(group, row, (int64_t)value, errors);
    else if (row)
        bcd_group_set_number(group, row, value, errors);
}

/* What an observable cannot do without is given the least that its rows allow. */
static void ask_for(struct bcd_scene *scene, const struct bcd_part *part, struct bcd_errors *errors)
{
    struct bcd_group *group = bcd_scene_add(scene, BCD_SLOT_OBSERVABLE, part->name, errors);
    for (const struct bcd_param *row = part->params; group && row && row->name; row++)
        if (row->required)
            give(group, row->name, row->min > 0 ? row->min : 0.5, errors);
}

bool sample_init(struct sample *sample)
{
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    const struct bcd_part *part;
    *sample = (struct sample){0};
    if (bcd_scene_create(&scene) != BCD_OK)
        return false;
    struct bcd_group *job = bcd_scene_job(scene);
    give(job, "particles", 4, &errors);
    give(job, "length", 8, &errors);
    give(job, "diameter", 0.5, &errors);
    give(job, "time", 10, &errors);
    give(job, "time_step", 1e-5, &errors);
    give(job, "realizations", 8, &errors);
    struct bcd_group *potential = bcd_scene_add(scene, BCD_SLOT_POTENTIAL, "cosine", &errors);
    struct bcd_group *interaction = bcd_scene_add(scene, BCD_SLOT_INTERACTION, "sticky", &errors);
    if (potential && interaction) {
        give(potential, "amplitude", 1, &errors);
        give(interaction, "strength", 1, &errors);
        give(interaction, "range", 0.05, &errors);
    }
    for (size_t i = 0; (part = bcd_catalogue(BCD_SLOT_OBSERVABLE, i)); i++)
        ask_for(scene, part, &errors);
    if (errors.count == 0 && bcd_scene_complete(scene, NULL, &errors) == BCD_OK &&
        bcd_tally_create(&sample->tally, scene) == BCD_OK) {
        sample->scene = scene;
        return true;
    }
    bcd_scene_free(scene);
    return false;
}

void sample_fini(struct sample *sample)
{
    bcd_tally_free(sample->tally);
    bcd_scene_free(sample->scene);
    *sample = (struct sample){0};
}

struct bcd_table *sample_table(const struct sample *sample, size_t index)
{
    struct bcd_table *table = NULL;
    if (!bcd_scene_part(sample->scene, BCD_SLOT_OBSERVABLE, index) ||
        bcd_tally_table(sample->tally, sample->scene, NULL, index, &table) != BCD_OK)
        return NULL;
    return table;
}
