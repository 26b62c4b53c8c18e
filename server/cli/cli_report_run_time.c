/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_report_run_time.h"
#include "cli_bench_step.h"
#include "plot_figure.h"
#include "text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { ROWS = RUN_TIME_SCENES * RUN_TIME_METHODS * RUN_TIME_SIZES };

static const char *const scenes[RUN_TIME_SCENES] = {"sparse", "dense"};
static const char *const titles[RUN_TIME_SCENES] = {"\xCF\x83 = 0.5, \xCF\x81 = 0.5",
                                                    "\xCF\x83 = 0.99, \xCF\x81 = 1"};
static const struct {
    const char *name, *label;
} methods[RUN_TIME_METHODS] = {
    {"bcd_chronological", "bcd_chronological (2022)"},
    {"bcd_premerging", "bcd_premerging (2024)"},
    {"bcd", "bcd"},
    {"strang", "strang"},
};
static const int64_t sizes[RUN_TIME_SIZES] = {10, 32, 100, 316, 1000, 3162, 10000, 31623, 100000};

static struct bcd_table *make_table(void)
{
    static const char *const names[] = {"particles", "run_time", "stderr"};
    const enum bcd_role roles[] = {BCD_ROLE_X, BCD_ROLE_VALUE, BCD_ROLE_STDERR};
    struct bcd_table *table = calloc(1, sizeof *table);
    if (!table)
        return NULL;
    snprintf(table->name, sizeof table->name, "run_time");
    snprintf(table->x_label, sizeof table->x_label, "rods N");
    snprintf(table->y_label, sizeof table->y_label, "run time of a step (\xC2\xB5s)");
    table->log_x = table->log_y = true;
    table->rows = ROWS;
    for (size_t c = 0; c < 3; c++) {
        struct bcd_column *column = &table->column[table->columns++];
        column->role = roles[c];
        snprintf(column->name, sizeof column->name, "%s", names[c]);
        column->values = calloc(ROWS, sizeof(double));
        if (!column->values) {
            bcd_table_free(table);
            return NULL;
        }
    }
    return table;
}

static size_t row_of(size_t scene, size_t method, size_t size)
{
    return (scene * RUN_TIME_METHODS + method) * RUN_TIME_SIZES + size;
}

/* One curve. A size that takes too long ends it. */
static bool fill(struct run_time_figure *figure, size_t scene, size_t method)
{
    enum bench_outcome outcome = BENCH_DONE;
    for (size_t i = 0; i < RUN_TIME_SIZES && outcome != BENCH_FAILED; i++) {
        const struct bench_case which = {scenes[scene], methods[method].name, sizes[i], 1};
        struct bench_step step = {0};
        double *values[3];
        if (outcome == BENCH_DONE)
            outcome = bench_step_measure(&which, &bench_usual, &step);
        bool there = outcome == BENCH_DONE;
        for (size_t c = 0; c < 3; c++)
            values[c] = &figure->table->column[c].values[row_of(scene, method, i)];
        *values[0] = (double)sizes[i];
        *values[1] = there ? 1e-3 * step.timing.ns[1] : NAN;
        *values[2] = there ? 1e-3 * step.timing.ns_stderr[1] : NAN;
        figure->ratio_to_floor[scene][method][i] = there ? step.timing.ratio : NAN;
    }
    return outcome != BENCH_FAILED && outcome != BENCH_REFUSED;
}

static void print_line(const struct run_time_figure *figure, size_t scene, size_t method)
{
    const double *time = figure->table->column[1].values;
    printf("%-7s %-18s", scenes[scene], methods[method].name);
    for (size_t i = 0; i < RUN_TIME_SIZES; i += 2)
        printf(" %11.4g", time[row_of(scene, method, i)]);
    printf("\n");
    fflush(stdout);
}

bool run_time_figure_init(struct run_time_figure *figure)
{
    *figure = (struct run_time_figure){.table = make_table()};
    bool good = figure->table != NULL;
    printf("\n%s: microseconds of a step\n%-7s %-18s", RUN_TIME_NAME, "scene", "method");
    for (size_t i = 0; i < RUN_TIME_SIZES; i += 2)
        printf("  N = %6lld", (long long)sizes[i]);
    printf("\n");
    for (size_t s = 0; good && s < RUN_TIME_SCENES; s++)
        for (size_t m = 0; good && m < RUN_TIME_METHODS; m++) {
            good = fill(figure, s, m);
            if (good)
                print_line(figure, s, m);
        }
    if (!good)
        fprintf(stderr, "bcd: %s cannot be measured\n", RUN_TIME_NAME);
    return good;
}

void run_time_figure_fini(struct run_time_figure *figure)
{
    bcd_table_free(figure->table);
}

char *run_time_figure_print(const struct run_time_figure *figure)
{
    struct plot_curve curves[RUN_TIME_SCENES][RUN_TIME_METHODS];
    struct plot_panel panels[RUN_TIME_SCENES] = {0};
    for (size_t s = 0; s < RUN_TIME_SCENES; s++) {
        for (size_t m = 0; m < RUN_TIME_METHODS; m++)
            curves[s][m] = (struct plot_curve){figure->table, row_of(s, m, 0), RUN_TIME_SIZES,
                                               methods[m].label};
        panels[s] = (struct plot_panel){
            .title = titles[s], .curves = curves[s], .curve_count = RUN_TIME_METHODS};
    }
    const struct plot_figure plot = {
        .title = "Run time against the number of rods",
        .subtitle =
            "After Fig. 6 of Comput. Phys. Commun. 309, 109474 (2024): barrier 6 kT, one core, "
            "error bars from repeated turns. The form of 2022 finds the next collision by a "
            "tournament here, not by a search through all rods: a lower bound of its published "
            "O(N\xC2\xB2) cost.",
        .rows = 1,
        .columns = RUN_TIME_SCENES,
        .panels = panels};
    return plot_figure_print(&plot);
}

char *run_time_figure_csv(const struct run_time_figure *figure)
{
    struct text csv = {0};
    text_add(&csv, "scene,method,particles,microseconds_per_step,stderr,"
                   "ratio_to_noise_and_force\n");
    for (size_t s = 0; s < RUN_TIME_SCENES; s++)
        for (size_t m = 0; m < RUN_TIME_METHODS; m++)
            for (size_t i = 0; i < RUN_TIME_SIZES; i++) {
                const size_t row = row_of(s, m, i);
                const double numbers[] = {figure->table->column[1].values[row],
                                          figure->table->column[2].values[row],
                                          figure->ratio_to_floor[s][m][i]};
                text_add(&csv, "%s,%s,%lld", scenes[s], methods[m].name, (long long)sizes[i]);
                for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
                    text_add(&csv, ",");
                    if (isfinite(numbers[k]))
                        text_add_number(&csv, numbers[k]);
                }
                text_add(&csv, "\n");
            }
    return text_take(&csv);
}
