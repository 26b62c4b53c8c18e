/* SPDX-License-Identifier: GPL-3.0-or-later
 * Every registered method with every observable keeps the engine's promises: a run may be cut
 * anywhere, restored from a checkpoint, repeated, continued from that of a smaller job - and gives
 * the same bytes. */
#include "support/experiment.h"
#include "scene_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define ALL_OBSERVABLES                                                                            \
    "'observables': {'density': {'bins': 20}, 'contact_density': {'bins': 10, 'gap': 0.05},"       \
    " 'pair_distribution': {'bins': 15}, 'msd': {'points': 25}, 'energy': {}, 'current': {},"      \
    " 'cluster_sizes': {}}"

#define STATIC_OBSERVABLES "'observables': {'density': {'bins': 20}, 'energy': {}}"

/* One realization in blocks, with equilibration; several realizations in several chunks. */
static const char *const scenes[] = {
    "{'particles': 13, 'length': 20, 'diameter': 0.8, 'potential': {'type': 'cosine', 'amplitude': "
    "6}, 'force': 3, 'time_step': 1e-3, 'equilibration_time': 0.037, 'time': 1.5, 'method': '%s', "
    ALL_OBSERVABLES "}",
    "{'particles': 7, 'length': 9, 'diameter': 0.99, 'potential': {'type': 'cosine', 'amplitude': "
    "2, 'velocity': 0.5}, 'time_step': 1e-3, 'time': 0.4, 'realizations': 80, 'method': '%s', "
    "'initial': 'lattice', 'seed': 9007199254740992, " ALL_OBSERVABLES "}",
    "{'particles': 1, 'length': 3, 'diameter': 0.5, 'force': 1e3, 'time_step': 1e-2, 'time': 2000, "
    "'method': '%s', " ALL_OBSERVABLES "}", /* turns the ring many times: re-centred */
    "{'particles': 4, 'length': 2, 'diameter': 0.5, 'potential': {'type': 'cosine', 'amplitude': "
    "3}, 'time_step': 1e-3, 'time': 0.05, 'realizations': 2, 'method': '%s', "
    "'observables': {'density': {}, 'msd': {}, 'energy': {}, 'current': {}, 'cluster_sizes': {}}}",
    "{'particles': 6, 'length': 8, 'diameter': 0.7, 'initial': 'equilibrium', 'potential': {'type':"
    " 'cosine', 'amplitude': 8}, 'interaction': {'type': 'sticky', 'strength': 0.2, 'range': 0.1},"
    " 'time_step': 1e-5, 'time': 0.002, 'realizations': 70, 'method': '%s', " ALL_OBSERVABLES "}",
    "{'particles': 11, 'length': 14, 'diameter': 0.9, 'potential': {'type': 'cosine', 'amplitude': "
    "4}, 'time_step': 1e-3, 'equilibration_time': 0.01, 'time': 0.9, 'method': '%s', "
    STATIC_OBSERVABLES "}",
    "{'particles': 9, 'length': 11, 'diameter': 0.8, 'boundary': 'walls', 'force': 2, 'potential': "
    "{'type': 'cosine', 'amplitude': 3, 'wavelength': 0.7}, 'time_step': 1e-3, 'time': 0.6, "
    "'initial': 'equilibrium', 'method': '%s', " ALL_OBSERVABLES "}",
    "{'particles': 4, 'length': 5, 'diameter': 0.6, 'boundary': 'walls', 'interaction': {'type': "
    "'sticky', 'strength': 0.2, 'range': 0.1}, 'time_step': 1e-5, 'time': 0.002, 'realizations': "
    "70, 'method': '%s', " STATIC_OBSERVABLES "}",
    "{'particles': 5, 'length': 7, 'diameter': 0.4, 'time_step': 1e-2, 'time': 0.5, "
    "'realizations': 70, 'method': '%s', " STATIC_OBSERVABLES "}",
    "{'particles': 6, 'length': 8, 'diameter': 0.7, 'initial': 'equilibrium', 'potential': {'type':"
    " 'cosine', 'amplitude': 8}, 'interaction': {'type': 'sticky', 'strength': 0.5, 'range': 0},"
    " 'force': 0, 'time_step': 1e-3, 'time': 0.5, 'realizations': 70, 'method': '%s', "
    ALL_OBSERVABLES "}",
    "{'particles': 6, 'length': 8, 'diameter': 0.5, 'potential': {'type': 'table', 'period': 2, "
    "'values': [1, 0.2, -1, -0.1]}, 'interaction': {'type': 'yukawa', 'strength': 1, 'screening': "
    "2, 'cutoff': 1.5}, 'time_step': 5e-4, 'time': 0.1, 'realizations': 2, 'method': '%s', "
    STATIC_OBSERVABLES "}",
    "{'particles': 5, 'length': 6, 'diameter': 0.5, 'boundary': 'walls', 'potential': {'type': "
    "'expression', 'energy': '(x-3)^2/2 + sin(x)'}, 'force': 0.5, 'time_step': 1e-3, 'time': 0.4, "
    "'method': '%s', 'observables': {'density': {}, 'msd': {}, 'trajectory': {'every': 0.005}}}",
    "{'particles': 7, 'length': 8, 'diameter': 0.9, 'potential': {'type': 'fourier', 'cosine': "
    "[1], 'sine': [0, 0.5]}, 'time_step': 1e-4, 'time': 0.04, 'method': '%s', 'observables': "
    "{'contact_force': {}, 'current': {}}}",
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static const char *method_name(size_t i)
{
    const struct bcd_param *row = bcd_job_params();
    while (strcmp(row->name, "method") != 0)
        row++;
    return row->choice(i);
}

static struct bcd_scene *make(size_t scene, const char *method)
{
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    return experiment_scene(scenes[scene], method);
#pragma GCC diagnostic pop
}

/* Methods may refuse a scene, but only as themselves. */
static bool can_run(size_t scene, const char *method)
{
    char job[1200];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(job, sizeof job, scenes[scene], method);
#pragma GCC diagnostic pop
    for (char *c = job; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct bcd_errors errors = {0};
    struct bcd_scene *made = NULL;
    bool can = scene_json_parse(job, strlen(job), &made, &errors) == BCD_OK;
    if (!can) {
        assert_int_equal(errors.count, 1);
        assert_string_equal(errors.items[0].field, "/method");
    }
    bcd_scene_free(made);
    return can;
}

struct bytes {
    size_t size;
    void *at;
};

static struct bytes tally_bytes(const struct bcd_tally *tally)
{
    struct bytes b = {bcd_tally_size(tally), malloc(bcd_tally_size(tally))};
    assert_non_null(b.at);
    bcd_tally_save(tally, b.at);
    return b;
}

static struct bytes result_of(size_t scene, const char *method, int64_t slice)
{
    struct experiment e = experiment_run(make(scene, method), slice);
    struct bytes b = tally_bytes(e.tally);
    experiment_end(&e);
    return b;
}

static void for_all(void (*check)(size_t scene, const char *method))
{
    for (size_t m = 0; method_name(m); m++) {
        size_t ran = 0;
        for (size_t s = 0; s < SCENES; s++) {
            if (!can_run(s, method_name(m)))
                continue;
            check(s, method_name(m));
            ran++;
        }
        assert_true(ran > 0);
    }
}

static void check_slices(size_t scene, const char *method)
{
    struct bytes whole = result_of(scene, method, 0);
    static const int64_t slices[] = {1, 7, 100, 4099};
    for (size_t i = 0; i < sizeof slices / sizeof *slices; i++) {
        struct bytes cut = result_of(scene, method, slices[i]);
        assert_int_equal(cut.size, whole.size);
        assert_memory_equal(cut.at, whole.at, whole.size);
        free(cut.at);
    }
    free(whole.at);
}

static void test_slices_change_no_bit(void **state)
{
    (void)state;
    for_all(check_slices);
}

/* The last chunk, saved and restored into a fresh run at many ticks. */
static void check_checkpoints(size_t scene, const char *method)
{
    struct bcd_scene *s = make(scene, method);
    int64_t chunk = bcd_scene_chunks(s) - 1;
    struct bcd_run *whole = NULL, *run = NULL;
    assert_int_equal(bcd_run_create(&whole, s, chunk, NULL), BCD_OK);
    int64_t total = bcd_run_ticks_total(whole);
    assert_int_equal(bcd_run_advance(whole, total, NULL), BCD_OK);
    struct bytes expected = tally_bytes(bcd_run_tally(whole));

    assert_int_equal(bcd_run_create(&run, s, chunk, NULL), BCD_OK);
    size_t size = bcd_run_checkpoint_size(run);
    void *checkpoint = malloc(size);
    assert_non_null(checkpoint);
    for (int i = 0; bcd_run_ticks_done(run) < total; i++) {
        bcd_run_save(run, checkpoint);
        bcd_run_free(run);
        assert_int_equal(bcd_run_create(&run, s, chunk, NULL), BCD_OK);
        /* Leaves a trace that restoring must wipe out. */
        assert_int_equal(bcd_run_advance(run, i, NULL), BCD_OK);
        assert_int_equal(bcd_run_restore(run, checkpoint, size, NULL), BCD_OK);
        assert_int_equal(bcd_run_advance(run, total / 23 + 1, NULL), BCD_OK);
    }
    struct bytes cut = tally_bytes(bcd_run_tally(run));
    assert_int_equal(cut.size, expected.size);
    assert_memory_equal(cut.at, expected.at, cut.size);

    free(cut.at);
    free(expected.at);
    free(checkpoint);
    bcd_run_free(run);
    bcd_run_free(whole);
    bcd_scene_free(s);
}

static void test_checkpoints_change_no_bit(void **state)
{
    (void)state;
    for_all(check_checkpoints);
}

/* The scene with another number of realizations; NULL for those of a single one. */
static struct bcd_scene *make_with(size_t scene, const char *method, int64_t realizations)
{
    static const char key[] = "'realizations': ";
    const char *at = strstr(scenes[scene], key);
    char rest[1200];
    if (!at)
        return NULL;
    at += sizeof key - 1;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(rest, sizeof rest, at + strspn(at, "0123456789"), method);
#pragma GCC diagnostic pop
    return experiment_scene("%.*s%lld%s", (int)(at - scenes[scene]), scenes[scene],
                            (long long)realizations, rest);
}

static struct bytes chunk_of(struct bcd_scene *scene, int64_t chunk)
{
    struct bcd_run *run = NULL;
    assert_int_equal(bcd_run_create(&run, scene, chunk, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(run, bcd_run_ticks_total(run), NULL), BCD_OK);
    struct bytes b = tally_bytes(bcd_run_tally(run));
    bcd_run_free(run);
    return b;
}

/* Runs the chunk on from the tally of its beginning, through `stops` checkpoints. */
static struct bytes continue_from(struct bcd_scene *scene, int64_t chunk, struct bytes beginning,
                                  int64_t stops)
{
    struct bcd_tally *tally = NULL;
    struct bcd_run *run = NULL;
    assert_int_equal(bcd_tally_create(&tally, scene), BCD_OK);
    assert_int_equal(bcd_tally_restore(tally, beginning.at, beginning.size, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&run, scene, chunk, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(run, 3, NULL), BCD_OK); /* a trace to be wiped out */
    assert_int_equal(bcd_run_continue(run, tally, NULL), BCD_OK);
    size_t size = bcd_run_checkpoint_size(run);
    void *checkpoint = malloc(size);
    int64_t total = bcd_run_ticks_total(run), left = total - bcd_run_ticks_done(run);
    assert_true(left < total || bcd_tally_realizations(tally) == 0);
    for (int64_t i = 0; i < stops; i++) {
        assert_int_equal(bcd_run_advance(run, left / (stops + 1), NULL), BCD_OK);
        bcd_run_save(run, checkpoint);
        bcd_run_free(run);
        assert_int_equal(bcd_run_create(&run, scene, chunk, NULL), BCD_OK);
        assert_int_equal(bcd_run_restore(run, checkpoint, size, NULL), BCD_OK);
    }
    assert_int_equal(bcd_run_advance(run, total, NULL), BCD_OK);
    assert_int_equal(bcd_run_ticks_done(run), total);
    struct bytes b = tally_bytes(bcd_run_tally(run));
    free(checkpoint);
    bcd_run_free(run);
    bcd_tally_free(tally);
    return b;
}

/* A larger job begins as a smaller one does: whole chunks are the same, the last one goes on. */
static void check_continuation(size_t scene, const char *method)
{
    enum { LARGE = 77 };
    struct bcd_scene *large = make_with(scene, method, LARGE);
    if (!large)
        return;
    int64_t chunk = bcd_scene_chunks(large) - 1;
    int64_t first = bcd_scene_realizations(large, chunk);
    assert_int_equal(bcd_scene_realizations(large, chunk + 1), LARGE);
    struct bytes begin = chunk_of(large, 0), end = chunk_of(large, chunk);
    const int64_t counts[] = {first ? 1 : 2, (LARGE - first + 1) / 2, LARGE - first};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct bcd_scene *small = make_with(scene, method, first + counts[i]);
        struct bytes partial = chunk_of(small, chunk);
        struct bytes again = continue_from(large, chunk, partial, (int64_t)i);
        assert_memory_equal(again.at, end.at, end.size);
        free(again.at), free(partial.at);
        if (chunk > 0 && i == 0) {
            again = chunk_of(small, 0);
            assert_memory_equal(again.at, begin.at, begin.size);
            free(again.at);
        }
        bcd_scene_free(small);
    }
    free(begin.at), free(end.at);
    bcd_scene_free(large);
}

static void test_continuations_change_no_bit(void **state)
{
    (void)state;
    for_all(check_continuation);
}

static void test_strange_beginnings_are_refused(void **state)
{
    (void)state;
    struct bcd_scene *several = make_with(1, "bcd", 66), *more = make_with(1, "bcd", 80),
                     *other = make_with(3, "bcd", 2), *one = make(0, "bcd");
    struct bcd_scene *const wrong[] = {several, other, one};
    struct bcd_tally *tally = NULL, *blocks = NULL;
    struct bcd_error error;
    struct bytes b = chunk_of(more, 1), whole = chunk_of(one, 0);
    assert_int_equal(bcd_tally_create(&tally, more), BCD_OK);
    assert_int_equal(bcd_tally_restore(tally, b.at, b.size, NULL), BCD_OK);
    assert_int_equal(bcd_tally_realizations(tally), 16);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct bcd_run *run = NULL;
        int64_t chunk = bcd_scene_chunks(wrong[i]) - 1;
        assert_int_equal(bcd_run_create(&run, wrong[i], chunk, NULL), BCD_OK);
        assert_int_equal(bcd_run_continue(run, tally, &error), BCD_CORRUPT);
        assert_int_equal(bcd_run_advance(run, bcd_run_ticks_total(run), NULL), BCD_OK);
        struct bytes after = tally_bytes(bcd_run_tally(run)), plain = chunk_of(wrong[i], chunk);
        assert_memory_equal(after.at, plain.at, plain.size);
        free(after.at), free(plain.at);
        bcd_run_free(run);
    }
    struct bcd_run *run = NULL; /* blocks of one realization are no beginning of several */
    assert_int_equal(bcd_tally_create(&blocks, one), BCD_OK);
    assert_int_equal(bcd_tally_restore(blocks, whole.at, whole.size, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&run, one, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_continue(run, blocks, &error), BCD_CORRUPT);
    bcd_run_free(run);
    free(b.at), free(whole.at);
    bcd_tally_free(tally), bcd_tally_free(blocks);
    bcd_scene_free(several), bcd_scene_free(more), bcd_scene_free(other), bcd_scene_free(one);
}

static void test_seed_and_realization_matter(void **state)
{
    (void)state;
    const char *job = "{'particles': 5, 'length': 9, 'diameter': 0.5, 'time_step': 1e-3, 'time': "
                      "0.1, 'realizations': %d, 'seed': %d, 'observables': {'current': {}}}";
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    struct experiment a = experiment_run(experiment_scene(job, 1, 1), 0);
    struct experiment b = experiment_run(experiment_scene(job, 1, 2), 0);
    struct experiment c = experiment_run(experiment_scene(job, 2, 1), 0);
#pragma GCC diagnostic pop
    struct bcd_table *ta = experiment_table(&a, "current"), *tb = experiment_table(&b, "current"),
                     *tc = experiment_table(&c, "current");
    double one = column_of(ta, BCD_ROLE_VALUE)[0];
    assert_true(one != column_of(tb, BCD_ROLE_VALUE)[0]);
    assert_true(one != column_of(tc, BCD_ROLE_VALUE)[0]); /* the second realization differs */
    assert_true(column_of(tc, BCD_ROLE_STDERR)[0] > 0);
    bcd_table_free(ta), bcd_table_free(tb), bcd_table_free(tc);
    experiment_end(&a), experiment_end(&b), experiment_end(&c);
}

static void test_damaged_checkpoints_are_refused(void **state)
{
    (void)state;
    struct bcd_scene *s = make(1, "bcd"), *other = make(0, "bcd");
    struct bcd_run *run = NULL, *next = NULL, *stranger = NULL;
    struct bcd_error error;
    assert_int_equal(bcd_run_create(&run, s, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&next, s, 1, NULL), BCD_OK);
    assert_int_equal(bcd_run_create(&stranger, other, 0, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(run, 100, NULL), BCD_OK);
    size_t size = bcd_run_checkpoint_size(run);
    unsigned char *bytes = malloc(size);
    bcd_run_save(run, bytes);
    for (size_t at = 0; at < size; at += at < 64 ? 1 : 61) {
        bytes[at] ^= 0x10;
        assert_int_equal(bcd_run_restore(run, bytes, size, &error), BCD_CORRUPT);
        bytes[at] ^= 0x10;
    }
    for (size_t cut = 0; cut < size; cut += 37)
        assert_int_equal(bcd_run_restore(run, bytes, cut, NULL), BCD_CORRUPT);
    assert_int_equal(bcd_run_restore(next, bytes, size, &error), BCD_CORRUPT);
    assert_non_null(strstr(error.text, "another"));
    assert_int_equal(bcd_run_restore(stranger, bytes, size, NULL), BCD_CORRUPT);
    assert_int_equal(bcd_run_restore(run, bytes, size, NULL), BCD_OK);
    free(bytes);
    bcd_run_free(run), bcd_run_free(next), bcd_run_free(stranger);
    bcd_scene_free(s), bcd_scene_free(other);
}

static void test_tables_survive_storage(void **state)
{
    (void)state;
    struct experiment e = experiment_run(make(0, "bcd"), 0);
    for (size_t i = 0; bcd_scene_part(e.scene, BCD_SLOT_OBSERVABLE, i); i++) {
        struct bcd_table *table = NULL, *again = NULL;
        assert_int_equal(bcd_tally_table(e.tally, e.scene, e.theory, i, &table), BCD_OK);
        size_t size = bcd_table_size(table);
        unsigned char *bytes = malloc(size), *twice = malloc(size);
        bcd_table_save(table, bytes);
        assert_int_equal(bcd_table_load(&again, bytes, size, NULL), BCD_OK);
        assert_string_equal(again->name, table->name);
        assert_int_equal(again->rows, table->rows);
        assert_int_equal(again->columns, table->columns);
        for (size_t c = 0; c < table->columns; c++) {
            assert_string_equal(again->column[c].name, table->column[c].name);
            assert_int_equal(again->column[c].values != NULL, table->column[c].values != NULL);
            if (table->column[c].values)
                assert_memory_equal(again->column[c].values, table->column[c].values,
                                    table->rows * sizeof(double));
        }
        assert_int_equal(bcd_table_size(again), size);
        bcd_table_save(again, twice);
        assert_memory_equal(bytes, twice, size);
        bytes[size / 2] ^= 1;
        struct bcd_table *none = NULL;
        assert_int_equal(bcd_table_load(&none, bytes, size, NULL), BCD_CORRUPT);
        assert_null(none);
        free(bytes), free(twice);
        bcd_table_free(table), bcd_table_free(again);
    }
    experiment_end(&e);
}

/* What is not asked for is not there; the memory of a run shrinks with it. */
static void test_unasked_observables_cost_no_memory(void **state)
{
    (void)state;
    const char *job = "{'particles': 1000, 'length': 2000, 'time_step': 1e-4, 'time': 1, "
                      "'observables': {%s}}";
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    struct bcd_scene *little = experiment_scene(job, "'current': {}"),
                     *much = experiment_scene(job, "'current': {}, 'msd': {}");
#pragma GCC diagnostic pop
    struct bcd_estimate a, b;
    bcd_scene_estimate(little, &a);
    bcd_scene_estimate(much, &b);
    assert_true(a.run_bytes < 1000 * 100.0);
    assert_true(b.run_bytes > 2 * a.run_bytes);
    assert_null(bcd_scene_part(little, BCD_SLOT_OBSERVABLE, 1));
    bcd_scene_free(little), bcd_scene_free(much);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slices_change_no_bit),
        cmocka_unit_test(test_checkpoints_change_no_bit),
        cmocka_unit_test(test_continuations_change_no_bit),
        cmocka_unit_test(test_strange_beginnings_are_refused),
        cmocka_unit_test(test_seed_and_realization_matter),
        cmocka_unit_test(test_damaged_checkpoints_are_refused),
        cmocka_unit_test(test_tables_survive_storage),
        cmocka_unit_test(test_unasked_observables_cost_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
