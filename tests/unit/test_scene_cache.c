/* SPDX-License-Identifier: GPL-3.0-or-later
 * A cache changes the time that a scene's completion takes, and no bit of the scene; what is made
 * by bcd_scene_prepare is made there alone. */
#include "../../engine/scene.h"
#include "scene_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char *const potentials[] = {
    "",
    ",\"potential\":{\"type\":\"cosine\",\"amplitude\":%g}",
    ",\"potential\":{\"type\":\"fourier\",\"cosine\":[%g,0.3]}",
    ",\"potential\":{\"type\":\"table\",\"period\":1,\"values\":[0,%g,2,-1]}",
    ",\"potential\":{\"type\":\"expression\",\"energy\":\"cos(2*pi*x)+%g\",\"period\":1}",
};
static const char *const interactions[] = {
    "",
    ",\"interaction\":{\"type\":\"sticky\",\"strength\":%g,\"range\":0.05,\"exponent\":3}",
    ",\"interaction\":{\"type\":\"yukawa\",\"strength\":%g,\"screening\":1,\"cutoff\":3}",
};
enum { POTENTIALS = sizeof potentials / sizeof *potentials };
enum { INTERACTIONS = sizeof interactions / sizeof *interactions, VARIANTS = 6 };

struct variant {
    int potential, interaction;
    double amplitude, strength, diameter, length;
    bool walls;
};

static enum bcd_status make(const struct variant *v, struct bcd_scene_cache *cache,
                            struct bcd_scene **scene)
{
    char text[2048];
    int used = snprintf(text, sizeof text,
                        "{\"particles\":8,\"length\":%g,\"diameter\":%g,\"time\":1,\"boundary\":"
                        "\"%s\",\"observables\":{\"density\":{},\"msd\":{}}",
                        v->length, v->diameter, v->walls ? "walls" : "periodic");
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
#pragma GCC diagnostic ignored "-Wformat-security"
    used +=
        snprintf(text + used, sizeof text - (size_t)used, potentials[v->potential], v->amplitude);
    used += snprintf(text + used, sizeof text - (size_t)used, interactions[v->interaction],
                     v->strength);
#pragma GCC diagnostic pop
    used += snprintf(text + used, sizeof text - (size_t)used, "}");
    assert_true((size_t)used < sizeof text);
    return scene_json_complete(text, (size_t)used, cache, scene, NULL);
}

static void assert_same(const struct bcd_scene *a, const struct bcd_scene *b)
{
    const struct plan *p = &a->plan, *q = &b->plan;
    char *one = scene_json_derived(a), *other = scene_json_derived(b);
    assert_string_equal(one, other);
    free(one);
    free(other);
    one = scene_json_job(a), other = scene_json_job(b);
    assert_string_equal(one, other);
    free(one);
    free(other);
    assert_true(scene_identity(a) == scene_identity(b));
    assert_memory_equal(&p->slope, &q->slope, sizeof p->slope);
    assert_memory_equal(&p->barrier, &q->barrier, sizeof p->barrier);
    assert_memory_equal(&p->press, &q->press, sizeof p->press);
    assert_memory_equal(&p->stiffness, &q->stiffness, sizeof p->stiffness);
    assert_memory_equal(&p->time_step, &q->time_step, sizeof p->time_step);
    assert_true(p->field == q->field && p->method == q->method && p->pair == q->pair);
    for (double x = 0.01; p->field && x < 3; x += 0.37)
        assert_true(plan_energy(p, x) == plan_energy(q, x));
    for (double r = 0.01; r < 3; r += 0.17)
        assert_true(bcd_scene_pair_force(a, r) == bcd_scene_pair_force(b, r));
}

/* The n-th scene of a walk through neighbours: one thing changes at a time, and comes back. */
static struct variant variant_at(int n)
{
    return (struct variant){.potential = n / VARIANTS % POTENTIALS,
                            .interaction = n / VARIANTS / POTENTIALS % INTERACTIONS,
                            .amplitude = n % VARIANTS == 1 ? 3 : 2,
                            .strength = n % VARIANTS == 2 ? 0.5 : 1,
                            .diameter = n % VARIANTS == 3 ? 0.5 : 0.25,
                            .length = n % VARIANTS == 4 ? 18 : 20,
                            .walls = n % VARIANTS == 5};
}

static void test_scenes_are_the_same_with_and_without_a_cache(void **state)
{
    (void)state;
    struct bcd_scene_cache *cache = NULL;
    int made = 0;
    assert_int_equal(bcd_scene_cache_create(&cache), BCD_OK);
    for (int n = 0; n < 2 * VARIANTS * POTENTIALS * INTERACTIONS; n++) {
        struct variant variant = variant_at(n);
        struct bcd_scene *plain = NULL, *cached = NULL;
        enum bcd_status status = make(&variant, NULL, &plain);
        assert_int_equal(make(&variant, cache, &cached), status);
        made += status == BCD_OK;
        if (status == BCD_OK)
            assert_same(plain, cached);
        bcd_scene_free(plain);
        bcd_scene_free(cached);
    }
    assert_true(made > 100);
    bcd_scene_cache_free(cache);
}

/* It forgets what is old, and scenes outlive it. */
static void test_more_potentials_than_it_holds(void **state)
{
    (void)state;
    enum { SCENES = 3000, KEPT = 40 };
    struct bcd_scene_cache *cache = NULL;
    struct bcd_scene *kept[KEPT] = {NULL};
    assert_int_equal(bcd_scene_cache_create(&cache), BCD_OK);
    for (int n = 0; n < SCENES; n++) {
        struct variant variant = {.potential = 1, .interaction = 1, .length = 20};
        variant.amplitude = variant.strength = 1 + n * 1e-3;
        struct bcd_scene *scene = NULL;
        assert_int_equal(make(&variant, cache, &scene), BCD_OK);
        assert_true(scene->plan.barrier > 0.99 * variant.amplitude &&
                    scene->plan.barrier < 1.01 * variant.amplitude);
        if (n % (SCENES / KEPT) == 0 && n / (SCENES / KEPT) < KEPT)
            kept[n / (SCENES / KEPT)] = scene;
        else
            bcd_scene_free(scene);
    }
    bcd_scene_cache_free(cache);
    for (int i = 0; i < KEPT; i++) {
        struct variant variant = {.potential = 1, .interaction = 1, .length = 20};
        variant.amplitude = variant.strength = 1 + i * (SCENES / KEPT) * 1e-3;
        struct bcd_scene *plain = NULL;
        assert_int_equal(make(&variant, NULL, &plain), BCD_OK);
        assert_same(plain, kept[i]);
        bcd_scene_free(plain);
        bcd_scene_free(kept[i]);
    }
}

static void test_samplers_are_made_by_prepare(void **state)
{
    (void)state;
    static const char job[] =
        "{\"particles\":4,\"length\":8,\"diameter\":0.5,\"time\":1,\"initial\":"
        "\"equilibrium\",\"observables\":{\"density\":{}},\"realizations\":2}";
    struct bcd_scene *scene = NULL;
    assert_int_equal(scene_json_complete(job, sizeof job - 1, NULL, &scene, NULL), BCD_OK);
    assert_null(scene->plan.sampler);
    assert_int_equal(bcd_scene_prepare(scene, NULL, NULL), BCD_OK);
    assert_non_null(scene->plan.sampler);
    assert_ptr_equal(scene->plan.sampler, scene->coarse.sampler);
    assert_int_equal(bcd_scene_prepare(scene, NULL, NULL), BCD_OK); /* once is enough */
    bcd_scene_free(scene);
}

/* Wells 2400 kT deep pass the quick checks; that their equilibrium cannot be drawn shows here. */
static void test_what_only_prepare_finds(void **state)
{
    (void)state;
    static const char job[] =
        "{\"particles\":4,\"length\":8,\"diameter\":0.5,\"time\":1,\"initial\":\"equilibrium\","
        "\"potential\":{\"type\":\"cosine\",\"amplitude\":2400},\"interaction\":{\"type\":"
        "\"yukawa\","
        "\"strength\":400,\"screening\":1,\"cutoff\":3},\"observables\":{\"density\":{}}}";
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    assert_int_equal(scene_json_complete(job, sizeof job - 1, NULL, &scene, &errors), BCD_OK);
    assert_int_equal(bcd_scene_prepare(scene, NULL, &errors), BCD_INVALID);
    assert_int_equal(errors.count, 1);
    assert_string_equal(errors.items[0].field, "/initial");
    bcd_scene_free(scene);
    scene = NULL;
    assert_int_equal(scene_json_parse(job, sizeof job - 1, &scene, &errors), BCD_INVALID);
    assert_null(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scenes_are_the_same_with_and_without_a_cache),
        cmocka_unit_test(test_more_potentials_than_it_holds),
        cmocka_unit_test(test_samplers_are_made_by_prepare),
        cmocka_unit_test(test_what_only_prepare_finds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
