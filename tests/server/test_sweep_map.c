/* SPDX-License-Identifier: GPL-3.0-or-later
 * Heat maps of sweeps: which cell has which colour, what is hatched, what is refused. */
#include "sweep_map.h"
#include "limits.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define SWEEP(axes)                                                                                \
    "{\"base\":{\"particles\":5,\"length\":10,\"time\":1,\"potential\":{\"type\":\"cosine\","      \
    "\"amplitude\":1},\"observables\":{\"energy\":{}}},\"axes\":{" axes "}}"
#define AXES                                                                                       \
    "\"/diameter\":[0.1,0.2,0.3],\"/potential/amplitude\":[1,5],\"/seed\":[1,2],\"/time\":[3,4]"

static struct sweep *parse(const char *json)
{
    struct bcd_errors errors = {0};
    struct ticket ticket = {.owner = "local"};
    struct sweep *sweep = NULL;
    assert_int_equal(sweep_json_parse(json, strlen(json), &sweep, &ticket, &errors), BCD_OK);
    ticket_fini(&ticket);
    return sweep;
}

static bool add(struct sweep_map *map, const char *place, double value, bool scalar)
{
    double values[2] = {value, 0.25};
    struct bcd_table table = {.scalar = scalar, .rows = 1, .columns = 2};
    struct sweep_point point = {.place = (char *)place};
    snprintf(table.name, sizeof(table.name), "energy");
    snprintf(table.y_label, sizeof(table.y_label), "energy <u>");
    table.column[0] = (struct bcd_column){.role = BCD_ROLE_VALUE, .values = &values[0]};
    table.column[1] = (struct bcd_column){.role = BCD_ROLE_STDERR, .values = &values[1]};
    return sweep_map_add(map, &point, &table);
}

static char *print(const struct sweep_map *map)
{
    char *svg = sweep_map_print(map, "energy");
    assert_non_null(svg);
    return svg;
}

static void has(const char *svg, const char *part)
{
    if (!strstr(svg, part))
        fail_msg("no %s in %s", part, svg);
}

static size_t count(const char *svg, const char *part)
{
    size_t found = 0;
    for (; (svg = strstr(svg, part)); svg++)
        found++;
    return found;
}

/* Three columns of 160, two rows of 240 pixels; the first value is left and low. */
static void cells(void **state)
{
    (void)state;
    struct bcd_errors errors = {0};
    struct sweep *sweep = parse(SWEEP(AXES));
    struct sweep_map *map =
        sweep_map_create(sweep, "/diameter", "/potential~1amplitude", false, &errors);
    assert_non_null(map);
    assert_true(add(map, "[0,0,0,0]", -4, true));
    assert_true(add(map, "[0,0,1,0]", -2, true)); /* another seed: the mean is -3 */
    assert_true(add(map, "[2,1,0,0]", 7, true));
    assert_true(add(map, "[1,0,0,0]", 2, true));
    assert_true(add(map, "[1,1,0,1]", 99, true)); /* another time is not in the picture */
    assert_false(sweep_map_wants(map, &(const struct sweep_point){.place = (char *)"[1,1,0,1]"}));
    assert_true(sweep_map_wants(map, &(const struct sweep_point){.place = (char *)"[1,1,1,0]"}));
    assert_false(add(map, "[0,0,0,0]", 1, false));
    char *svg = print(map);
    has(svg, "<rect x=\"96\" y=\"296\" width=\"160\" height=\"240\" fill=\"#440154\"><title>"
             "diameter = 0.1, potential/amplitude = 1: -3 \xC2\xB1 0.18 (2)</title>");
    has(svg, "<rect x=\"416\" y=\"56\" width=\"160\" height=\"240\" fill=\"#fde725\"><title>"
             "diameter = 0.3, potential/amplitude = 5: 7 \xC2\xB1 0.25 (1)</title>");
    has(svg, "<rect x=\"256\" y=\"296\" width=\"160\" height=\"240\" fill=\"#21918c\">");
    has(svg, "<rect x=\"256\" y=\"56\" width=\"160\" height=\"240\" fill=\"url(#none)\"><title>"
             "diameter = 0.2, potential/amplitude = 5: no result</title>");
    assert_int_equal(count(svg, "url(#none)"), 3);
    has(svg, "mean over seeds; time = 3; hatched: no result (3 of 6 cells)");
    has(svg, "energy &#60;u&#62;");
    assert_null(strstr(svg, "99"));
    free(svg);
    sweep_map_free(map);
    sweep_free(sweep);
}

/* Equal ratios are equal steps of colour; what has no logarithm has no colour. */
static void logarithmic(void **state)
{
    (void)state;
    struct bcd_errors errors = {0};
    struct sweep *sweep = parse(SWEEP(AXES));
    struct sweep_map *map =
        sweep_map_create(sweep, "/diameter", "/potential/amplitude", true, &errors);
    assert_non_null(map);
    assert_true(add(map, "[0,0,0,0]", 0, true));
    assert_true(add(map, "[1,0,0,0]", -2, true));
    char *svg = print(map);
    assert_int_equal(count(svg, "url(#low)"), 2); /* nothing has a colour */
    assert_null(strstr(svg, "class=\"scale\""));
    free(svg);
    assert_true(add(map, "[2,0,0,0]", 0.01, true));
    assert_true(add(map, "[0,1,0,0]", 1, true));
    assert_true(add(map, "[1,1,0,0]", 100, true));
    svg = print(map);
    has(svg, "<rect x=\"416\" y=\"296\" width=\"160\" height=\"240\" fill=\"#440154\">");
    has(svg, "<rect x=\"96\" y=\"56\" width=\"160\" height=\"240\" fill=\"#21918c\">");
    has(svg, "<rect x=\"256\" y=\"56\" width=\"160\" height=\"240\" fill=\"#fde725\">");
    has(svg, "fill=\"url(#low)\"><title>diameter = 0.2, potential/amplitude = 1: -2 ");
    has(svg, "logarithmic colours; dotted: not above 0 (2 of 6 cells); "
             "hatched: no result (1 of 6 cells)");
    has(svg, ">0.01</text>");
    has(svg, ">1</text>");
    has(svg, ">100</text>");
    free(svg);
    sweep_map_free(map);
    sweep_free(sweep);
}

/* Nothing, and one value, have a picture, too. */
static void next_to_nothing(void **state)
{
    (void)state;
    struct bcd_errors errors = {0};
    struct sweep *sweep = parse(SWEEP(AXES));
    struct sweep_map *map = sweep_map_create(sweep, NULL, "/diameter", false, &errors);
    assert_non_null(map);
    char *svg = print(map);
    assert_int_equal(count(svg, "url(#none)"), 6);
    has(svg, ">potential/amplitude<"); /* the first axis that is left */
    free(svg);
    add(map, "[1,1,0,0]", 1.5, true);
    add(map, "[1,0,0,0]", 0.0 / 0.0, true);
    svg = print(map);
    assert_int_equal(count(svg, "url(#none)"), 5);
    has(svg, ">1.5</text>");
    free(svg);
    sweep_map_free(map);
    sweep_free(sweep);
}

static void refused(const char *axes, const char *x, const char *y, const char *fault)
{
    struct bcd_errors errors = {0};
    struct sweep *sweep = parse(axes);
    assert_null(sweep_map_create(sweep, x, y, false, &errors));
    assert_int_equal(errors.count, 1);
    char told[400];
    snprintf(told, sizeof(told), "%s: %s", errors.items[0].field, errors.items[0].text);
    assert_string_equal(told, fault);
    sweep_free(sweep);
}

static void refusals(void **state)
{
    (void)state;
    refused(SWEEP(AXES), NULL, "/nix", "y: \"/nix\" is no axis of this sweep");
    refused(SWEEP(AXES), "/seed", "/time", "x: the map is of means over seeds");
    refused(SWEEP(AXES), "/time", "/time",
            "x: goes together with y: there are no pairs of their values");
    refused(SWEEP("\"/time\":[1,2]"), NULL, "/time", "x: there is no other axis of several values");
    refused("{\"base\":{\"particles\":5,\"length\":10,\"time\":1,\"observables\":{\"energy\":{}}},"
            "\"axes\":{\"/time\":[1,2],\"/length\":[10,20]},\"zip\":[[\"/time\",\"/length\"]]}",
            "/time", "/length", "x: goes together with y: there are no pairs of their values");
    refused(SWEEP("\"/time\":{\"from\":1,\"to\":2,\"points\":200},"
                  "\"/length\":{\"from\":10,\"to\":20,\"points\":51}"),
            "/time", "/length", "y: makes 10200 cells; LIMIT_MAP_CELLS_MAX is 10000");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cells),
        cmocka_unit_test(logarithmic),
        cmocka_unit_test(next_to_nothing),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
