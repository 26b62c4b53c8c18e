/* SPDX-License-Identifier: GPL-3.0-or-later
 * bcd run and bcd check: a job without the daemon. */
#include "caption.h"
#include "cli.h"
#include "cli_simulate.h"
#include "limits.h"
#include "plot_svg.h"
#include "record_json.h"
#include "scene_json.h"
#include "table_csv.h"
#include "table_json.h"
#include "text.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct options {
    const char *path, *csv, *svg;
    bool record, quiet, help;
    int64_t workers;
};

static int parse_options(const struct cli_command *self, int argc, char **argv,
                         struct options *options);
static int find_observable(const struct cli_command *self, const struct bcd_scene *scene,
                           const char *name);
static int print_results(const struct bcd_scene *scene, const struct bcd_tally *tally,
                         const struct options *options);

int cli_run(const struct cli_command *self, int argc, char **argv)
{
    struct options options;
    struct bcd_scene *scene = NULL;
    struct cli_simulation simulation = {0};
    int status = parse_options(self, argc, argv, &options);
    if (status != CLI_OK)
        return status;
    if (options.help)
        return cli_help(self);
    status = cli_load_job(options.path, &scene);
    if (status == CLI_OK && options.csv)
        status = find_observable(self, scene, options.csv);
    if (status == CLI_OK && options.svg)
        status = find_observable(self, scene, options.svg);
    simulation.scene = scene;
    simulation.workers = options.workers;
    simulation.quiet = options.quiet;
    if (status == CLI_OK)
        status = cli_simulate(&simulation);
    if (status == CLI_OK)
        status = print_results(scene, simulation.tally, &options);
    bcd_tally_free(simulation.tally);
    bcd_scene_free(scene);
    return status;
}

int cli_check(const struct cli_command *self, int argc, char **argv)
{
    struct bcd_scene *scene = NULL;
    struct bcd_estimate estimate;
    struct text text = {0};
    if (argc == 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0))
        return cli_help(self);
    if (argc != 2 || (argv[1][0] == '-' && argv[1][1] != '\0'))
        return cli_wrong(self, "one file with a job is needed");
    int status = cli_load_job(argv[1], &scene);
    if (status != CLI_OK)
        return status;
    bcd_scene_estimate(scene, &estimate);
    char *pieces[] = {scene_json_job(scene), scene_json_derived(scene),
                      record_json_estimate(&estimate, bcd_scene_chunks(scene))};
    if (pieces[0] && pieces[1] && pieces[2])
        text_add(&text, "{\"job\":%s,\n\"derived\":%s,\n\"estimate\":%.*s}\n", pieces[0], pieces[1],
                 (int)strcspn(pieces[2], "\n"), pieces[2]);
    else
        text.failed = true;
    for (size_t i = 0; i < 3; i++)
        free(pieces[i]);
    bcd_scene_free(scene);
    return cli_print_take(text_take(&text));
}

/* ----------------------------------------------------------------- options */

static int parse_options(const struct cli_command *self, int argc, char **argv,
                         struct options *options)
{
    static const struct option names[] = {
        {"workers", required_argument, NULL, 'w'},
        {"csv", required_argument, NULL, 'c'},
        {"svg", required_argument, NULL, 's'},
        {"record", no_argument, NULL, 'r'},
        {"quiet", no_argument, NULL, 'q'},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    int c;
    *options = (struct options){.workers = cli_cores()};
    opterr = 0;
    while ((c = getopt_long(argc, argv, ":hq", names, NULL)) != -1) {
        switch (c) {
        case 'w':
            if (cli_parse_workers(self, optarg, &options->workers) != CLI_OK)
                return CLI_USAGE;
            break;
        case 'c':
            options->csv = optarg;
            break;
        case 's':
            options->svg = optarg;
            break;
        case 'r':
            options->record = true;
            break;
        case 'q':
            options->quiet = true;
            break;
        case 'h':
            options->help = true;
            return CLI_OK;
        default:
            return cli_wrong_option(self, c, argv[optind - 1]);
        }
    }
    if (optind + 1 != argc)
        return cli_wrong(self, "one file with a job is needed");
    if ((options->csv != NULL) + (options->svg != NULL) + options->record > 1)
        return cli_wrong(self, "--csv, --svg and --record exclude one another");
    options->path = argv[optind];
    return CLI_OK;
}

static int find_observable(const struct cli_command *self, const struct bcd_scene *scene,
                           const char *name)
{
    const struct bcd_group *part;
    struct text names = {0};
    for (size_t i = 0; (part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i)) != NULL; i++) {
        if (strcmp(part->type, name) == 0) {
            free(text_take(&names));
            return CLI_OK;
        }
        text_add(&names, "%s%s", i ? ", " : "", part->type);
    }
    char *list = text_take(&names);
    int status = cli_wrong(self, "the job does not ask for \"%s\", but for %s", name,
                           list ? list : "others");
    free(list);
    return status;
}

/* ----------------------------------------------------------------- results */

static char *print_named(const struct bcd_scene *scene, const struct bcd_table *table,
                         const struct options *options)
{
    if (options->csv)
        return table_csv_print(table);
    char *caption = caption_print(scene);
    char *svg = caption ? plot_svg_print(table, table->name, caption) : NULL;
    free(caption);
    return svg;
}

static char *print_record(const struct bcd_scene *scene, const char *results)
{
    struct text text = {0};
    char *job = scene_json_job(scene), *derived = scene_json_derived(scene);
    if (results && job && derived)
        text_add(&text, "{\"job\":%s,\n\"derived\":%s,\n\"results\":%.*s}\n", job, derived,
                 (int)strcspn(results, "\n"), results);
    else
        text.failed = true;
    free(job);
    free(derived);
    return text_take(&text);
}

static int print_results(const struct bcd_scene *scene, const struct bcd_tally *tally,
                         const struct options *options)
{
    const char *name = options->csv ? options->csv : options->svg;
    const struct bcd_group *part;
    size_t count = 0;
    while (bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, count))
        count++;
    struct bcd_table **tables = calloc(count + 1, sizeof *tables);
    struct bcd_theory *theory = NULL;
    enum bcd_status status =
        tables ? bcd_theory_create(&theory, scene, BCD_THEORY_RING) : BCD_NO_MEMORY;
    char *text = NULL;
    for (size_t i = 0; status == BCD_OK && i < count; i++) {
        status = bcd_tally_table(tally, scene, theory, i, &tables[i]);
        part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i);
        if (status == BCD_OK && name && strcmp(part->type, name) == 0)
            text = print_named(scene, tables[i], options);
    }
    if (status == BCD_OK && !name)
        text = table_json_print_all(tables, count);
    if (status == BCD_OK && options->record) {
        char *results = text;
        text = print_record(scene, results);
        free(results);
    }
    for (size_t i = 0; tables && i < count; i++)
        bcd_table_free(tables[i]);
    free(tables);
    bcd_theory_free(theory);
    if (status == BCD_OK)
        return cli_print_take(text);
    fprintf(stderr, "bcd: the results cannot be had: %s\n", bcd_status_text(status));
    free(text);
    return CLI_FAILED;
}
