/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * baseline.c - what runs are measured against (bcd.h): the floor under every step's cost, and each
 * reduced scene written out by hand. The loops are inlined once for each scene with its features
 * known to the compiler, so that what a scene does not have costs nothing at all.
 */
#include "bcd.h"
#include "noise.h"
#include "kernels/attraction.h"
#include "kernels/histogram.h"
#include "kernels/isotonic.h"
#include "kernels/ring_sort.h"
#include "kernels/rods.h"
#include "kernels/wave.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void bcd_baseline_noise_and_force(double *y, int64_t n, int64_t ticks)
{
    enum { TILE = 512 };
    const struct noise_key key = {.seed = 1};
    const struct wave wave = {1, 0};
    const double step = 1e-4, noise = 0.014142135623730951, force = 6 / 2.0 * 6.283185307179586;
    struct noise source;
    _Alignas(ARENA_ALIGNMENT) unsigned char rows[NOISE_BYTES_MAX];
    struct arena scratch = {.bytes = rows};
    noise_layout(&source, n, 1, &scratch);
    for (int64_t t = 0; t < ticks; t++) {
        for (int64_t start = 0; start < n; start += TILE) {
            int64_t count = n - start < TILE ? arena_whole(n - start) : TILE;
            wave_add_sine(y + start, &(struct wave_line){y + start, count, 0, 0.5}, &wave,
                          step * force);
        }
        noise_add(&source, &key, t, noise, y);
    }
}

/* ----------------------------------------------------------- reduced scenes */

enum {
    FIELD = BCD_BASELINE_FIELD,
    DRAG = BCD_BASELINE_DRAG,
    STICKY = BCD_BASELINE_STICKY,
    DENSITY = BCD_BASELINE_DENSITY,
    BINS = 50,
    SAMPLE_STEPS = 20,
    STREAM_OF_VIEWS = 2,
};
static const double diameter = 0.5, amplitude = 6, drag_force = 1;

struct bcd_baseline {
    unsigned features;
    enum bcd_baseline_method method;
    int64_t n, tick;
    double ell, step, noise, growth, half_growth;
    struct attraction attraction; /* numbers of the job, not of the program */
    struct noise source, view_source;
    struct isotonic_block *blocks;
    double *y;       /* [n] */
    double *other;   /* [n], the next y; of strang the sort's scratch */
    double *middle;  /* [n], half way through a drift */
    double *view;    /* [n], within a step */
    int64_t *counts; /* [2][BINS] */
    struct arena arena;
};

static const struct {
    const char *name;
    unsigned features;
} scenes[] = {
    {"free", 0},        {"field", FIELD},     {"drag", DRAG},
    {"sticky", STICKY}, {"density", DENSITY}, {"all", FIELD | DRAG | STICKY | DENSITY},
};

const char *bcd_baseline_name(size_t index, unsigned *features)
{
    if (index >= sizeof scenes / sizeof *scenes)
        return NULL;
    *features = scenes[index].features;
    return scenes[index].name;
}

static void lay_out(struct bcd_baseline *b)
{
    const bool strang = b->method == BCD_BASELINE_STRANG;
    const bool sticky = (b->features & STICKY) != 0;
    const size_t rods = (size_t)arena_whole(b->n) * sizeof(double);
    struct arena *arena = &b->arena;
    arena->used = 0;
    noise_layout(&b->source, b->n, 1, arena);
    b->y = arena_take(arena, rods);
    b->other = strang || sticky ? arena_take(arena, rods) : NULL;
    b->blocks = !strang || b->features & (FIELD | STICKY)
                    ? arena_take(arena, isotonic_blocks(b->n) * sizeof *b->blocks)
                    : NULL;
    b->middle = strang && b->features & STICKY ? arena_take(arena, rods) : NULL;
    b->counts = b->features & DENSITY ? arena_take(arena, 2 * BINS * sizeof *b->counts) : NULL;
    if (!strang || !(b->features & DENSITY) || !(b->features & (FIELD | STICKY)))
        return;
    noise_layout(&b->view_source, b->n, SAMPLE_STEPS, arena);
    b->view = arena_take(arena, rods);
}

enum bcd_status bcd_baseline_create(struct bcd_baseline **out, unsigned features,
                                    enum bcd_baseline_method method, int64_t n)
{
    struct bcd_baseline *b = calloc(1, sizeof *b);
    if (!b)
        return BCD_NO_MEMORY;
    const double wave_number = 2 * M_PI;
    *b = (struct bcd_baseline){.features = features, .method = method, .n = n};
    b->ell = 2.0 * (double)n - (double)n * diameter;
    b->attraction = attraction_make(1, 0.05, 3);
    b->step = features & STICKY ? 1e-5 : 1e-4;
    b->noise = sqrt(2 * b->step);
    b->growth = exp_bounded(amplitude / 2 * wave_number * wave_number * b->step);
    b->half_growth = exp_bounded(amplitude / 2 * wave_number * wave_number * (b->step / 2));
    lay_out(b);
    b->arena.bytes = aligned_alloc(ARENA_ALIGNMENT, b->arena.used);
    if (!b->arena.bytes) {
        free(b);
        return BCD_NO_MEMORY;
    }
    memset(b->arena.bytes, 0, b->arena.used);
    lay_out(b);
    for (int64_t i = 0; i < n; i++)
        b->y[i] = 1 + b->ell / (double)n * (double)i;
    *out = b;
    return BCD_OK;
}

void bcd_baseline_free(struct bcd_baseline *b)
{
    if (!b)
        return;
    free(b->arena.bytes);
    free(b);
}

const int64_t *bcd_baseline_counts(const struct bcd_baseline *b)
{
    return b->counts;
}

size_t bcd_baseline_bytes(const struct bcd_baseline *b)
{
    return sizeof *b + b->arena.used;
}

/* ------------------------------------------------------------------- forces */

/* pairs/sticky.c */
static void add_attraction(const struct bcd_baseline *b, const double *y, double scale, double *out)
{
    const struct attraction attraction = b->attraction;
    const int64_t last = b->n - 1;
    for (int64_t i = 0; i < last; i++) {
        double gap = y[i + 1] - y[i];
        if (gap < attraction.range) {
            double f = scale * attraction_at(&attraction, gap);
            out[i] += f;
            out[i + 1] -= f;
        }
    }
    double gap = y[0] + b->ell - y[last];
    if (gap < attraction.range) {
        double f = scale * attraction_at(&attraction, gap);
        out[last] += f;
        out[0] -= f;
    }
}

#define INLINE static inline __attribute__((always_inline))

INLINE void add_forces(const struct bcd_baseline *b, const double *y, double scale, double *out,
                       const unsigned features)
{
    const struct wave wave = {1, 0};
    if (features & FIELD)
        wave_add_sine(out, &(struct wave_line){y, arena_whole(b->n), 0, diameter}, &wave,
                      scale * (amplitude / 2 * (2 * M_PI)));
    if (features & STICKY)
        add_attraction(b, y, scale, out);
    if (features & DRAG)
        rods_shift(out, scale * drag_force, arena_whole(b->n));
}

/* -------------------------------------------------------------------- loops */

/* Bins of one period of the field, of the whole ring without it. */
INLINE void count_bins(const struct bcd_baseline *b, const double *y, int64_t *counts,
                       const unsigned features)
{
    const double period = features & FIELD ? 1 : 2.0 * (double)b->n;
    const struct fold fold = {.inverse_period = 1 / period, .bins = BINS};
    histogram_add(counts, &fold, y, b->n, diameter);
}

INLINE void bcd_loop(struct bcd_baseline *b, int64_t ticks, const unsigned features)
{
    const struct noise_key key = {.seed = 1};
    for (int64_t t = 0; t < ticks; t++) {
        double *z = b->y;
        if (features & STICKY) { /* pairs see the old positions */
            z = b->other;
            memcpy(z, b->y, (size_t)arena_whole(b->n) * sizeof *z);
        }
        add_forces(b, b->y, b->step, z, features);
        noise_add(&b->source, &key, b->tick, b->noise, z);
        isotonic_ring(z, b->n, b->ell, b->blocks);
        b->other = z == b->y ? NULL : b->y;
        b->y = z;
        b->tick++;
        if (features & DENSITY && b->tick % SAMPLE_STEPS == 0)
            count_bins(b, b->y, b->counts, features);
    }
}

INLINE void strang_drift(struct bcd_baseline *b, double *y, bool half, const unsigned features)
{
    const struct wave wave = {1, 0};
    const double time = half ? b->step / 2 : b->step;
    if (features & STICKY) {
        memcpy(b->middle, y, (size_t)arena_whole(b->n) * sizeof *y);
        add_forces(b, y, time / 2, b->middle, features);
        isotonic_ring(b->middle, b->n, b->ell, b->blocks);
        add_forces(b, b->middle, time, y, features);
    } else {
        const double drag = features & FIELD ? drag_force * time / 2 : drag_force * time;
        if (features & DRAG)
            rods_shift(y, drag, arena_whole(b->n));
        if (features & FIELD)
            wave_flow(y, &(struct wave_line){y, arena_whole(b->n), 0, diameter}, &wave,
                      half ? b->half_growth : b->growth);
        if (features & DRAG && features & FIELD)
            rods_shift(y, drag, arena_whole(b->n));
    }
    if (features & (FIELD | STICKY))
        isotonic_ring(y, b->n, b->ell, b->blocks);
}

/* In the middle of a noise and in the middle of a drift (methods/strang.c). */
INLINE void strang_look(struct bcd_baseline *b, const unsigned features)
{
    const struct noise_key key = {.seed = 1, .stream = STREAM_OF_VIEWS};
    if (!(features & (FIELD | STICKY))) { /* exact as they are */
        count_bins(b, b->y, b->counts, features);
        return;
    }
    memcpy(b->view, b->y, (size_t)arena_whole(b->n) * sizeof *b->view);
    strang_drift(b, b->view, false, features);
    noise_add(&b->view_source, &key, b->tick, sqrt(b->step), b->view);
    ring_sort(b->view, b->n, b->ell, b->other);
    count_bins(b, b->view, b->counts, features);
    memcpy(b->view, b->y, (size_t)arena_whole(b->n) * sizeof *b->view);
    strang_drift(b, b->view, true, features);
    count_bins(b, b->view, b->counts + BINS, features);
}

void bcd_baseline_positions(struct bcd_baseline *b, double *x)
{
    const bool varies = (b->features & (FIELD | STICKY)) != 0;
    const double *from = b->y;
    if (b->method == BCD_BASELINE_STRANG && varies) {
        memcpy(b->other, b->y, (size_t)arena_whole(b->n) * sizeof *b->other);
        strang_drift(b, b->other, true, b->features);
        from = b->other;
    }
    memcpy(x, from, (size_t)b->n * sizeof *x);
    for (int64_t i = 0; i < b->n; i++)
        x[i] += (double)i * diameter;
}

INLINE void strang_loop(struct bcd_baseline *b, int64_t ticks, const unsigned features)
{
    const struct noise_key key = {.seed = 1};
    for (int64_t t = 0; t < ticks; t++) {
        strang_drift(b, b->y, false, features);
        noise_add(&b->source, &key, b->tick, b->noise, b->y);
        ring_sort(b->y, b->n, b->ell, b->other);
        b->tick++;
        if (features & DENSITY && b->tick % SAMPLE_STEPS == 0)
            strang_look(b, features);
    }
}

INLINE void advance(struct bcd_baseline *b, int64_t ticks, const unsigned features)
{
    if (b->method == BCD_BASELINE_STRANG)
        strang_loop(b, ticks, features);
    else
        bcd_loop(b, ticks, features);
}

void bcd_baseline_advance(struct bcd_baseline *b, int64_t ticks)
{
    switch (b->features) {
    case 0:
        advance(b, ticks, 0);
        break;
    case FIELD:
        advance(b, ticks, FIELD);
        break;
    case DRAG:
        advance(b, ticks, DRAG);
        break;
    case STICKY:
        advance(b, ticks, STICKY);
        break;
    case DENSITY:
        advance(b, ticks, DENSITY);
        break;
    default:
        advance(b, ticks, FIELD | DRAG | STICKY | DENSITY);
    }
}
