/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_report_scenes.c - see cli_report_scenes.h. */
#include "cli_report_scenes.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SYSTEM_LENGTH = 100, AMPLITUDE = 6, BINS = 50, LAGS = 31 };
#define STICKY_RANGE 0.05
#define STICKY_EXPONENT 2.95

#define SOURCE_2022 "Phys. Rev. E 106, 054606 (2022)"
#define SOURCE_2024 "Comput. Phys. Commun. 309, 109474 (2024)"

static const struct report_figure figures[] = {
    {.number = 3,
     .year = 2022,
     .source = SOURCE_2022,
     .method = "bcd",
     .title = "Density of hard rods",
     .columns = 3,
     .observable = {"density"}},
    {.number = 4,
     .year = 2022,
     .source = SOURCE_2022,
     .method = "bcd",
     .title = "Contact density of hard rods",
     .columns = 3,
     .observable = {"contact_density"},
     .gap = 0.02},
    {.number = 6,
     .year = 2022,
     .source = SOURCE_2022,
     .method = "bcd",
     .title = "Density and contact density of sticky rods",
     .columns = 3,
     .observable = {"density", "contact_density"},
     .gap = STICKY_RANGE},
    {.number = 7,
     .year = 2024,
     .source = SOURCE_2024,
     .method = "auto",
     .title = "Mean squared displacement of sticky rods",
     .columns = 2,
     .observable = {"msd"}},
};

/* Method bcd treats rods as shorter by 1.165 sqrt(D h): contact densities need smaller steps h than
 * densities. With stickiness h must resolve the attraction as well, whose slope grows with gamma.
 * Where pairs in contact are rare (low density; sigma of half a wavelength, which keeps neighbours
 * from sharing a well) there are more realizations rather than longer ones. */
#define SHORT(step, duration, runs)                                                                \
    .effort[0] = {.time_step = step, .time = duration, .realizations = runs}
#define FULL(step, duration, runs)                                                                 \
    .effort[1] = {.time_step = step, .time = duration, .realizations = runs}
#define DENSITY .figure = 3, SHORT(5e-5, 20, 16), FULL(1e-5, 1000, 10)
#define RARE_20 .figure = 4, SHORT(4e-6, 1, 256), FULL(1e-6, 50, 80)
#define RARE_50 .figure = 4, SHORT(4e-6, 1, 128), FULL(1e-6, 50, 40)
#define RARE_80 .figure = 4, SHORT(4e-6, 1, 80), FULL(1e-6, 50, 40)
#define CONTACT_20 .figure = 4, SHORT(4e-6, 1.25, 128), FULL(1e-6, 50, 40)
#define CONTACT_50 .figure = 4, SHORT(4e-6, 1, 64), FULL(1e-6, 50, 20)
#define CONTACT_80 .figure = 4, SHORT(4e-6, 1, 40), FULL(1e-6, 50, 20)
#define STICKY_50 .figure = 6, SHORT(4e-6, 1, 64), FULL(1e-6, 50, 20)
#define STICKY_80 .figure = 6, SHORT(4e-6, 1, 40), FULL(1e-6, 50, 20)
#define VERY_STICKY .figure = 6, SHORT(2e-6, 0.75, 40), FULL(5e-7, 25, 20)
/* The step of sticky dynamics has to resolve the attraction: 9e-6 (gamma 1), 2e-6 (10). */
#define MSD(step, duration, runs, lag)                                                             \
    {.time_step = step, .time = duration, .realizations = runs, .last = lag}
#define SLIDING .figure = 7, .effort = {MSD(0, 3000, 6, 1000), MSD(0, 10000, 10, 1000)}
#define STICKING .figure = 7, .effort = {MSD(0, 20, 8, 10), MSD(0, 2000, 10, 500)}
#define CLUSTERING .figure = 7, .effort = {MSD(0, 8, 6, 4), MSD(0, 500, 8, 100)}

static const struct report_scene scenes[] = {
    {.diameter = 0.2, .density = 0.2, DENSITY},
    {.diameter = 0.2, .density = 0.5, DENSITY},
    {.diameter = 0.2, .density = 0.8, DENSITY},
    {.diameter = 0.5, .density = 0.2, DENSITY},
    {.diameter = 0.5, .density = 0.5, DENSITY},
    {.diameter = 0.5, .density = 0.8, DENSITY},
    {.diameter = 0.8, .density = 0.2, DENSITY},
    {.diameter = 0.8, .density = 0.5, DENSITY},
    {.diameter = 0.8, .density = 0.8, DENSITY},
    {.diameter = 0.2, .density = 0.2, CONTACT_20},
    {.diameter = 0.2, .density = 0.5, CONTACT_50},
    {.diameter = 0.2, .density = 0.8, CONTACT_80},
    {.diameter = 0.5, .density = 0.2, RARE_20},
    {.diameter = 0.5, .density = 0.5, RARE_50},
    {.diameter = 0.5, .density = 0.8, RARE_80},
    {.diameter = 0.8, .density = 0.2, CONTACT_20},
    {.diameter = 0.8, .density = 0.5, CONTACT_50},
    {.diameter = 0.8, .density = 0.8, CONTACT_80},
    {.diameter = 0.5, .density = 0.5, .stickiness = 0.1, STICKY_50},
    {.diameter = 0.5, .density = 0.5, .stickiness = 1, STICKY_50},
    {.diameter = 0.5, .density = 0.5, .stickiness = 10, VERY_STICKY},
    {.diameter = 0.8, .density = 0.8, .stickiness = 0.1, STICKY_80},
    {.diameter = 0.8, .density = 0.8, .stickiness = 1, STICKY_80},
    {.diameter = 0.8, .density = 0.8, .stickiness = 10, VERY_STICKY},
    {.diameter = 0.5, .density = 0.5, SLIDING},
    {.diameter = 0.5, .density = 0.5, .stickiness = 1, STICKING},
    {.diameter = 0.5, .density = 0.5, .stickiness = 10, CLUSTERING},
    {.diameter = 0.8, .density = 0.5, SLIDING},
    {.diameter = 0.8, .density = 0.5, .stickiness = 1, STICKING},
    {.diameter = 0.8, .density = 0.5, .stickiness = 10, CLUSTERING},
};

const struct report_scene *report_scene(size_t index)
{
    return index < sizeof scenes / sizeof *scenes ? &scenes[index] : NULL;
}

const struct report_figure *report_figure(size_t index)
{
    return index < sizeof figures / sizeof *figures ? &figures[index] : NULL;
}

static const struct report_figure *figure_of(const struct report_scene *scene)
{
    const struct report_figure *figure = figures;
    while (figure->number != scene->figure)
        figure++;
    return figure;
}

void report_scene_name(const struct report_scene *scene, char name[REPORT_NAME_SIZE])
{
    struct text text = {0};
    int year = figure_of(scene)->year;
    /* Each diameter is a part of the figure of 2024: a and b. */
    text_add(&text, "%d-fig%d%s", year, scene->figure,
             year == 2022             ? ""
             : scene->diameter == 0.5 ? "a"
                                      : "b");
    if (scene->stickiness > 0) {
        text_add(&text, "-gamma");
        text_add_number(&text, scene->stickiness);
    }
    text_add(&text, "-sigma");
    text_add_number(&text, scene->diameter);
    text_add(&text, "-rho");
    text_add_number(&text, scene->density);
    char *words = text_take(&text);
    snprintf(name, REPORT_NAME_SIZE, "%s", words ? words : "");
    free(words);
}

static void add_member(struct text *text, const char *name, double value)
{
    text_add(text, ",\"%s\":", name);
    text_add_number(text, value);
}

static void add_msd(struct text *text, const struct report_effort *effort)
{
    text_add(text, ",\"observables\":{\"msd\":{\"first\":0.001,\"points\":%d", LAGS);
    add_member(text, "last", effort->last);
    text_add(text, "}}");
}

static void add_observables(struct text *text, const struct report_figure *figure)
{
    text_add(text, ",\"observables\":{");
    for (size_t i = 0; i < REPORT_OBSERVABLES_MAX && figure->observable[i]; i++) {
        text_add(text, "%s\"%s\":{\"bins\":%d", i ? "," : "", figure->observable[i], BINS);
        if (strcmp(figure->observable[i], "contact_density") == 0)
            add_member(text, "gap", figure->gap);
        text_add(text, "}");
    }
    text_add(text, "}");
}

char *report_scene_json(const struct report_scene *scene, bool full, const char *method)
{
    const struct report_figure *figure = figure_of(scene);
    const struct report_effort *effort = &scene->effort[full];
    struct text text = {0};
    text_add(&text,
             "{\"model\":\"hard_rods\",\"particles\":%ld,\"length\":%d,\"mobility\":1,"
             "\"temperature\":1,\"boundary\":\"periodic\","
             "\"initial\":\"equilibrium\",\"seed\":1,\"realizations\":%d,"
             "\"potential\":{\"type\":\"cosine\",\"amplitude\":%d,\"wavelength\":1}",
             lround(scene->density * SYSTEM_LENGTH), SYSTEM_LENGTH, effort->realizations,
             AMPLITUDE);
    if (scene->stickiness > 0) {
        text_add(&text, ",\"interaction\":{\"type\":\"sticky\"");
        add_member(&text, "strength", scene->stickiness);
        add_member(&text, "range", STICKY_RANGE);
        add_member(&text, "exponent", STICKY_EXPONENT);
        text_add(&text, "}");
    }
    add_member(&text, "diameter", scene->diameter);
    text_add(&text, ",\"method\":");
    text_add_json_string(&text, method ? method : figure->method);
    if (method || effort->time_step == 0)
        text_add(&text, ",\"time_step\":\"auto\"");
    else
        add_member(&text, "time_step", effort->time_step);
    add_member(&text, "time", effort->time);
    if (effort->last > 0)
        add_msd(&text, effort);
    else
        add_observables(&text, figure);
    if (effort->last > 0 && !full) /* a second pass is too much for a short one */
        text_add(&text, ",\"time_step_error\":\"skipped\"");
    text_add(&text, "}");
    return text_take(&text);
}
