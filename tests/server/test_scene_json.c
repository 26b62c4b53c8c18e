/* SPDX-License-Identifier: GPL-3.0-or-later
 * Jobs as JSON: what is read, what is refused and where, and that writing and reading again gives
 * the same job. */
#include "json_number.h"
#include "limits.h"
#include "scan_json.h"
#include "scene_json.h"
#include "text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REST "\"length\":20,\"diameter\":0.5,\"time\":10,\"observables\":{\"energy\":{}}"

static enum bcd_status parse(const char *text, struct bcd_scene **scene, struct bcd_errors *errors)
{
    *errors = (struct bcd_errors){0};
    return scene_json_parse(text, strlen(text), scene, errors);
}

static const struct bcd_error *fault_at(const struct bcd_errors *errors, const char *pointer)
{
    for (size_t i = 0; i < errors->count; i++)
        if (strcmp(errors->items[i].field, pointer) == 0)
            return &errors->items[i];
    return NULL;
}

/* The job is refused for this field and no other, in words that contain `words`. */
static void refused(const char *text, const char *pointer, const char *words)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors;
    enum bcd_status status = parse(text, &scene, &errors);
    if (status != BCD_INVALID || errors.count != 1 || !fault_at(&errors, pointer) ||
        !strstr(errors.items[0].text, words)) {
        print_error("%s\n", text);
        for (size_t i = 0; i < errors.count; i++)
            print_error("  %s: %s\n", errors.items[i].field, errors.items[i].text);
        fail_msg("expected one fault at \"%s\" with \"%s\"", pointer, words);
    }
    assert_null(scene);
}

static struct bcd_scene *accepted(const char *text)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors;
    if (parse(text, &scene, &errors) != BCD_OK)
        fail_msg("%s: %s: %s", text, errors.items[0].field, errors.items[0].text);
    return scene;
}

static char *encoded(const struct bcd_scene *scene, size_t *size)
{
    *size = bcd_scene_encode(scene, NULL, 0);
    char *bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(bcd_scene_encode(scene, bytes, *size + 1), *size);
    return bytes;
}

static void assert_same_job(const struct bcd_scene *a, const struct bcd_scene *b)
{
    size_t sizes[2];
    char *bytes[2] = {encoded(a, &sizes[0]), encoded(b, &sizes[1])};
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(bytes[0], bytes[1], sizes[0]);
    free(bytes[0]);
    free(bytes[1]);
}

static void test_round_trip(void **state)
{
    static const char *const jobs[] = {
        "{\"particles\":10," REST "}",
        "{\"particles\":1e1,\"seed\":9007199254740992," REST "}",
        "{\"particles\":50,\"length\":100,\"diameter\":0.1,\"temperature\":0.30000000000000004,"
        "\"force\":-1.7976931348623157e2,\"time\":5,\"time_step\":1e-3,\"method\":\"bcd\","
        "\"potential\":{\"type\":\"cosine\",\"amplitude\":6,\"wavelength\":0.1e1},"
        "\"observables\":{\"msd\":{\"first\":0.001,\"last\":1,\"points\":20},\"current\":{},"
        "\"density\":{\"bins\":50},\"cluster_sizes\":{}}}",
        " { \"particles\" : 5 , \"potential\" : null , " REST " } \n",
    };
    (void)state;
    for (size_t i = 0; i < sizeof jobs / sizeof *jobs; i++) {
        struct bcd_scene *first = accepted(jobs[i]);
        char *text = scene_json_job(first), *derived = scene_json_derived(first);
        struct bcd_scene *second = accepted(text);
        char *again = scene_json_job(second), *derived_again = scene_json_derived(second);
        assert_same_job(first, second);
        assert_string_equal(text, again);
        assert_string_equal(derived, derived_again);
        assert_non_null(strstr(derived, "\"diffusion\":"));
        free(text);
        free(again);
        free(derived);
        free(derived_again);
        bcd_scene_free(first);
        bcd_scene_free(second);
    }
}

/* Order of keys, spelling of numbers and defaults written out are the same job. */
static void test_spelling(void **state)
{
    (void)state;
    struct bcd_scene *a = accepted("{\"particles\":10," REST "}");
    struct bcd_scene *b = accepted(
        "{\"observables\":{\"energy\":{}},\"time\":1e1,\"diameter\":50e-2,\"length\":20.0,"
        "\"particles\":10.0,\"seed\":1,\"force\":-0.0,\"mobility\":1,\"model\":\"hard_rods\"}");
    assert_same_job(a, b);
    bcd_scene_free(a);
    bcd_scene_free(b);
}

static void test_printed(void **state)
{
    (void)state;
    struct bcd_scene *scene =
        accepted("{\"particles\":3,\"length\":2.0,\"time\":1e-3,\"observables\":{\"current\":{}},"
                 "\"potential\":{\"type\":\"cosine\",\"amplitude\":6}}");
    char *text = scene_json_job(scene);
    static const char *const pieces[] = {"{\"model\":\"hard_rods\",\"particles\":3,\"length\":2,",
                                         "\"diameter\":0,", "\"time\":0.001,",
                                         "\"potential\":{\"type\":\"cosine\",\"amplitude\":6,",
                                         "\"observables\":{\"current\":{}}"};
    for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++)
        if (!strstr(text, pieces[i]))
            fail_msg("%s is missing in %s", pieces[i], text);
    free(text);
    bcd_scene_free(scene);
}

static void test_not_json(void **state)
{
    (void)state;
    refused("", "", "line 1, column 0");
    refused("{\n  \"particles\": 10,\n  oops\n}", "", "line 3");
    refused("[]", "", "not a list");
    refused("null", "", "not null");
    refused("\"text\"", "", "not a text");
    refused("{\"particles\":10," REST "} x", "", "is not JSON");
    refused("{\"particles\":10," REST "", "", "is not JSON");
    refused("{\"particles\":\"\xff\"," REST "}", "", "is not JSON");
    refused("{\"particles\":01," REST "}", "", "is not JSON");
    refused("{'particles':1," REST "}", "", "is not JSON");
    refused("{\"a\\u0000b\":1," REST "}", "", "holds \\u0000 (line 1, column");
    refused("{\"method\":\"bcd\\u0000x\"," REST "}", "", "holds \\u0000 (line 1, column");
    refused("[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]", "", "deeper than 16");
    refused("{\"\\\"[[[[[[[[[[[[[[[[[[[[\":1," REST ",\"particles\":1}", "/\"[[[[[[[[[[[[[[[[[[[[",
            "unknown key");
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    assert_int_equal(scene_json_parse("{}\0", 3, &scene, &errors), BCD_INVALID);
    assert_string_equal(errors.items[0].field, "");
    /* No JSON at all can be told from a wrong job. */
    assert_int_equal(errors.items[0].code, BCD_CORRUPT);
    assert_int_equal(parse("[1]", &scene, &errors), BCD_INVALID);
    assert_int_equal(errors.items[0].code, BCD_INVALID);
}

/* A search for jumps must end where there is no number left between two others. */
static void test_tiny_period(void **state)
{
    (void)state;
    refused("{\"particles\":1,\"boundary\":\"walls\",\"potential\":{\"type\":\"expression\","
            "\"energy\":\"x^2\",\"period\":2.5e-323}," REST "}",
            "/potential/energy", "jump");
}

static void test_size_limit(void **state)
{
    (void)state;
    static const char job[] = "{\"particles\":10," REST "}";
    size_t size = LIMIT_BODY_BYTES_MAX;
    char *text = malloc(size + 1);
    assert_non_null(text);
    memset(text, ' ', size + 1);
    memcpy(text, job, sizeof job - 1);
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    assert_int_equal(scene_json_parse(text, size, &scene, &errors), BCD_OK);
    bcd_scene_free(scene);
    assert_int_equal(scene_json_parse(text, size + 1, &scene, &errors), BCD_INVALID);
    assert_non_null(strstr(errors.items[0].text, "larger than 1048576 bytes"));
    free(text);
}

static void test_numbers(void **state)
{
    (void)state;
    refused("{\"particles\":10,\"force\":1e400," REST "}", "/force", "1e400 is too large");
    refused("{\"particles\":10,\"force\":-1e400," REST "}", "/force", "too large");
    refused("{\"particles\":10,\"force\":1e-400," REST "}", "/force", "1e-400 is too close to 0");
    refused("{\"particles\":10,\"force\":-0.000001e-399,\"equilibration_time\":0.0000e5," REST "}",
            "/force", "too close to 0");
    refused("{\"particles\":100000000000000000000," REST "}", "/particles", "too large");
    refused("{\"particles\":10,\"force\":NaN," REST "}", "/force", "not NaN");
    refused("{\"particles\":10,\"force\":-Infinity," REST "}", "/force", "not -Infinity");
    refused("{\"particles\":10,\"force\":nan," REST "}", "/force", "not nan");
    refused("{\"particles\":2.5," REST "}", "/particles", "integer");
    refused("{\"particles\":1e16," REST "}", "/particles", "integer");
    refused("{\"particles\":0," REST "}", "/particles", "at least 1");
    refused("{\"particles\":-3," REST "}", "/particles", "-3");
    refused("{\"particles\":10,\"force\":[1,{\"a\":[2,3e999]}]," REST "}", "/force/1/a/1",
            "3e999 is too large");
    /* Subnormals are kept, so they are not refused for that. */
    bcd_scene_free(accepted("{\"particles\":10,\"force\":1e-310," REST "}"));
}

static void test_duplicates(void **state)
{
    (void)state;
    refused("{\"particles\":10,\"seed\":1,\"seed\":2," REST "}", "/seed", "more than once");
    refused("{\"particles\":10,\"seed\":1,\"s\\u0065ed\":1," REST "}", "/seed", "more than once");
    refused("{\"particles\":10,\"length\":20,\"time\":1,"
            "\"observables\":{\"msd\":{\"points\":3,\"points\":4}}}",
            "/observables/msd/points", "more than once");
    refused("{\"a/b\":{\"~\":[0,{\"x\":1,\"x\":1}]}}", "/a~1b/~0/1/x", "more than once");
}

static void test_unknown(void **state)
{
    (void)state;
    refused("{\"particles\":10,\"frobnicate\":1," REST "}", "/frobnicate",
            "unknown key; known are model");
    refused("{\"particles\":10,\"Temprature\":1," REST "}", "/Temprature", "\"temperature\"");
    refused("{\"particles\":10,\"potenial\":null," REST "}", "/potenial", "\"potential\"");
    refused("{\"particles\":10,\"a/~b\":1," REST "}", "/a~1~0b", "unknown key");
    refused("{\"particles\":10,\"\":1," REST "}", "/", "unknown key");
    refused("{\"particles\":10,\"length\":20,\"time\":1,\"observables\":{\"current\":{\"x\":1}}}",
            "/observables/current/x", "no parameters");
    refused("{\"particles\":10," REST ",\"potential\":{\"type\":\"cosine\",\"amplitud\":1,"
            "\"amplitude\":1}}",
            "/potential/amplitud", "\"amplitude\"");
    refused("{\"particles\":10," REST ",\"potential\":{\"type\":\"cosin\"}}", "/potential/type",
            "\"cosine\"");
    refused("{\"particles\":10,\"length\":20,\"time\":1,"
            "\"observables\":{\"energy\":{},\"a/b\":{}}}",
            "/observables/a~1b", "known are");
}

static void test_types(void **state)
{
    (void)state;
    refused("{\"particles\":\"ten\"," REST "}", "/particles", "integer");
    refused("{\"particles\":null," REST "}", "/particles", "must be an integer, not null");
    refused("{\"particles\":[1]," REST "}", "/particles", "must be an integer, not a list");
    refused("{\"particles\":10,\"method\":3," REST "}", "/method", "word");
    refused("{\"particles\":10,\"method\":\"guess\"," REST "}", "/method", "\"bcd\"");
    refused("{\"particles\":10,\"method\":{}," REST "}", "/method", "not an object");
    refused("{\"particles\":10,\"time_step\":true," REST "}", "/time_step",
            "a number or \"auto\", not true");
    refused("{\"particles\":10,\"force\":\"auto\"," REST "}", "/force", "number");
    refused("{\"particles\":10," REST ",\"potential\":\"cosine\"}", "/potential",
            "must be an object, not a text");
    refused("{\"particles\":10," REST ",\"potential\":{}}", "/potential/type", "must be one of");
    refused("{\"particles\":10," REST ",\"potential\":{\"type\":1}}", "/potential/type",
            "must be one of");
    refused("{\"particles\":10,\"length\":20,\"time\":1,\"observables\":{\"energy\":true}}",
            "/observables/energy", "such as {}");
}

/* Faults of reader and engine come in one list, all of them. */
static void test_all_at_once(void **state)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors;
    (void)state;
    assert_int_equal(parse("{\"particles\":-1,\"frobnicate\":1,\"length\":\"long\",\"seed\":1.5,"
                           "\"potential\":{\"amplitude\":3},"
                           "\"observables\":{\"msd\":{\"points\":0},\"mds\":{}}}",
                           &scene, &errors),
                     BCD_INVALID);
    static const char *const pointers[] = {"/particles",       "/frobnicate",
                                           "/length",          "/seed",
                                           "/potential/type",  "/observables/msd/points",
                                           "/observables/mds", "/time"};
    for (size_t i = 0; i < sizeof pointers / sizeof *pointers; i++)
        if (!fault_at(&errors, pointers[i]))
            fail_msg("no fault at %s", pointers[i]);
    assert_int_equal(errors.count, sizeof pointers / sizeof *pointers);
    assert_null(scene);
}

/* Very many and very long wrong keys: counted, cut between characters, and soon over. */
static void test_hostile_keys(void **state)
{
    (void)state;
    struct text text = {0};
    text_add(&text, "{\"");
    for (int i = 0; i < 5000; i++)
        text_add(&text, "\xE2\x82\xAC");
    text_add(&text, "\":1");
    for (int i = 0; i < 20000; i++)
        text_add(&text, ",\"temperature%d\":0", i);
    text_add(&text, "}");
    char *job = text_take(&text);
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors;
    assert_int_equal(parse(job, &scene, &errors), BCD_INVALID);
    assert_int_equal(errors.count, BCD_ERRORS_MAX);
    assert_true(errors.dropped > 19000);
    size_t length = strlen(errors.items[0].field);
    assert_true(length < SCAN_POINTER_SIZE);
    for (size_t i = 1, n; i < length; i += n) {
        n = text_utf8(errors.items[0].field + i);
        assert_int_equal(n, 3);
    }
    free(job);
}

static void test_number_text(void **state)
{
    static const struct {
        double v;
        const char *text;
    } cases[] = {{0, "0"},
                 {-0.0, "-0.0"},
                 {0.1, "0.1"},
                 {1, "1"},
                 {100, "100"},
                 {1e15, "1e+15"},
                 {1.0 / 3, "0.3333333333333333"},
                 {5e-324, "5e-324"},
                 {1e-310, "1e-310"},
                 {1.7976931348623157e308, "1.7976931348623157e+308"},
                 {NAN, "null"},
                 {INFINITY, "null"},
                 {123456789012345678.0, "1.2345678901234568e+17"},
                 {-2.5e-7, "-2.5e-07"},
                 {0.30000000000000004, "0.30000000000000004"}};
    char out[JSON_NUMBER_SIZE];
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(json_number_print(out, cases[i].v), strlen(cases[i].text));
        assert_string_equal(out, cases[i].text);
    }
    uint64_t bits = 88172645463325252u;
    for (int i = 0; i < 100000; i++) {
        double v;
        bits ^= bits << 13, bits ^= bits >> 7, bits ^= bits << 17;
        memcpy(&v, &bits, sizeof v);
        if (!isfinite(v))
            continue;
        assert_true(json_number_print(out, v) < JSON_NUMBER_SIZE);
        assert_true(strtod(out, NULL) == v);
    }
    /* Decimals of few digits take a short way, to the same text. */
    for (int i = 0; i < 100000; i++) {
        char plain[JSON_NUMBER_SIZE];
        bits ^= bits << 13, bits ^= bits >> 7, bits ^= bits << 17;
        double v = (double)((int64_t)(bits >> 20) % 2000003 - 1000001) / pow(10, i % 11 - 2);
        json_number_print(out, v);
        snprintf(plain, sizeof plain, "%.15g", v);
        assert_string_equal(out, plain);
    }
    /* So do those of 15 to 17 that need no exponent. */
    for (int i = 0; i < 100000; i++) {
        char plain[JSON_NUMBER_SIZE];
        bits ^= bits << 13, bits ^= bits >> 7, bits ^= bits << 17;
        double v = ldexp((double)(bits >> 11), -53 - i % 13) * (i % 3 ? 1e8 : 1);
        if (v < 1e-4 || v >= 1e9)
            continue;
        for (int digits = 15; digits == 15 || strtod(plain, NULL) != v; digits++)
            snprintf(plain, sizeof plain, "%.*g", digits, v);
        json_number_print(out, v);
        assert_string_equal(out, plain);
    }
    /* In a locale with a decimal comma, when there is one. */
    if (setlocale(LC_NUMERIC, "de_DE.UTF-8") || setlocale(LC_NUMERIC, "fr_FR.UTF-8")) {
        json_number_print(out, 1.5e-7);
        assert_string_equal(out, "1.5e-07");
        setlocale(LC_NUMERIC, "C");
    }
}

static void test_strings(void **state)
{
    (void)state;
    struct text text = {0};
    text_add_json_string(&text, "a\"b\\c\n\x01\xE2\x82\xAC\xFF\xC0\x80\xED\xA0\x80z");
    char *out = text_take(&text);
    assert_string_equal(out, "\"a\\\"b\\\\c\\u000a\\u0001\xE2\x82\xAC\xEF\xBF\xBD\xEF\xBF\xBD"
                             "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBDz\"");
    free(out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),  cmocka_unit_test(test_spelling),
        cmocka_unit_test(test_printed),     cmocka_unit_test(test_not_json),
        cmocka_unit_test(test_tiny_period), cmocka_unit_test(test_size_limit),
        cmocka_unit_test(test_numbers),     cmocka_unit_test(test_duplicates),
        cmocka_unit_test(test_unknown),     cmocka_unit_test(test_types),
        cmocka_unit_test(test_all_at_once), cmocka_unit_test(test_hostile_keys),
        cmocka_unit_test(test_number_text), cmocka_unit_test(test_strings),
    };
    return cmocka_run_group_tests_name("scene_json", tests, NULL, NULL);
}
