/* SPDX-License-Identifier: GPL-3.0-or-later
 * Means and squares of samples: one after another, merged from chunks, some of them missing. */
#include "support/experiment.h"
#include "tally.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { COUNT = 3, SAMPLES = 23 };

static struct bcd_scene *scene_of_three_values(void)
{
    return experiment_scene("{'particles': 2, 'length': 4, 'method': 'bcd', 'time_step': 0.1, "
                            "'time': 1, 'observables': {'density': {'bins': 3}}}");
}

/* Value i of a sample: off zero, of growing spread, the last one missing in every third sample and
 * in all of the first ten. */
static double value_of(int sample, int i)
{
    double value = 100 + i + (1 + sample) * sin(1.7 * sample + i);
    return i == 2 && (sample % 3 == 0 || sample < 10) ? NAN : value;
}

static void add_samples(struct bcd_tally *tally, int from, int to)
{
    for (int s = from; s < to; s++) {
        double values[COUNT];
        for (int i = 0; i < COUNT; i++)
            values[i] = value_of(s, i);
        tally_add(tally, values);
    }
}

static void check(const struct bcd_tally *tally)
{
    assert_int_equal(tally->count, COUNT);
    for (int i = 0; i < COUNT; i++) {
        double n = 0, sum = 0, square = 0;
        for (int s = 0; s < SAMPLES; s++)
            if (!isnan(value_of(s, i)))
                n += 1, sum += value_of(s, i);
        for (int s = 0; s < SAMPLES; s++)
            if (!isnan(value_of(s, i)))
                square += (value_of(s, i) - sum / n) * (value_of(s, i) - sum / n);
        assert_true(tally->samples[i] == n);
        assert_within(tally->mean[i], sum / n, 0, 0, 1e-11);
        assert_within(tally->square[i], square, 0, 0, 1e-11 * square);
    }
}

static void test_samples_one_after_another(void **state)
{
    (void)state;
    struct bcd_scene *scene = scene_of_three_values();
    struct bcd_tally *tally = NULL;
    assert_int_equal(bcd_tally_create(&tally, scene), BCD_OK);
    add_samples(tally, 0, SAMPLES);
    check(tally);
    bcd_tally_free(tally);
    bcd_scene_free(scene);
}

static void test_merged_chunks(void **state)
{
    (void)state;
    static const int ends[] = {7, 7, 9, 20, SAMPLES}; /* chunks of 7, 0, 2, 11 and 3 samples */
    struct bcd_scene *scene = scene_of_three_values();
    struct bcd_tally *whole = NULL;
    assert_int_equal(bcd_tally_create(&whole, scene), BCD_OK);
    for (size_t c = 0, from = 0; c < sizeof ends / sizeof *ends; from = (size_t)ends[c++]) {
        struct bcd_tally *chunk = NULL;
        assert_int_equal(bcd_tally_create(&chunk, scene), BCD_OK);
        add_samples(chunk, (int)from, ends[c]);
        bcd_tally_merge(whole, chunk);
        bcd_tally_free(chunk);
    }
    check(whole);
    bcd_tally_free(whole);
    bcd_scene_free(scene);
}

static void test_bytes(void **state)
{
    (void)state;
    struct bcd_scene *scene = scene_of_three_values();
    struct bcd_tally *tally = NULL, *again = NULL;
    assert_int_equal(bcd_tally_create(&tally, scene), BCD_OK);
    assert_int_equal(bcd_tally_create(&again, scene), BCD_OK);
    add_samples(tally, 0, SAMPLES);
    size_t size = bcd_tally_size(tally);
    unsigned char *bytes = malloc(size);
    assert_non_null(bytes);
    bcd_tally_save(tally, bytes);
    for (size_t at = 0; at < size; at++) {
        bytes[at] ^= 1;
        assert_int_equal(bcd_tally_restore(again, bytes, size, NULL), BCD_CORRUPT);
        assert_int_equal(bcd_tally_restore(again, bytes, at, NULL), BCD_CORRUPT);
        bytes[at] ^= 1;
    }
    assert_int_equal(bcd_tally_restore(again, bytes, size, NULL), BCD_OK);
    check(again);
    free(bytes);
    bcd_tally_free(tally), bcd_tally_free(again);
    bcd_scene_free(scene);
}

/* What a machine elsewhere may have made, with a checksum that is right. */
static void test_counts(void **state)
{
    (void)state;
    static const double none[] = {NAN, -1, 1e300, INFINITY};
    struct bcd_scene *scene = scene_of_three_values();
    struct bcd_tally *tally = NULL, *again = NULL;
    assert_int_equal(bcd_tally_create(&tally, scene), BCD_OK);
    assert_int_equal(bcd_tally_create(&again, scene), BCD_OK);
    add_samples(tally, 0, SAMPLES);
    unsigned char *bytes = malloc(bcd_tally_size(tally));
    assert_non_null(bytes);
    double *const counts[] = {tally->realizations, &tally->samples[0], &tally->samples[2]};
    for (size_t i = 0; i < 3; i++) {
        double kept = *counts[i];
        for (size_t k = 0; k < sizeof none / sizeof *none; k++) {
            *counts[i] = none[k];
            bcd_tally_save(tally, bytes);
            assert_int_equal(bcd_tally_restore(again, bytes, bcd_tally_size(tally), NULL),
                             BCD_CORRUPT);
        }
        *counts[i] = kept;
    }
    bcd_tally_save(tally, bytes);
    assert_int_equal(bcd_tally_restore(again, bytes, bcd_tally_size(tally), NULL), BCD_OK);
    free(bytes);
    bcd_tally_free(tally), bcd_tally_free(again);
    bcd_scene_free(scene);
}

/* Bytes that identify a job tell any two values of any parameter apart. */
static void test_identity(void **state)
{
    (void)state;
    static const char *const jobs[] = {
        "'seed': 1",
        "'seed': 4294967297",
        "'seed': 9007199254740992",
        "'seed': 9007199254740991",
        "'force': 1",
        "'force': 1.0000000000000002",
        "'time_step': 0.0625",
        "'initial': 'lattice'",
        "'method': 'bcd'",
        "'potential': {'type': 'cosine', 'amplitude': 0, 'wavelength': 2}",
        "'potential': {'type': 'cosine', 'amplitude': 0, 'wavelength': 4}",
    };
    enum { JOBS = sizeof jobs / sizeof *jobs };
    static char text[JOBS][8192];
    for (size_t i = 0; i < JOBS; i++) {
        struct bcd_scene *scene = experiment_scene(
            "{'particles': 2, 'length': 4, 'time': 1, %s, 'observables': {'current': {}}}",
            jobs[i]);
        size_t length = bcd_scene_encode(scene, text[i], sizeof text[i]);
        assert_in_range(length, 100, sizeof text[i] - 1);
        char cut[40];
        memset(cut, '#', sizeof cut);
        assert_int_equal(bcd_scene_encode(scene, cut, 20), length); /* counts on, writes no more */
        assert_true(cut[20] == '#' && memcmp(cut, text[i], 19) == 0);
        for (size_t j = 0; j < i; j++)
            assert_string_not_equal(text[i], text[j]);
        bcd_scene_free(scene);
    }
}

static void encode_job(char *text, size_t size, const char *observables)
{
    struct bcd_scene *scene = experiment_scene(
        "{'particles': 2, 'length': 4, 'time': 1, 'observables': {%s}}", observables);
    assert_in_range(bcd_scene_encode(scene, text, size), 100, size - 1);
    bcd_scene_free(scene);
}

/* The same job in other words: another order of its parts, a default spelt out. */
static void test_identity_of_the_same_job(void **state)
{
    (void)state;
    static char one[8192], other[8192];
    encode_job(one, sizeof one, "'msd': {}, 'density': {'bins': 50}, 'current': {}");
    encode_job(other, sizeof other, "'current': {}, 'density': {}, 'msd': {'points': 40}");
    assert_string_equal(one, other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_samples_one_after_another),
        cmocka_unit_test(test_merged_chunks),
        cmocka_unit_test(test_bytes),
        cmocka_unit_test(test_counts),
        cmocka_unit_test(test_identity),
        cmocka_unit_test(test_identity_of_the_same_job),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
