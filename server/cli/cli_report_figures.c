/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_report_figures.c - bcd report figures: each scene is simulated on all threads, its tables are
 * written and judged at once; a figure is drawn when the last of its scenes is done.
 */
#include "cli_report.h"
#include "cli_report_force.h"
#include "cli_report_msd.h"
#include "cli_report_run_time.h"
#include "cli_report_scenes.h"
#include "cli_simulate.h"
#include "limits.h"
#include "plot_figure.h"
#include "scene_json.h"
#include "table_csv.h"
#include "text.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PANELS_MAX = 32, WORDS_SIZE = 96 };

struct options {
    const char *out, *only, *method;
    bool full, jobs, quiet;
    int64_t workers;
};

/* What the printed table says about one panel. NaN = not to be had. */
struct verdict {
    const struct report_scene *scene;
    const char *observable;
    char method[24];
    double time_step, l1, z_max, chi_square, freedom, p_value, core_seconds;
};

/* The panels of the figure in progress; tables are owned. */
struct sheet {
    const struct report_figure *figure;
    size_t count;
    struct bcd_table *table[PANELS_MAX];
    struct plot_panel panel[PANELS_MAX];
    struct verdict verdict[PANELS_MAX];
    char title[PANELS_MAX][WORDS_SIZE], remark[PANELS_MAX][WORDS_SIZE];
};

struct report {
    const struct options *options;
    size_t scenes, done;
    struct text summary; /* all verdicts as CSV */
    struct sheet sheet;
};

static int read_options(const struct cli_line *line, struct options *options);
static int print_jobs(const struct options *options);
static bool wanted(const struct report_scene *scene, const struct options *options);
static bool figure_wanted(const struct options *options, const char *name);
static int make_directory(const char *path);
static int report_all(struct report *report);

int cli_report_figures(const struct cli_line *line)
{
    struct options options;
    int status = read_options(line, &options);
    if (status != CLI_OK)
        return status;
    struct report *report = calloc(1, sizeof *report);
    if (!report)
        return cli_print_take(NULL);
    report->options = &options;
    for (size_t i = 0; report_scene(i); i++)
        report->scenes += wanted(report_scene(i), &options);
    if (report->scenes == 0 && !figure_wanted(&options, FORCE_NAME) &&
        !figure_wanted(&options, RUN_TIME_NAME))
        status = cli_wrong(line->command, "no scene's name contains \"%s\"", options.only);
    else if (options.jobs)
        status = print_jobs(&options);
    else
        status = make_directory(options.out);
    if (status == CLI_OK && !options.jobs)
        status = report_all(report);
    free(text_take(&report->summary));
    free(report);
    return status;
}

/* ----------------------------------------------------------------- options */

static int read_options(const struct cli_line *line, struct options *options)
{
    const char *out = cli_value(line, "out");
    *options = (struct options){.out = out ? out : "figures",
                                .only = cli_value(line, "only"),
                                .method = cli_value(line, "method"),
                                .full = cli_given(line, "full"),
                                .jobs = cli_given(line, "jobs"),
                                .quiet = cli_given(line, "quiet")};
    return cli_workers(line, &options->workers);
}

static bool wanted(const struct report_scene *scene, const struct options *options)
{
    char name[REPORT_NAME_SIZE];
    report_scene_name(scene, name);
    return !options->only || strstr(name, options->only);
}

static bool figure_wanted(const struct options *options, const char *name)
{
    return !options->only || strstr(name, options->only);
}

/* ------------------------------------------------------------------- files */

static int make_directory(const char *path)
{
    struct stat status;
    if (mkdir(path, 0777) == 0 || (stat(path, &status) == 0 && S_ISDIR(status.st_mode)))
        return CLI_OK;
    fprintf(stderr, "bcd: directory %s cannot be made: %s\n", path, strerror(errno));
    return CLI_FAILED;
}

/* Writes the text to DIR/NAME and frees it; NULL = out of memory. */
static int write_take(const struct options *options, const char *name, char *content)
{
    struct text path = {0};
    text_add(&path, "%s/%s", options->out, name);
    char *where = text_take(&path);
    FILE *file = where && content ? fopen(where, "w") : NULL;
    bool good = file && fputs(content, file) >= 0;
    if (file && fclose(file) != 0)
        good = false;
    if (!good)
        fprintf(stderr, "bcd: %s cannot be written: %s\n", where ? where : name, strerror(errno));
    free(where);
    free(content);
    return good ? CLI_OK : CLI_FAILED;
}

/* -------------------------------------------------------------------- jobs */

/* The table's own jobs are right; but a method that the user chose may not suit them. */
static int load_scene(const struct report_scene *row, const struct options *options,
                      struct bcd_scene **scene)
{
    struct bcd_errors errors = {0};
    char *json = report_scene_json(row, options->full, options->method);
    enum bcd_status status =
        json ? scene_json_parse(json, strlen(json), scene, &errors) : BCD_NO_MEMORY;
    if (status != BCD_OK) {
        char name[REPORT_NAME_SIZE];
        report_scene_name(row, name);
        fprintf(stderr, "bcd: %s: %s %s\n", name, errors.items[0].field,
                errors.count ? errors.items[0].text : bcd_status_text(status));
    }
    free(json);
    return status == BCD_OK ? CLI_OK : CLI_FAILED;
}

static int print_jobs(const struct options *options)
{
    struct text text = {0};
    int status = CLI_OK;
    for (size_t i = 0; status == CLI_OK && report_scene(i); i++) {
        const struct report_scene *row = report_scene(i);
        struct bcd_scene *scene = NULL;
        char name[REPORT_NAME_SIZE];
        if (!wanted(row, options))
            continue;
        status = load_scene(row, options, &scene);
        char *job = status == CLI_OK ? scene_json_job(scene) : NULL;
        report_scene_name(row, name);
        text_add(&text, "%s\"%s\":%s", text.size ? ",\n" : "{", name, job ? job : "");
        text.failed = text.failed || !job;
        free(job);
        bcd_scene_free(scene);
    }
    text_add(&text, "}\n");
    char *all = text_take(&text);
    if (status == CLI_OK)
        return cli_print_take(all);
    free(all);
    return status;
}

/* ---------------------------------------------------------------- verdicts */

static double note(const struct bcd_table *table, const char *name)
{
    for (size_t i = 0; i < table->notes; i++)
        if (strcmp(table->note[i].name, name) == 0)
            return table->note[i].number;
    return NAN;
}

static const struct bcd_fact *fact(const struct bcd_scene *scene, const char *name)
{
    const struct bcd_fact *found;
    for (size_t i = 0; (found = bcd_scene_fact(scene, i)) != NULL; i++)
        if (strcmp(found->name, name) == 0)
            return found;
    return NULL;
}

/* Bins are equally wide, so sums stand for integrals. */
static void judge(const struct bcd_table *table, struct verdict *verdict)
{
    const struct bcd_column *value = bcd_table_column(table, BCD_ROLE_VALUE);
    const struct bcd_column *theory = bcd_table_column(table, BCD_ROLE_THEORY);
    double off = 0, all = 0;
    verdict->l1 = verdict->z_max = NAN;
    if (value && theory && value->values && theory->values) {
        for (size_t i = 0; i < table->rows; i++) {
            off += fabs(value->values[i] - theory->values[i]);
            all += theory->values[i];
        }
        verdict->l1 = off / all;
    }
    for (size_t c = 0; c < table->columns; c++) {
        const struct bcd_column *z = &table->column[c];
        if (strcmp(z->name, "z") != 0 || !z->values)
            continue;
        for (size_t i = 0; i < table->rows; i++)
            verdict->z_max = fmax(verdict->z_max, fabs(z->values[i])); /* NaN is passed over */
    }
    verdict->chi_square = note(table, "chi_square");
    verdict->freedom = note(table, "degrees_of_freedom");
    verdict->p_value = note(table, "p_value");
}

static void print_heading(void)
{
    printf("%-4s %-15s %5s %4s %5s %3s  %-6s %9s %7s %7s %8s %8s %8s\n", "fig.", "observable",
           "sigma", "rho", "gamma", "N", "method", "time step", "L1", "max|z|", "chi2/dof", "p",
           "core s");
}

/* A number in a cell, "-" where there is none. */
struct cell {
    char text[24];
};
static struct cell cell(const char *format, double v)
{
    struct cell made = {"-"};
    if (!isnan(v))
        snprintf(made.text, sizeof made.text, format, v);
    return made;
}

/* One line of the table, and the same as CSV. */
static void print_verdict(const struct verdict *v, struct text *summary)
{
    const struct report_scene *row = v->scene;
    char name[REPORT_NAME_SIZE];
    report_scene_name(row, name);
    printf("%-4d %-15s %5g %4g %5g %3ld  %-6s %9.3g %7s %7s %8s %8s %8.1f\n", row->figure,
           v->observable, row->diameter, row->density, row->stickiness, lround(row->density * 100),
           v->method, v->time_step, cell("%.4f", v->l1).text, cell("%.2f", v->z_max).text,
           cell("%.2f", v->chi_square / v->freedom).text, cell("%.2g", v->p_value).text,
           v->core_seconds);
    fflush(stdout);
    if (summary->size == 0)
        text_add(summary, "scene,observable,diameter,density,stickiness,method,time_step,l1,"
                          "z_max,chi_square,degrees_of_freedom,p_value,core_seconds\n");
    text_add(summary, "%s,%s", name, v->observable);
    const double first[] = {row->diameter, row->density, row->stickiness};
    const double rest[] = {v->time_step, v->l1,      v->z_max,       v->chi_square,
                           v->freedom,   v->p_value, v->core_seconds};
    for (size_t i = 0; i < sizeof first / sizeof *first; i++) {
        text_add(summary, ",");
        text_add_number(summary, first[i]);
    }
    text_add(summary, ",%s", v->method);
    for (size_t i = 0; i < sizeof rest / sizeof *rest; i++) {
        text_add(summary, ",");
        if (isfinite(rest[i]))
            text_add_number(summary, rest[i]);
    }
    text_add(summary, "\n");
}

/* ----------------------------------------------------------------- figures */

static void describe_panel(struct sheet *sheet, size_t i)
{
    const struct verdict *v = &sheet->verdict[i];
    const struct report_scene *row = v->scene;
    char gamma[32] = "";
    if (row->stickiness > 0)
        snprintf(gamma, sizeof gamma, "\xCE\xB3 = %g, ", row->stickiness);
    snprintf(sheet->title[i], WORDS_SIZE, "%s\xCF\x83 = %g, \xCF\x81 = %g", gamma, row->diameter,
             row->density);
    snprintf(sheet->remark[i], WORDS_SIZE, "L\xE2\x82\x81 = %.1f %%", 100 * v->l1);
    sheet->panel[i] = (struct plot_panel){.table = sheet->table[i],
                                          .title = sheet->title[i],
                                          .remark = isnan(v->l1) ? NULL : sheet->remark[i]};
}

/* A number for readers: three digits are enough, 0.00169. */
static void add_rounded(struct text *text, double v)
{
    char digits[32];
    snprintf(digits, sizeof digits, "%.3g", v);
    text_add_number(text, strtod(digits, NULL));
}

static bool is_msd(const struct report_figure *figure)
{
    return strcmp(figure->observable[0], "msd") == 0;
}

/* What was simulated and how, in one sentence each. */
static char *subtitle_print(const struct sheet *sheet)
{
    struct text text = {0};
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < sheet->count; i++) {
        least = fmin(least, sheet->verdict[i].time_step);
        most = fmax(most, sheet->verdict[i].time_step);
    }
    text_add(
        &text,
        "Simulated after Fig. %d of %s: barrier 6 kT, ring of 100 wavelengths; method %s, time "
        "step ",
        sheet->figure->number, sheet->figure->source, sheet->verdict[0].method);
    add_rounded(&text, least);
    if (most > 1.01 * least) {
        text_add(&text, " to ");
        add_rounded(&text, most);
    }
    if (is_msd(sheet->figure)) {
        text_add(&text, ", sticky rods of range 0.05.");
        return text_take(&text);
    }
    text_add(&text, ". Theory is exact for this ring");
    if (sheet->figure->gap > 0) {
        text_add(&text, " and for contact as gaps below ");
        text_add_number(&text, sheet->figure->gap);
    }
    text_add(&text, "; L\xE2\x82\x81 is the relative area between it and the simulation.");
    return text_take(&text);
}

static void print_words(char *words)
{
    fputs(words ? words : "bcd: out of memory\n", stdout);
    free(words);
}

/* All curves of one diameter in one panel, and what is to be said of them. */
static char *print_msd(const struct sheet *sheet, const char *title, const char *subtitle)
{
    struct msd_curve curves[PANELS_MAX];
    for (size_t i = 0; i < sheet->count; i++)
        curves[i] = (struct msd_curve){sheet->verdict[i].scene, sheet->table[i]};
    print_words(msd_verdict_print(curves, sheet->count));
    return msd_figure_print(curves, sheet->count, title, subtitle);
}

/* Fig. 5 of 2022 needs no simulation. */
static int report_force(const struct report *report)
{
    struct force_figure figure;
    int status = CLI_FAILED;
    if (force_figure_init(&figure)) {
        printf("\n%s: attraction (Eq. 32, range 0.05): the exponent with the least largest force\n",
               FORCE_NAME);
        for (size_t g = 0; g < FORCE_GAMMAS; g++)
            printf("gamma %-4g p = %.3f, force %.4f kT/lambda\n", figure.gamma[g], figure.best[g],
                   figure.least[g]);
        status = write_take(report->options, FORCE_NAME ".svg", force_figure_print(&figure));
        if (status == CLI_OK)
            status =
                write_take(report->options, FORCE_NAME "-force.csv", table_csv_print(figure.force));
        if (status == CLI_OK)
            status = write_take(report->options, FORCE_NAME "-largest.csv",
                                table_csv_print(figure.largest));
    }
    force_figure_fini(&figure);
    return status;
}

/* Fig. 6 of 2024 measures times. */
static int report_run_time(const struct report *report)
{
    struct run_time_figure figure;
    int status = CLI_FAILED;
    if (run_time_figure_init(&figure)) {
        status = write_take(report->options, RUN_TIME_NAME ".svg", run_time_figure_print(&figure));
        if (status == CLI_OK)
            status =
                write_take(report->options, RUN_TIME_NAME ".csv", run_time_figure_csv(&figure));
    }
    run_time_figure_fini(&figure);
    return status;
}

/* Draws what there is of the figure. Panels came scene by scene; a row shows one observable. */
static int draw_sheet(const struct report *report, const struct sheet *sheet)
{
    const struct report_figure *figure = sheet->figure;
    struct plot_panel grid[PANELS_MAX] = {0};
    char title[WORDS_SIZE], name[WORDS_SIZE];
    char *subtitle = subtitle_print(sheet);
    size_t kinds = figure->observable[1] ? 2 : 1, scenes = sheet->count / kinds;
    size_t columns = scenes < figure->columns ? scenes : figure->columns;
    size_t bands = (scenes + columns - 1) / columns;
    for (size_t i = 0; i < sheet->count; i++) {
        size_t scene = i / kinds, row = scene / columns * kinds + i % kinds;
        grid[row * columns + scene % columns] = sheet->panel[i];
    }
    snprintf(title, sizeof title, "%s in a cosine potential", figure->title);
    snprintf(name, sizeof name, "%d-fig%d.svg", figure->year, figure->number);
    struct plot_figure plot = {.title = title,
                               .subtitle = subtitle,
                               .rows = bands * kinds,
                               .columns = columns,
                               .panels = grid};
    char *svg = !subtitle        ? NULL
                : is_msd(figure) ? print_msd(sheet, title, subtitle)
                                 : plot_figure_print(&plot);
    int status = write_take(report->options, name, svg);
    free(subtitle);
    return status;
}

static void clear_sheet(struct sheet *sheet)
{
    for (size_t i = 0; i < sheet->count; i++)
        bcd_table_free(sheet->table[i]);
    sheet->count = 0;
}

/* ------------------------------------------------------------------ scenes */

/* Where the scene has the observable; our own table asks for no other. */
static size_t find_observable(const struct bcd_scene *scene, const char *name)
{
    size_t index = 0;
    const struct bcd_group *part;
    while ((part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, index)) != NULL &&
           strcmp(part->type, name) != 0)
        index++;
    return index;
}

/* Takes a result into the figure: verdict, line of the table, CSV. */
static int add_panel(struct report *report, const struct bcd_scene *scene, struct bcd_table *table,
                     const struct verdict *about)
{
    struct sheet *sheet = &report->sheet;
    size_t i = sheet->count++;
    struct verdict *verdict = &sheet->verdict[i];
    char name[REPORT_NAME_SIZE], file[REPORT_NAME_SIZE + 48];
    sheet->table[i] = table;
    *verdict = *about;
    verdict->time_step = fact(scene, "time_step")->number;
    snprintf(verdict->method, sizeof verdict->method, "%.23s", fact(scene, "method")->text);
    judge(table, verdict);
    describe_panel(sheet, i);
    print_verdict(verdict, &report->summary);
    report_scene_name(about->scene, name);
    snprintf(file, sizeof file, "%s-%s.csv", name, about->observable);
    return write_take(report->options, file, table_csv_print(table));
}

static int add_panels(struct report *report, const struct bcd_scene *scene,
                      const struct cli_simulation *simulation, const struct report_scene *row)
{
    const struct report_figure *figure = report->sheet.figure;
    struct bcd_theory *theory = NULL;
    enum bcd_status status = bcd_theory_create(&theory, scene, BCD_THEORY_RING, NULL, NULL);
    int written = CLI_OK;
    for (size_t i = 0; i < REPORT_OBSERVABLES_MAX && figure->observable[i]; i++) {
        struct bcd_table *table = NULL;
        struct verdict about = {.scene = row,
                                .observable = figure->observable[i],
                                .core_seconds = simulation->core_seconds};
        if (status == BCD_OK)
            status = bcd_tally_table(simulation->tally, scene, theory,
                                     find_observable(scene, figure->observable[i]), &table);
        if (status == BCD_OK && written == CLI_OK)
            written = add_panel(report, scene, table, &about);
        else
            bcd_table_free(table);
    }
    bcd_theory_free(theory);
    if (status != BCD_OK)
        fprintf(stderr, "bcd: the results cannot be had: %s\n", bcd_status_text(status));
    return status == BCD_OK ? written : CLI_FAILED;
}

static int report_one(struct report *report, const struct report_scene *row)
{
    struct bcd_scene *scene = NULL;
    char name[REPORT_NAME_SIZE], label[REPORT_NAME_SIZE + 32];
    report_scene_name(row, name);
    snprintf(label, sizeof label, "%zu/%zu %s ", ++report->done, report->scenes, name);
    int status = load_scene(row, report->options, &scene);
    struct cli_simulation simulation = {.scene = scene,
                                        .workers = report->options->workers,
                                        .quiet = report->options->quiet,
                                        .label = label};
    if (status == CLI_OK)
        status = cli_simulate(&simulation);
    if (status == CLI_OK)
        status = add_panels(report, scene, &simulation, row);
    bcd_tally_free(simulation.tally);
    bcd_scene_free(scene);
    return status;
}

static int report_all(struct report *report)
{
    const struct report_figure *figure;
    int status = CLI_OK;
    if (report->scenes > 0)
        print_heading();
    for (size_t f = 0; status == CLI_OK && (figure = report_figure(f)) != NULL; f++) {
        report->sheet.figure = figure;
        for (size_t i = 0; status == CLI_OK && report_scene(i); i++)
            if (report_scene(i)->figure == figure->number &&
                wanted(report_scene(i), report->options))
                status = report_one(report, report_scene(i));
        if (status == CLI_OK && report->sheet.count > 0)
            status = draw_sheet(report, &report->sheet);
        clear_sheet(&report->sheet);
    }
    if (status == CLI_OK && figure_wanted(report->options, FORCE_NAME))
        status = report_force(report);
    if (status == CLI_OK && figure_wanted(report->options, RUN_TIME_NAME))
        status = report_run_time(report);
    if (status == CLI_OK && report->scenes > 0)
        status = write_take(report->options, "2022-figures.csv", text_take(&report->summary));
    if (status == CLI_OK)
        printf("pictures and tables: %s\n", report->options->out);
    return status;
}
