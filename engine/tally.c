/* SPDX-License-Identifier: GPL-3.0-or-later
 * tally.c - see tally.h and bcd.h. Means and variances by Welford's recurrence, merged by
 * Chan's. */
#include "tally.h"
#include "blob.h"
#include "plan_step.h"
#include "reference.h"
#include "status.h"
#include "step_error.h"
#include "table.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Values of one sample of one observable, in both its sections if there are two. */
static size_t values_of(const struct scene_part *part, const struct plan *plan)
{
    const struct observable_type *type = scene_observable_type(part);
    return type->count(part->group.values, plan) * step_error_sections(type, plan);
}

size_t tally_count(const struct bcd_scene *scene)
{
    size_t count = 0;
    const struct scene_part *part;
    for (size_t i = 0; (part = scene_observable(scene, i)) != NULL; i++)
        count += values_of(part, &scene->plan);
    return count;
}

/* Bytes of a tally of `count` values. */
static size_t bytes_of(size_t count)
{
    return (3 * count + 1) * sizeof(double);
}

static void point_into(struct bcd_tally *tally, double *memory)
{
    tally->samples = memory;
    tally->mean = memory ? memory + tally->count : NULL;
    tally->square = memory ? memory + 2 * tally->count : NULL;
    tally->realizations = memory ? memory + 3 * tally->count : NULL;
}

void tally_layout(struct bcd_tally *tally, const struct bcd_scene *scene, size_t count,
                  struct arena *kept)
{
    *tally = (struct bcd_tally){.count = count};
    if (kept->bytes) /* else only sizes are wanted */
        tally->identity = scene_family(scene);
    point_into(tally, arena_take(kept, bytes_of(count)));
}

enum bcd_status bcd_tally_create(struct bcd_tally **out, const struct bcd_scene *scene)
{
    struct bcd_tally *tally = calloc(1, sizeof *tally);
    if (!tally)
        return BCD_NO_MEMORY;
    tally->identity = scene_family(scene);
    tally->count = tally_count(scene);
    tally->owned = calloc(1, bytes_of(tally->count));
    if (!tally->owned) {
        free(tally);
        return BCD_NO_MEMORY;
    }
    point_into(tally, tally->owned);
    *out = tally;
    return BCD_OK;
}

void bcd_tally_free(struct bcd_tally *tally)
{
    if (!tally)
        return;
    free(tally->owned);
    free(tally);
}

void tally_add(struct bcd_tally *tally, const double *values)
{
    for (size_t i = 0; i < tally->count; i++) {
        if (isnan(values[i]))
            continue;
        double n = tally->samples[i] += 1;
        double off = values[i] - tally->mean[i];
        tally->mean[i] += off / n;
        tally->square[i] += off * (values[i] - tally->mean[i]);
    }
}

void tally_copy(struct bcd_tally *to, const struct bcd_tally *from)
{
    assert(to->identity == from->identity && to->count == from->count);
    memcpy(to->samples, from->samples, bytes_of(to->count));
}

int64_t bcd_tally_realizations(const struct bcd_tally *tally)
{
    return (int64_t)*tally->realizations;
}

void bcd_tally_merge(struct bcd_tally *into, const struct bcd_tally *from)
{
    assert(into->identity == from->identity && into->count == from->count);
    *into->realizations += *from->realizations;
    for (size_t i = 0; i < into->count; i++) {
        double a = into->samples[i], b = from->samples[i], n = a + b;
        if (b == 0)
            continue;
        double off = from->mean[i] - into->mean[i];
        into->samples[i] = n;
        into->mean[i] += off * (b / n);
        into->square[i] += from->square[i] + off * off * (a * b / n);
    }
}

/* ------------------------------------------------------------------- bytes */

/* Whether they are numbers of something; means and squares may be anything that a run can give. */
static bool counts_are_counts(const double *samples, double realizations, size_t count)
{
    const double most = 0x1p53;
    bool sound = realizations >= 0 && realizations <= most;
    for (size_t i = 0; i < count; i++)
        sound &= samples[i] >= 0 && samples[i] <= most;
    return sound;
}

size_t bcd_tally_size(const struct bcd_tally *tally)
{
    return BLOB_HEADER_SIZE + bytes_of(tally->count);
}

void bcd_tally_save(const struct bcd_tally *tally, void *bytes)
{
    memcpy((char *)bytes + BLOB_HEADER_SIZE, tally->samples, bytes_of(tally->count));
    blob_seal(bytes, BLOB_TALLY, tally->identity, bcd_tally_size(tally));
}

enum bcd_status bcd_tally_restore(struct bcd_tally *tally, const void *bytes, size_t size,
                                  struct bcd_error *error)
{
    enum bcd_status status = blob_check(bytes, BLOB_TALLY, tally->identity, size, error);
    if (status)
        return status;
    if (size != bcd_tally_size(tally))
        return error_set(error, BCD_CORRUPT, "", "a tally of %zu bytes, %zu expected", size,
                         bcd_tally_size(tally));
    memcpy(tally->samples, (const char *)bytes + BLOB_HEADER_SIZE, bytes_of(tally->count));
    if (!counts_are_counts(tally->samples, *tally->realizations, tally->count))
        return error_set(error, BCD_CORRUPT, "", "a tally with counts that are none");
    return BCD_OK;
}

/* ------------------------------------------------------------------ tables */

/* longest: the time step up to which the observable is resolved. */
static void add_remarks(struct bcd_table *table, const struct plan *plan, double longest)
{
    const struct bcd_column *error = bcd_table_column(table, BCD_ROLE_STDERR);
    const char *from = plan->realizations == 1 ? "blocks" : "realizations";
    if (error && error->values) {
        table_note_text(table, "stderr_from", from);
        table_note_number(table, from,
                          (double)(plan->realizations == 1 ? plan->blocks : plan->realizations));
    }
    if (longest < plan->time_step * (1 - 1e-9))
        table_note_number(table, "time_step_resolving_it", longest);
    if (plan->method->experimental)
        table_note_text(table, "experimental", plan->method->experimental);
}

struct moments tally_moments(const struct bcd_tally *tally, const struct bcd_scene *scene,
                             size_t index, size_t section)
{
    const struct scene_part *part = scene_observable(scene, index);
    size_t count = scene_observable_type(part)->count(part->group.values, &scene->plan);
    size_t first = section * count;
    for (size_t i = 0; i < index; i++)
        first += values_of(scene_observable(scene, i), &scene->plan);
    return (struct moments){tally->samples + first, tally->mean + first, tally->square + first,
                            count};
}

enum bcd_status bcd_tally_table(const struct bcd_tally *tally, const struct bcd_scene *scene,
                                const struct bcd_theory *theory, size_t index,
                                struct bcd_table **out)
{
    assert(tally->identity == scene_family(scene));
    const struct scene_part *part = scene_observable(scene, index);
    if (!part)
        return BCD_INVALID;
    const struct observable_type *type = scene_observable_type(part);
    const void *par = part->group.values;
    struct plan plan = scene->plan; /* as if it had been for the realizations that there are */
    plan.fine = &plan;
    if (*tally->realizations > 0)
        plan.realizations = bcd_tally_realizations(tally);
    struct moments moments = tally_moments(tally, scene, index, 0),
                   second = tally_moments(tally, scene, index, 1);
    struct bcd_table *table = calloc(1, sizeof *table);
    if (!table)
        return BCD_NO_MEMORY;
    enum bcd_status status = type->describe(par, &plan, &moments, table);
    if (!status)
        status = table_add_moments(table, type->value, &moments);
    if (!status && type->extend)
        status = type->extend(par, &plan, table);
    if (!status)
        status = reference_add(table, theory, scene, index);
    if (!status)
        status = reference_compare(table, moments.samples);
    if (!status)
        status = step_error_add(table, type, &plan, &moments, &second);
    if (status) {
        bcd_table_free(table);
        return status;
    }
    add_remarks(table, &plan, plan_step_resolving(scene, type, par));
    if (scene->unstable[0])
        table_note_text(table, "time_step_warning", scene->unstable);
    *out = table;
    return BCD_OK;
}
