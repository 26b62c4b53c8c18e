/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_report_force.h"
#include "plot_figure.h"
#include "scene_json.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GAPS = 200, POWERS = 121, SEARCH = 60, WORDS = 64 };
#define RANGE 0.05

static const double gammas[FORCE_GAMMAS] = {0.1, 1, 10};
static const double exponents[FORCE_EXPONENTS] = {1.5, 2, 2.95, 4, 6};

/* ------------------------------------------------------------------- force */

/* Two sticky rods; NULL with words on stderr when they cannot be had. */
static struct bcd_scene *two_rods(double gamma, double exponent)
{
    struct text job = {0};
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    text_add(&job, "{\"particles\":2,\"length\":10,\"diameter\":0.5,\"time\":1,\"interaction\":"
                   "{\"type\":\"sticky\",\"strength\":");
    text_add_number(&job, gamma);
    text_add(&job, ",\"range\":");
    text_add_number(&job, RANGE);
    text_add(&job, ",\"exponent\":");
    text_add_number(&job, exponent);
    text_add(&job, "},\"observables\":{\"current\":{}}}");
    char *json = text_take(&job);
    if (json && scene_json_parse(json, strlen(json), &scene, &errors) != BCD_OK) {
        scene = NULL;
        fprintf(stderr, "bcd: %s: %s %s\n", FORCE_NAME, errors.items[0].field,
                errors.items[0].text);
    }
    free(json);
    return scene;
}

/* The minimum of a function with one of them between lo and hi, by golden section. */
typedef double of_one(double x, void *context);
static double lowest(of_one *f, void *context, double lo, double hi)
{
    const double golden = (sqrt(5) - 1) / 2;
    double x[2] = {hi - golden * (hi - lo), lo + golden * (hi - lo)};
    double y[2] = {f(x[0], context), f(x[1], context)};
    for (int i = 0; i < SEARCH; i++) {
        if (y[0] < y[1]) {
            hi = x[1];
            x[1] = x[0], y[1] = y[0];
            x[0] = hi - golden * (hi - lo), y[0] = f(x[0], context);
        } else {
            lo = x[0];
            x[0] = x[1], y[0] = y[1];
            x[1] = lo + golden * (hi - lo), y[1] = f(x[1], context);
        }
    }
    return (lo + hi) / 2;
}

/* Attraction is negative. */
static double force_at(double gap, void *scene)
{
    return bcd_scene_pair_force(scene, gap);
}

/* The largest attraction over all gaps; NaN = there are no such rods. */
static double largest(double exponent, void *gamma)
{
    struct bcd_scene *scene = two_rods(*(const double *)gamma, exponent);
    double most = NAN, at = 0;
    for (int i = 0; scene && i <= GAPS; i++) {
        double f = -bcd_scene_pair_force(scene, RANGE * i / GAPS);
        if (!(f <= most)) {
            most = f;
            at = RANGE * i / GAPS;
        }
    }
    if (scene) {
        at = lowest(force_at, scene, fmax(at - RANGE / GAPS, 0), fmin(at + RANGE / GAPS, RANGE));
        most = fmax(most, -bcd_scene_pair_force(scene, at));
    }
    bcd_scene_free(scene);
    return most;
}

/* ------------------------------------------------------------------ tables */

struct heading {
    const char *table, *x, *x_label, *y_label;
};

/* Columns x, attraction, gamma and, of the force, p. */
static struct bcd_table *make_table(const struct heading *heading, size_t rows, bool with_p)
{
    static const char *const names[] = {NULL, "attraction", "gamma", "exponent"};
    const enum bcd_role roles[] = {BCD_ROLE_X, BCD_ROLE_VALUE,
                                   with_p ? BCD_ROLE_OTHER : BCD_ROLE_SERIES, BCD_ROLE_SERIES};
    struct bcd_table *table = calloc(1, sizeof *table);
    if (!table)
        return NULL;
    snprintf(table->name, sizeof table->name, "%s", heading->table);
    snprintf(table->x_label, sizeof table->x_label, "%s", heading->x_label);
    snprintf(table->y_label, sizeof table->y_label, "%s", heading->y_label);
    table->rows = rows;
    for (size_t c = 0; c < (with_p ? 4u : 3u); c++) {
        struct bcd_column *column = &table->column[table->columns++];
        column->role = roles[c];
        snprintf(column->name, sizeof column->name, "%s", c ? names[c] : heading->x);
        column->values = calloc(rows, sizeof(double));
        if (!column->values) {
            bcd_table_free(table);
            return NULL;
        }
    }
    return table;
}

static bool fill_force(struct bcd_table *table)
{
    size_t row = 0;
    for (size_t g = 0; g < FORCE_GAMMAS; g++)
        for (size_t e = 0; e < FORCE_EXPONENTS; e++) {
            struct bcd_scene *scene = two_rods(gammas[g], exponents[e]);
            if (!scene)
                return false;
            for (size_t i = 0; i <= GAPS; i++, row++) {
                double gap = RANGE * (double)i / GAPS;
                const double values[] = {gap, -bcd_scene_pair_force(scene, gap), gammas[g],
                                         exponents[e]};
                for (size_t c = 0; c < 4; c++)
                    table->column[c].values[row] = values[c];
            }
            bcd_scene_free(scene);
        }
    return true;
}

/* p from 1 to 7 in steps of a twentieth; then the lowest place exactly. */
static bool fill_largest(struct force_figure *figure)
{
    struct bcd_table *table = figure->largest;
    size_t row = 0;
    for (size_t g = 0; g < FORCE_GAMMAS; g++) {
        size_t best = row;
        for (size_t i = 0; i < POWERS; i++, row++) {
            double p = 1 + 0.05 * (double)i, most = largest(p, &figure->gamma[g]);
            if (isnan(most))
                return false;
            table->column[0].values[row] = p;
            table->column[1].values[row] = most;
            table->column[2].values[row] = gammas[g];
            if (most < table->column[1].values[best])
                best = row;
        }
        double p = table->column[0].values[best];
        figure->best[g] = lowest(largest, &figure->gamma[g], fmax(p - 0.05, 1), p + 0.05);
        figure->least[g] = largest(figure->best[g], &figure->gamma[g]);
    }
    return true;
}

bool force_figure_init(struct force_figure *figure)
{
    *figure = (struct force_figure){0};
    memcpy(figure->gamma, gammas, sizeof gammas);
    figure->force = make_table(&(struct heading){"force", "gap", "gap g",
                                                 "attraction (kT/\xCE\xBB)"},
                               (size_t)FORCE_GAMMAS * FORCE_EXPONENTS * (GAPS + 1), true);
    figure->largest = make_table(&(struct heading){"largest_force", "exponent", "exponent p",
                                                   "largest attraction"},
                                 (size_t)FORCE_GAMMAS * POWERS, false);
    if (figure->largest)
        figure->largest->log_y = true;
    return figure->force && figure->largest && fill_force(figure->force) && fill_largest(figure);
}

void force_figure_fini(struct force_figure *figure)
{
    bcd_table_free(figure->force);
    bcd_table_free(figure->largest);
}

/* ----------------------------------------------------------------- picture */

char *force_figure_print(const struct force_figure *figure)
{
    struct plot_curve force[FORCE_GAMMAS][FORCE_EXPONENTS], most[FORCE_GAMMAS];
    struct plot_panel panels[2 * FORCE_GAMMAS] = {0};
    char labels[FORCE_EXPONENTS][WORDS], titles[2 * FORCE_GAMMAS][WORDS];
    char remarks[FORCE_GAMMAS][WORDS];
    for (size_t e = 0; e < FORCE_EXPONENTS; e++)
        snprintf(labels[e], WORDS, "p = %g", exponents[e]);
    for (size_t g = 0; g < FORCE_GAMMAS; g++) {
        for (size_t e = 0; e < FORCE_EXPONENTS; e++)
            force[g][e] = (struct plot_curve){figure->force, (g * FORCE_EXPONENTS + e) * (GAPS + 1),
                                              GAPS + 1, labels[e]};
        most[g] = (struct plot_curve){figure->largest, g * POWERS, POWERS,
                                      "largest over all gaps"};
        snprintf(titles[g], WORDS, "\xCE\xB3 = %g, against the gap", gammas[g]);
        snprintf(titles[FORCE_GAMMAS + g], WORDS, "\xCE\xB3 = %g, against p", gammas[g]);
        snprintf(remarks[g], WORDS, "least at p = %.2f", figure->best[g]);
        panels[g] = (struct plot_panel){
            .title = titles[g], .curves = force[g], .curve_count = FORCE_EXPONENTS};
        panels[FORCE_GAMMAS + g] = (struct plot_panel){
            .title = titles[FORCE_GAMMAS + g],
            .remark = remarks[g],
            .curves = &most[g],
            .curve_count = 1};
    }
    const struct plot_figure plot = {
        .title = "Attraction of sticky rods",
        .subtitle = "Eq. 32 of Phys. Rev. E 106, 054606 (2022), after its Fig. 5: range \xCE\xB5 = "
                    "0.05. Nothing is simulated here.",
        .rows = 2,
        .columns = FORCE_GAMMAS,
        .panels = panels};
    return plot_figure_print(&plot);
}
