/* SPDX-License-Identifier: GPL-3.0-or-later
 * A job's target: what it may say, the milestones, where it stops and why - from the job alone. */
#include "support/experiment.h"
#include "scene_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define RODS "'particles': 6, 'length': 8, 'diameter': 0.7, 'time_step': 1e-3, 'time': 1, "
#define FIELD "'potential': {'type': 'cosine', 'amplitude': 2}, 'initial': 'equilibrium', "
#define SEEN "'observables': {'energy': {}, 'density': {'bins': 8}, 'msd': {'points': 5}}"

static void assert_fault(const char *job, const char *field, const char *words)
{
    char text[1000];
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    size_t length = strlen(job);
    assert_true(length < sizeof text);
    for (size_t i = 0; i <= length; i++)
        text[i] = job[i] == '\'' ? '"' : job[i];
    assert_int_equal(scene_json_parse(text, length, &scene, &errors), BCD_INVALID);
    assert_int_equal(errors.count, 1);
    assert_string_equal(errors.items[0].field, field);
    if (!strstr(errors.items[0].text, words))
        fail_msg("%s", errors.items[0].text);
}

static void test_what_it_may_say(void **state)
{
    (void)state;
#define WITH(target) "{" RODS FIELD SEEN ", 'target': " target "}"
    assert_fault(WITH("{'observable': 'energy'}"), "/target/relative_error", "required");
    assert_fault(WITH("{'relative_error': 0.1}"), "/target/observable", "required");
    assert_fault(WITH("{'observable': 'current', 'relative_error': 0.1}"), "/target/observable",
                 "not among");
    assert_fault(WITH("{'observable': 'enery', 'relative_error': 0.1}"), "/target/observable",
                 "energy");
    assert_fault(WITH("{'observable': 'energy', 'relative_error': 0}"), "/target/relative_error",
                 "above 0");
    assert_fault(WITH("{'observable': 'energy', 'relative_error': 0.1, 'rod_steps': 100}"),
                 "/target/rod_steps", "at least 18000");
    assert_fault(WITH("{'observable': 'energy', 'relative_error': 0.1, 'type': 'x'}"),
                 "/target/type", "unknown");
    assert_fault(WITH("3"), "/target", "object");
    assert_fault("{" RODS FIELD SEEN ", 'realizations': 1, 'target': {'observable': 'energy', "
                 "'relative_error': 0.1}}", "/realizations", "2 at least");
    assert_fault("{" RODS "'observables': {'trajectory': {'every': 0.1}}, 'target': "
                 "{'observable': 'trajectory', 'relative_error': 0.1}}", "/target/observable",
                 "no error bar");
    struct bcd_scene *scene = experiment_scene("%s", WITH("null"));
    assert_null(bcd_scene_part(scene, BCD_SLOT_TARGET, 0));
    bcd_scene_free(scene);
}

/* Milestones of long realizations (a chunk each), and of short ones. */
static void test_milestones(void **state)
{
    (void)state;
    static const struct {
        const char *time;
        int64_t realizations, chunks[12];
    } cases[] = {
        {"1000", 50, {8, 12, 18, 27, 40, 50}}, {"1000", 12, {8, 12}}, {"1000", 3, {3}},
        {"1", 1000, {1, 2, 3, 4, 6, 9, 13, 16}}, /* 64 in a chunk */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bcd_scene *scene = experiment_scene(
            "{'particles': 6, 'length': 8, 'time_step': 1e-3, 'time': %s, 'realizations': %d, "
            SEEN ", 'target': {'observable': 'msd', 'relative_error': 0.1}}",
            cases[i].time, (int)cases[i].realizations);
        int64_t chunks = 0;
        for (size_t k = 0; k < 12 && cases[i].chunks[k]; k++) {
            assert_int_equal(bcd_scene_goal(scene, chunks), cases[i].chunks[k]);
            chunks = cases[i].chunks[k];
        }
        assert_int_equal(chunks, bcd_scene_chunks(scene));
        assert_int_equal(bcd_scene_goal(scene, chunks), chunks);
        assert_int_equal(bcd_scene_realizations(scene, chunks), cases[i].realizations);
        bcd_scene_free(scene);
    }
    struct bcd_scene *plain = experiment_scene("{" RODS "'realizations': 1000, " SEEN "}");
    assert_int_equal(bcd_scene_goal(plain, 0), 16);
    bcd_scene_free(plain);
}

/* The cap on cost: as many realizations as it pays for, pairs included. */
static void test_cost(void **state)
{
    (void)state;
    struct bcd_scene *scene = experiment_scene(
        "{" RODS FIELD "'method': 'bcd', 'observables': {'energy': {}}, 'target': {'observable': "
        "'energy', 'relative_error': 0.01, 'rod_steps': 65999}}");
    /* 6000 a realization, 3000 for each of the pairs 0, 1, 8: 9 cost 63000, 10 cost 69000. */
    assert_int_equal(bcd_scene_realizations(scene, bcd_scene_chunks(scene)), 9);
    struct bcd_estimate estimate;
    bcd_scene_estimate(scene, &estimate);
    assert_true(estimate.rod_steps == 63000);
    assert_true(experiment_fact(scene, "realizations_at_most") == 9);
    bcd_scene_free(scene);
}

/* Runs it as a server would. */
static struct bcd_verdict run(struct bcd_scene *scene, struct bcd_tally **tally)
{
    struct bcd_verdict verdict = {.stop = BCD_STOP_NOT};
    assert_int_equal(bcd_tally_create(tally, scene), BCD_OK);
    for (int64_t chunk = 0, goal = 0; verdict.stop == BCD_STOP_NOT;) {
        goal = bcd_scene_goal(scene, goal);
        for (; chunk < goal; chunk++) {
            struct bcd_run *r = NULL;
            assert_int_equal(bcd_run_create(&r, scene, chunk, NULL), BCD_OK);
            assert_int_equal(bcd_run_advance(r, bcd_run_ticks_total(r), NULL), BCD_OK);
            bcd_tally_merge(*tally, bcd_run_tally(r));
            bcd_run_free(r);
        }
        assert_int_equal(bcd_tally_judge(*tally, scene, &verdict), BCD_OK);
        assert_true(verdict.expected <= 1000);
    }
    return verdict;
}

static void assert_stops(const char *observable, const char *rest, enum bcd_stop why)
{
    struct bcd_scene *scene = experiment_scene(
        "{'particles': 4, 'length': 8, 'time_step': 2e-3, 'time': 20, 'initial': 'equilibrium', "
        "%s, 'target': {'observable': '%s', 'relative_error': 0.01}}", rest, observable);
    struct bcd_tally *tally = NULL;
    struct bcd_verdict verdict = run(scene, &tally);
    assert_string_equal(bcd_stop_name(verdict.stop), bcd_stop_name(why));
    assert_true((verdict.error <= 0.01) == (why == BCD_STOP_TARGET));
    assert_within(verdict.error, hypot(verdict.statistical, verdict.time_step), 0, 0, 1e-12);
    /* It is the job of so many realizations: same tables, to the bit. */
    struct experiment plain = experiment_run(experiment_scene(
        "{'particles': 4, 'length': 8, 'time_step': 2e-3, 'time': 20, 'initial': 'equilibrium', "
        "%s, 'realizations': %d}", rest, (int)verdict.realizations), 0);
    for (size_t i = 0; bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i); i++) {
        struct bcd_table *a = NULL, *b = NULL;
        assert_int_equal(bcd_tally_table(tally, scene, NULL, i, &a), BCD_OK);
        assert_int_equal(bcd_tally_table(plain.tally, plain.scene, NULL, i, &b), BCD_OK);
        size_t size = bcd_table_size(a);
        unsigned char *as = calloc(2, size);
        assert_int_equal(bcd_table_size(b), size);
        bcd_table_save(a, as), bcd_table_save(b, as + size);
        assert_memory_equal(as, as + size, size);
        free(as);
        bcd_table_free(a), bcd_table_free(b);
    }
    experiment_end(&plain);
    bcd_tally_free(tally);
    bcd_scene_free(scene);
}

static void test_where_it_stops(void **state)
{
    (void)state;
    assert_stops("energy", "'potential': {'type': 'cosine', 'amplitude': 4}, 'method': 'strang', "
                 "'observables': {'energy': {}, 'msd': {'last': 1, 'points': 4}}", BCD_STOP_TARGET);
    assert_stops("msd", "'method': 'strang', 'observables': {'msd': {'last': 3, 'points': 4}}",
                 BCD_STOP_TARGET);
    assert_stops("energy", "'diameter': 1.6, 'potential': {'type': 'cosine', 'amplitude': 4}, "
                 "'method': 'bcd', 'observables': {'energy': {}}", BCD_STOP_TIME_STEP);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_it_may_say),
        cmocka_unit_test(test_milestones),
        cmocka_unit_test(test_cost),
        cmocka_unit_test(test_where_it_stops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
