/* SPDX-License-Identifier: GPL-3.0-or-later
 * bcd run and bcd check: a job without the daemon. */
#include "caption.h"
#include "cli.h"
#include "cli_simulate.h"
#include "outcome_json.h"
#include "plot_svg.h"
#include "queue.h"
#include "record_json.h"
#include "scene_json.h"
#include "table_csv.h"
#include "table_json.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int find_observable(const struct cli_line *line, const struct bcd_scene *scene,
                           const char *name);
static void tell_verdict(const struct bcd_verdict *verdict);
static int print_results(const struct cli_simulation *simulation, const struct cli_line *line);

static int run(const struct cli_line *line)
{
    struct bcd_scene *scene = NULL;
    struct cli_simulation simulation = {0};
    const char *csv = cli_value(line, "csv"), *svg = cli_value(line, "svg");
    int status = cli_workers(line, &simulation.workers);
    if (status == CLI_OK)
        status = cli_load_job(line->operand[0], &scene);
    if (status == CLI_OK && csv)
        status = find_observable(line, scene, csv);
    if (status == CLI_OK && svg)
        status = find_observable(line, scene, svg);
    simulation.scene = scene;
    simulation.quiet = cli_given(line, "quiet");
    if (status == CLI_OK)
        status = cli_simulate(&simulation);
    if (status == CLI_OK && !simulation.quiet)
        tell_verdict(&simulation.verdict);
    if (status == CLI_OK)
        status = print_results(&simulation, line);
    bcd_tally_free(simulation.tally);
    bcd_scene_free(scene);
    return status;
}

/* What the hash is taken of, with a NUL at its end (malloc'ed). */
static char *encoding_of(const struct bcd_scene *scene)
{
    size_t size = bcd_scene_encode(scene, NULL, 0);
    char *bytes = malloc(size + 1);
    if (bytes) {
        bcd_scene_encode(scene, bytes, size);
        bytes[size] = '\0';
    }
    return bytes;
}

static char *checked(const struct bcd_scene *scene)
{
    struct bcd_estimate estimate;
    unsigned char hash[JOB_HASH_SIZE];
    struct text text = {0};
    calibration_estimate(NULL, scene, &estimate);
    char *pieces[] = {scene_json_job(scene), scene_json_derived(scene),
                      record_json_estimate(&estimate, bcd_scene_chunks(scene), NULL)};
    text.failed = !pieces[0] || !pieces[1] || !pieces[2] || !queue_hash(scene, hash);
    if (!text.failed) {
        text_add(&text, "{\"job\":%s,\n\"derived\":%s,\n\"estimate\":%.*s,\n\"hash\":\"", pieces[0],
                 pieces[1], (int)strcspn(pieces[2], "\n"), pieces[2]);
        for (size_t i = 0; i < sizeof hash; i++)
            text_add(&text, "%02x", hash[i]);
        text_add(&text, "\"}\n");
    }
    for (size_t i = 0; i < 3; i++)
        free(pieces[i]);
    return text_take(&text);
}

static int check(const struct cli_line *line)
{
    struct bcd_scene *scene = NULL;
    int status = cli_check_job(line->operand[0], &scene);
    if (status != CLI_OK)
        return status;
    char *text = cli_given(line, "encoding") ? encoding_of(scene) : checked(scene);
    bcd_scene_free(scene);
    return cli_print_take(text);
}

static const struct cli_option run_options[] = {
    {.name = "workers", .value = "N", .doc = "threads (default: all cores)"},
    {.name = "csv",
     .value = "OBSERVABLE",
     .doc = "prints this observable as CSV instead",
     .either = 1},
    {.name = "svg",
     .value = "OBSERVABLE",
     .doc = "prints this observable as a picture instead",
     .either = 1},
    {.name = "record",
     .doc = "prints {\"job\", \"derived\", \"outcome\", \"results\"}",
     .either = 1},
    {.name = "quiet",
     .letter = 'q',
     .doc = "no progress bar (there is none either unless stderr is a terminal)"},
    {0},
};

const struct cli_command cli_run_command = {
    .name = "run",
    .operands = "JOB.json",
    .least = 1,
    .most = 1,
    .doc = "runs a job here and prints its results as JSON",
    .text = "The numbers are those of the service, bit for bit, whatever the number of workers.\n"
            "- instead of a file reads the job from stdin.",
    .options = run_options,
    .function = run,
};

static const struct cli_option check_options[] = {
    {.name = "encoding", .doc = "prints what the hash is taken of instead, a line a value"},
    {0},
};

const struct cli_command cli_check_command = {
    .name = "check",
    .operands = "JOB.json",
    .least = 1,
    .most = 1,
    .doc = "checks a job without running it",
    .text = "Prints the job completed with its defaults, what follows from it, and an estimate of\n"
            "memory and time: {\"job\", \"derived\", \"estimate\", \"hash\"}; jobs with the same\n"
            "hash are the same job. All faults go to stderr, each with the JSON pointer of its\n"
            "field; the exit status is then 1.",
    .options = check_options,
    .function = check,
};

static int find_observable(const struct cli_line *line, const struct bcd_scene *scene,
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
    int status = cli_wrong(line->command, "the job does not ask for \"%s\", but for %s", name,
                           list ? list : "others");
    free(list);
    return status;
}

/* ----------------------------------------------------------------- results */

static char *print_named(const struct bcd_scene *scene, const struct bcd_table *table, bool csv)
{
    if (csv)
        return table_csv_print(table);
    char *caption = caption_print(scene);
    char *svg = caption ? plot_svg_print(table, table->name, caption) : NULL;
    free(caption);
    return svg;
}

static char *print_record(const struct cli_simulation *simulation, const char *results)
{
    struct text text = {0};
    const struct outcome outcome = {.verdict = &simulation->verdict};
    char *pieces[] = {scene_json_job(simulation->scene), scene_json_derived(simulation->scene),
                      outcome_json_print(&outcome)};
    if (results && pieces[0] && pieces[1] && pieces[2])
        text_add(&text, "{\"job\":%s,\n\"derived\":%s,\n\"outcome\":%s,\n\"results\":%.*s}\n",
                 pieces[0], pieces[1], pieces[2], (int)strcspn(results, "\n"), results);
    else
        text.failed = true;
    for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++)
        free(pieces[i]);
    return text_take(&text);
}

/* Whether a target was met, for those who see the results alone. */
static void tell_verdict(const struct bcd_verdict *verdict)
{
    if (verdict->stop == BCD_STOP_ALL)
        return;
    fprintf(stderr, "bcd: relative error %.3g after %lld realizations; ", verdict->error,
            (long long)verdict->realizations);
    if (verdict->stop == BCD_STOP_TARGET)
        fprintf(stderr, "the target is met\n");
    else
        fprintf(stderr, "the target is not met: %s\n", bcd_stop_name(verdict->stop));
}

static int print_results(const struct cli_simulation *simulation, const struct cli_line *line)
{
    const struct bcd_scene *scene = simulation->scene;
    const char *csv = cli_value(line, "csv"), *name = csv ? csv : cli_value(line, "svg");
    const struct bcd_group *part;
    size_t count = 0;
    while (bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, count))
        count++;
    struct bcd_table **tables = calloc(count + 1, sizeof *tables);
    struct bcd_theory *theory = NULL;
    enum bcd_status status =
        tables ? bcd_theory_create(&theory, scene, BCD_THEORY_RING, NULL, NULL) : BCD_NO_MEMORY;
    char *text = NULL;
    for (size_t i = 0; status == BCD_OK && i < count; i++) {
        status = bcd_tally_table(simulation->tally, scene, theory, i, &tables[i]);
        part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i);
        if (status == BCD_OK && name && strcmp(part->type, name) == 0)
            text = print_named(scene, tables[i], csv != NULL);
    }
    if (status == BCD_OK && !name)
        text = table_json_print_all(tables, count);
    if (status == BCD_OK && cli_given(line, "record")) {
        char *results = text;
        text = print_record(simulation, results);
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
