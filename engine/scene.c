/* SPDX-License-Identifier: GPL-3.0-or-later
 * scene.c - the job: its rows, its parts, its canonical encoding. See scene.h and bcd.h. */
#include "scene.h"
#include "blob.h"
#include "kernels/elementary.h"
#include "scene_cache.h"
#include "status.h"
#include "target.h"
#include "theory/sampler.h"

#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* -------------------------------------------------------------------- rows */

static const char *model_word(size_t i)
{
    static const char *const words[] = {"hard_rods"};
    return i < sizeof words / sizeof *words ? words[i] : NULL;
}

static const char *boundary_word(size_t i)
{
    static const char *const words[] = {[BOUNDARY_PERIODIC] = "periodic",
                                        [BOUNDARY_WALLS] = "walls"};
    return i < sizeof words / sizeof *words ? words[i] : NULL;
}

static const char *method_word(size_t i) /* "auto", then the registered methods */
{
    return i == 0 ? "auto" : method_types[i - 1] ? method_types[i - 1]->part.name : NULL;
}

static const char *initial_word(size_t i)
{
    static const char *const words[] = {[INITIAL_UNIFORM] = "uniform",
                                        [INITIAL_LATTICE] = "lattice",
                                        [INITIAL_EQUILIBRIUM] = "equilibrium"};
    return i < sizeof words / sizeof *words ? words[i] : NULL;
}

static const char *stability_word(size_t i)
{
    static const char *const words[] = {[STABILITY_REQUIRED] = "required",
                                        [STABILITY_IGNORED] = "ignored"};
    return i < sizeof words / sizeof *words ? words[i] : NULL;
}

static const char *step_error_word(size_t i)
{
    static const char *const words[] = {[STEP_ERROR_ESTIMATED] = "estimated",
                                        [STEP_ERROR_SKIPPED] = "skipped"};
    return i < sizeof words / sizeof *words ? words[i] : NULL;
}

#define AT(member) .offset = offsetof(struct job_par, member)
static const struct bcd_param job_params[] = {
    {.name = "model", .type = BCD_PARAM_CHOICE, .choice = model_word, .doc = "what is simulated",
     AT(model)},
    {.name = "particles", .type = BCD_PARAM_INTEGER, .required = true, .min = 1, .max = 1e7,
     .doc = "number of rods N", AT(particles)},
    {.name = "length", .type = BCD_PARAM_NUMBER, .required = true, .above_min = true,
     .unit = "length", .min = 0, .max = 1e12, .doc = "system length L", AT(length)},
    {.name = "diameter", .type = BCD_PARAM_NUMBER, .unit = "length", .min = 0, .max = 1e12,
     .doc = "rod length sigma", AT(diameter)},
    {.name = "mobility", .type = BCD_PARAM_NUMBER, .above_min = true,
     .unit = "length^2/(energy time)", .min = 0, .max = 1e12, .fallback = 1, .doc = "mobility mu",
     AT(mobility)},
    {.name = "temperature", .type = BCD_PARAM_NUMBER, .unit = "energy", .min = 0, .max = 1e12,
     .fallback = 1, .doc = "kT; 0 is the limit without noise", AT(temperature)},
    {.name = "boundary", .type = BCD_PARAM_CHOICE, .choice = boundary_word,
     .doc = "what holds the rods", AT(boundary)},
    {.name = "force", .type = BCD_PARAM_NUMBER, .unit = "energy/length", .min = -1e9, .max = 1e9,
     .doc = "constant drag force f on every rod", AT(force)},
    {.name = "method", .type = BCD_PARAM_CHOICE, .choice = method_word,
     .doc = "how rods are advanced", AT(method)},
    {.name = "tolerance", .type = BCD_PARAM_NUMBER, .min = 1e-5, .max = 0.1, .fallback = 0.005,
     .doc = "relative error from the time step that automatic choices aim at", AT(tolerance)},
    {.name = "time_step", .type = BCD_PARAM_AUTO, .above_min = true, .unit = "time", .min = 0,
     .max = 1e18, .fallback = NAN, .doc = "time step", AT(time_step)},
    {.name = "time_step_error", .type = BCD_PARAM_CHOICE, .choice = step_error_word,
     .doc = "whether part of the time goes into estimating what the time step does",
     AT(step_error)},
    {.name = "stability", .type = BCD_PARAM_CHOICE, .choice = stability_word,
     .doc = "\"ignored\": time steps known to be too long run all the same, and results say so",
     AT(stability)},
    {.name = "equilibration_time", .type = BCD_PARAM_NUMBER, .unit = "time", .min = 0,
     .max = 1e18, .doc = "discarded before measuring", AT(equilibration_time)},
    {.name = "time", .type = BCD_PARAM_NUMBER, .required = true, .above_min = true,
     .unit = "time", .min = 0, .max = 1e18, .doc = "measured time of each realization", AT(time)},
    {.name = "realizations", .type = BCD_PARAM_INTEGER, .min = 1, .max = 1e6, .fallback = 1,
     .doc = "independent runs, averaged", AT(realizations)},
    {.name = "sample_every", .type = BCD_PARAM_AUTO, .above_min = true, .unit = "time", .min = 0,
     .max = 1e18, .fallback = NAN, .doc = "time between samples of static observables",
     AT(sample_every)},
    {.name = "seed", .type = BCD_PARAM_INTEGER, .min = 0, .max = 9007199254740992.0,
     .fallback = 1, .doc = "seed of the noise", AT(seed)},
    {.name = "initial", .type = BCD_PARAM_CHOICE, .choice = initial_word,
     .doc = "initial configuration", AT(initial)},
    {0},
};
#undef AT

const struct bcd_param *bcd_job_params(void)
{
    return job_params;
}

/* ------------------------------------------------------------------- slots */

static const struct part_type *potential_at(size_t i)
{
    return potential_types[i] ? &potential_types[i]->base : NULL;
}

static const struct part_type *pair_at(size_t i)
{
    return pair_types[i] ? &pair_types[i]->base : NULL;
}

static const struct part_type *observable_at(size_t i)
{
    return observable_types[i] ? &observable_types[i]->base : NULL;
}

static const struct part_type *target_at(size_t i)
{
    return i == 0 ? &target_type : NULL;
}

static const struct {
    const char *key;
    bool many, typed;
    const struct part_type *(*at)(size_t index);
} slots[BCD_SLOT_COUNT] = {
    [BCD_SLOT_POTENTIAL] = {"potential", false, true, potential_at},
    [BCD_SLOT_INTERACTION] = {"interaction", false, true, pair_at},
    [BCD_SLOT_OBSERVABLE] = {"observables", true, false, observable_at},
    [BCD_SLOT_TARGET] = {"target", false, false, target_at},
};

const char *bcd_slot_key(enum bcd_slot slot)
{
    return slots[slot].key;
}

bool bcd_slot_many(enum bcd_slot slot)
{
    return slots[slot].many;
}

bool bcd_slot_typed(enum bcd_slot slot)
{
    return slots[slot].typed;
}

const struct bcd_part *bcd_catalogue(enum bcd_slot slot, size_t index)
{
    const struct part_type *type = slots[slot].at(index);
    return type ? &type->part : NULL;
}

/* ------------------------------------------------------------------- parts */

enum bcd_status bcd_scene_create(struct bcd_scene **out)
{
    struct bcd_scene *scene = calloc(1, sizeof *scene);
    if (!scene)
        return BCD_NO_MEMORY;
    group_init(&scene->group, job_params, &scene->job, "", NULL);
    *out = scene;
    return BCD_OK;
}

void bcd_scene_free(struct bcd_scene *scene)
{
    if (!scene)
        return;
    theory_sampler_free(scene->plan.sampler);
    for (size_t i = 0; i < scene->part_count; i++)
        scene_part_end(&scene->parts[i]);
    free(scene);
}

struct bcd_group *bcd_scene_job(struct bcd_scene *scene)
{
    return &scene->group;
}

const struct bcd_group *bcd_scene_job_view(const struct bcd_scene *scene)
{
    return &scene->group;
}

/* Where a part belongs in the catalogue's order; the slot's other parts are found on the way. */
static size_t place_for(const struct bcd_scene *scene, enum bcd_slot slot, int64_t index)
{
    size_t at = 0;
    while (at < scene->part_count &&
           (scene->parts[at].slot < slot ||
            (scene->parts[at].slot == slot && scene->parts[at].index < index)))
        at++;
    return at;
}

static bool slot_taken(const struct bcd_scene *scene, enum bcd_slot slot, int64_t index)
{
    for (size_t i = 0; i < scene->part_count; i++)
        if (scene->parts[i].slot == slot &&
            (!bcd_slot_many(slot) || scene->parts[i].index == index))
            return true;
    return false;
}

static void fault_unknown_type(enum bcd_slot slot, const char *type, struct bcd_errors *errors)
{
    char words[200] = "", field[96];
    size_t used = 0;
    for (size_t i = 0; bcd_catalogue(slot, i) && used < sizeof words; i++)
        used += (size_t)snprintf(words + used, sizeof words - used, "%s\"%s\"", i ? ", " : "",
                                 bcd_catalogue(slot, i)->name);
    if (bcd_slot_many(slot))
        snprintf(field, sizeof field, "/%s/%.60s", bcd_slot_key(slot), type);
    else
        snprintf(field, sizeof field, "/%s/type", bcd_slot_key(slot));
    bcd_errors_add(errors, field, "must be one of %s, not \"%.40s\"", words, type);
}

struct bcd_group *bcd_scene_add(struct bcd_scene *scene, enum bcd_slot slot, const char *type,
                                struct bcd_errors *errors)
{
    assert(!scene->complete);
    size_t index = 0;
    while (bcd_catalogue(slot, index) && strcmp(bcd_catalogue(slot, index)->name, type) != 0)
        index++;
    const struct bcd_part *part = bcd_catalogue(slot, index);
    if (!part) {
        fault_unknown_type(slot, type, errors);
        return NULL;
    }
    char pointer[64];
    snprintf(pointer, sizeof pointer, bcd_slot_many(slot) ? "/%s/%s" : "/%s", bcd_slot_key(slot),
             part->name);
    if (slot_taken(scene, slot, (int64_t)index) || scene->part_count == SCENE_PARTS_MAX) {
        bcd_errors_add(errors, pointer, "is given more than once");
        return NULL;
    }
    void *values = calloc(1, slots[slot].at(index)->par_size + 1);
    if (!values) {
        errors_no_memory(errors, pointer);
        return NULL;
    }
    size_t at = place_for(scene, slot, (int64_t)index);
    memmove(scene->parts + at + 1, scene->parts + at,
            (scene->part_count++ - at) * sizeof *scene->parts);
    scene->parts[at] = (struct scene_part){.slot = slot, .index = (int64_t)index};
    group_init(&scene->parts[at].group, part->params, values, pointer, part->name);
    return &scene->parts[at].group;
}

static const struct scene_part *part_at(const struct bcd_scene *scene, enum bcd_slot slot,
                                        size_t index)
{
    for (size_t i = 0; i < scene->part_count; i++)
        if (scene->parts[i].slot == slot && index-- == 0)
            return &scene->parts[i];
    return NULL;
}

const struct bcd_group *bcd_scene_part(const struct bcd_scene *scene, enum bcd_slot slot,
                                       size_t index)
{
    const struct scene_part *part = part_at(scene, slot, index);
    return part ? &part->group : NULL;
}

const struct scene_part *scene_observable(const struct bcd_scene *scene, size_t index)
{
    return part_at(scene, BCD_SLOT_OBSERVABLE, index);
}

/* -------------------------------------------------------------- completion */

enum bcd_status bcd_scene_complete(struct bcd_scene *scene, struct bcd_scene_cache *cache,
                                   struct bcd_errors *errors)
{
    struct bcd_errors own = {0};
    errors = errors ? errors : &own;
    group_check_required(&scene->group, errors);
    for (size_t i = 0; i < scene->part_count; i++)
        group_check_required(&scene->parts[i].group, errors);
    if (!scene_observable(scene, 0))
        bcd_errors_add(errors, "/observables", "is required: at least one observable");
    if (errors->count == 0)
        plan_make(scene, cache, errors);
    if (errors->count > 0)
        return errors_status(errors);
    plan_list_facts(scene);
    scene->complete = true;
    return BCD_OK;
}

enum bcd_status bcd_scene_prepare(struct bcd_scene *scene, struct bcd_watch *watch,
                                  struct bcd_errors *errors)
{
    assert(scene->complete);
    return plan_prepare(scene, watch, errors);
}

const struct bcd_fact *bcd_scene_fact(const struct bcd_scene *scene, size_t index)
{
    return index < scene->fact_count ? &scene->facts[index] : NULL;
}

/* ---------------------------------------------------------------- encoding */
/* One line a value: "<pointer>/<name> <type> <value>", numbers in hexadecimal, in row order. */

struct encoder {
    char *at;
    size_t size, used; /* used counts on when size is exhausted */
    uint64_t hash;     /* of all of it */
    bool family;       /* leave out how many realizations there are, and what tells it */
    bool equilibrium;  /* leave out all that equilibrium does not depend on */
};

static void encode_bytes(struct encoder *e, const char *bytes, size_t length)
{
    size_t room = e->used < e->size ? e->size - e->used : 0;
    if (room > 0)
        memcpy(e->at + e->used, bytes, length < room ? length : room);
    e->used += length;
    e->hash = blob_hash(bytes, length, e->hash);
}

static void encode_word(struct encoder *e, const char *word)
{
    encode_bytes(e, word, strlen(word));
}

/* Pieces of at most 255 characters. */
static void encode(struct encoder *e, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void encode(struct encoder *e, const char *format, ...)
{
    char piece[256];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(piece, sizeof piece, format, arguments);
    va_end(arguments);
    assert(length >= 0 && (size_t)length < sizeof piece);
    encode_bytes(e, piece, (size_t)length);
}

/* As %a, many times faster for what numbers usually are. */
static void encode_number(struct encoder *e, double value)
{
    uint64_t bits = to_bits(value), mantissa = bits & 0xfffffffffffffu;
    int exponent = (int)(bits >> 52 & 0x7ff);
    if (value != 0 && (exponent == 0 || exponent == 0x7ff)) {
        encode(e, "%a", value);
        return;
    }
    char piece[40] = "-0x", *at = piece + 3;
    *at++ = value == 0 ? '0' : '1';
    if (mantissa)
        *at++ = '.';
    for (; mantissa; mantissa = mantissa << 4 & 0xfffffffffffffu)
        *at++ = "0123456789abcdef"[mantissa >> 48];
    int power = value == 0 ? 0 : exponent - 1023;
    *at++ = 'p';
    *at++ = power < 0 ? '-' : '+';
    power = power < 0 ? -power : power;
    for (int unit = power >= 1000 ? 1000 : power >= 100 ? 100 : power >= 10 ? 10 : 1; unit > 0;
         unit /= 10)
        *at++ = (char)('0' + power / unit % 10);
    const char *start = piece + !(bits >> 63);
    encode_bytes(e, start, (size_t)(at - start));
}

static void encode_value(struct encoder *e, const struct bcd_group *group,
                         const struct bcd_param *row)
{
    const char *text = bcd_group_text(group, row);
    if (text) {
        encode_word(e, "text ");
        encode_word(e, text);
    } else if (row->type == BCD_PARAM_INTEGER) {
        encode(e, "integer %lld", (long long)bcd_group_integer(group, row));
    } else if (row->type == BCD_PARAM_NUMBERS) {
        struct bcd_numbers numbers = bcd_group_numbers(group, row);
        encode(e, "numbers %zu", numbers.count);
        for (size_t i = 0; i < numbers.count; i++) {
            encode_word(e, " ");
            encode_number(e, numbers.at[i]);
        }
    } else {
        encode_word(e, "number ");
        encode_number(e, bcd_group_number(group, row));
    }
}

/* What the equilibrium theory reads of a job's own rows (equilibrium.c). */
static bool row_left_out(const struct encoder *e, const struct bcd_group *group,
                         const struct bcd_param *row)
{
    static const size_t kept[] = {
        offsetof(struct job_par, particles), offsetof(struct job_par, length),
        offsetof(struct job_par, diameter),  offsetof(struct job_par, temperature),
        offsetof(struct job_par, boundary),  offsetof(struct job_par, force)};
    bool found = !e->equilibrium || group->type;
    for (size_t i = 0; i < sizeof kept / sizeof *kept; i++)
        found = found || row->offset == kept[i];
    return !found;
}

static bool part_left_out(const struct encoder *e, const struct scene_part *part)
{
    if (part->slot == BCD_SLOT_TARGET)
        return e->family || e->equilibrium;
    return e->equilibrium && part->slot == BCD_SLOT_OBSERVABLE &&
           !scene_observable_type(part)->want;
}

static void encode_group(struct encoder *e, const struct bcd_group *group)
{
    for (const struct bcd_param *row = group->rows; row->name; row++) {
        if (row_left_out(e, group, row))
            continue;
        encode_word(e, group->pointer);
        encode_word(e, "/");
        encode_word(e, row->name);
        encode_word(e, " ");
        if (e->family && row->offset == offsetof(struct job_par, realizations) && !group->type)
            encode_word(e, bcd_group_integer(group, row) > 1 ? "several" : "one");
        else
            encode_value(e, group, row);
        encode_word(e, "\n");
    }
}

static void encode_scene(struct encoder *e, const struct bcd_scene *scene)
{
    encode(e, "bcd result version %d\n", BCD_RESULT_VERSION);
    encode_group(e, &scene->group);
    for (size_t i = 0; i < scene->part_count; i++) {
        if (part_left_out(e, &scene->parts[i]))
            continue;
        encode(e, "%s type %s\n", scene->parts[i].group.pointer, scene->parts[i].group.type);
        encode_group(e, &scene->parts[i].group);
    }
}

size_t bcd_scene_encode(const struct bcd_scene *scene, void *bytes, size_t size)
{
    struct encoder e = {.at = bytes, .size = size};
    encode_scene(&e, scene);
    return e.used;
}

size_t bcd_scene_encode_family(const struct bcd_scene *scene, void *bytes, size_t size)
{
    struct encoder e = {.at = bytes, .size = size, .family = true};
    encode_scene(&e, scene);
    return e.used;
}

size_t bcd_scene_encode_equilibrium(const struct bcd_scene *scene, void *bytes, size_t size)
{
    struct encoder e = {.at = bytes, .size = size, .equilibrium = true};
    encode_scene(&e, scene);
    return e.used;
}

uint64_t scene_identity(const struct bcd_scene *scene)
{
    struct encoder e = {.hash = BLOB_HASH_START};
    encode_scene(&e, scene);
    return e.hash;
}

uint64_t scene_family(const struct bcd_scene *scene)
{
    struct encoder e = {.hash = BLOB_HASH_START, .family = true};
    encode_scene(&e, scene);
    return e.hash;
}

/* ------------------------------------------------------------------ chunks */

int64_t bcd_scene_chunks(const struct bcd_scene *scene)
{
    return scene->plan.chunks;
}

int64_t bcd_scene_realizations(const struct bcd_scene *scene, int64_t chunks)
{
    const struct plan *plan = &scene->plan;
    return chunks < plan->chunks ? chunks * plan->per_chunk : plan->realizations;
}
