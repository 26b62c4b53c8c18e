/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "list_table.h"
#include "cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS_MAX = 200, WIDTH_MAX = 28, NO_TERMINAL_WIDTH = 160 };

static void choose_asked(struct list_table *table);
static void choose_differing(struct list_table *table, const struct answer *rows, size_t count);
static void measure(struct list_table *table, const struct answer *rows, size_t count);
static void add_fixed(struct text *text, const struct list_table *table,
                      const struct answer *record);
static void add_cell(struct text *text, const char *value, size_t width);
static const char *head_of(const struct list_column *column);

/* What is always there: id, state, progress, age. */
enum { ID_WIDTH = 17, STATE_WIDTH = 9, DONE_WIDTH = 6, AGE_WIDTH = 7, COUNT_WIDTH = 12 };

void list_table_init(struct list_table *table, const char *asked, const char *what)
{
    *table = (struct list_table){
        .screen = cli_screen(stdout), .asked = asked, .sweeps = strcmp(what, "sweeps") == 0};
    if (!table->screen.terminal)
        table->screen.width = NO_TERMINAL_WIDTH;
}

void list_table_choose(struct list_table *table, const struct answer *rows, size_t count)
{
    if (table->asked)
        choose_asked(table);
    else
        choose_differing(table, rows, count);
    measure(table, rows, count);
}

void list_table_fini(struct list_table *table)
{
    for (size_t i = 0; i < table->count; i++) {
        free(table->column[i].path);
        free(table->column[i].first);
    }
    free(table->column);
}

/* ------------------------------------------------------------------- columns */

static struct list_column *add_column(struct list_table *table, const char *path)
{
    for (size_t i = 0; i < table->count; i++)
        if (strcmp(table->column[i].path, path) == 0)
            return &table->column[i];
    if (table->count == COLUMNS_MAX)
        return NULL;
    if (!table->column)
        table->column = calloc(COLUMNS_MAX, sizeof *table->column);
    char *copy = table->column ? strdup(path) : NULL;
    table->failed |= !copy;
    if (!copy)
        return NULL;
    struct list_column *column = &table->column[table->count++];
    column->path = copy;
    return column;
}

/* As named by the user: a parameter of the job, unless it begins like another part of the record.
 */
static void choose_asked(struct list_table *table)
{
    static const char *const parts[] = {
        "id",       "state",       "progress", "submitted_at", "started_at", "job.",
        "owner",    "finished_at", "derived.", "error",        "label",      "tags",
        "priority", "results.",    "jobs",     "axes",         "states.",    "deduplicated"};
    for (const char *name = table->asked; *name;) {
        size_t size = strcspn(name, ",");
        struct text path = {0};
        bool whole = table->sweeps;
        for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
            size_t length = strlen(parts[i]);
            bool inner = parts[i][length - 1] == '.';
            whole |= strncmp(name, parts[i], length) == 0 && (inner || size == length);
        }
        text_add(&path, "%s%.*s", whole ? "" : "job.", (int)size, name);
        char *text = text_take(&path);
        struct list_column *column = text && size ? add_column(table, text) : NULL;
        if (column)
            column->shown = true;
        free(text);
        name += size + (name[size] == ',');
    }
}

static void take_scalar(void *context, const char *path, const struct answer *value)
{
    struct list_table *table = context;
    struct text name = {0}, text = {0};
    text_add(&name, "job.%s", path);
    answer_json_add(&text, value);
    char *whole = text_take(&name), *shown = text_take(&text);
    struct list_column *column = whole ? add_column(table, whole) : NULL;
    if (column) {
        column->met++;
        column->differs |= column->first && shown && strcmp(column->first, shown) != 0;
        if (!column->first) {
            column->first = shown;
            shown = NULL;
        }
    }
    free(whole);
    free(shown);
}

/* Those in which the rows differ; of rows that do not, what a job is about. */
static void choose_differing(struct list_table *table, const struct answer *rows, size_t count)
{
    static const char *const always[] = {"job.particles", "job.length", "job.diameter"};
    const char *key;
    bool any = false;
    if (table->sweeps)
        return;
    for (size_t i = 0; i < count; i++)
        answer_json_leaves(answer_json_at(answer_json_item(rows, i, &key), "job"), table,
                           take_scalar);
    for (size_t i = 0; i < table->count; i++) {
        struct list_column *column = &table->column[i];
        column->shown = column->differs || column->met != count;
        any |= column->shown;
    }
    for (size_t i = 0; i < table->count && !any; i++)
        for (size_t a = 0; a < sizeof always / sizeof *always; a++)
            table->column[i].shown |= strcmp(table->column[i].path, always[a]) == 0;
}

static char *cell_text(const struct answer *record, const struct list_column *column)
{
    const struct answer *value = answer_json_at(record, column->path);
    double number = answer_json_number(value, "", NAN);
    struct text text = {0};
    if (isnan(number))
        answer_json_add(&text, value);
    else
        cli_add_number(&text, number);
    if (text.size == 0)
        text_add(&text, "-");
    return text_take(&text);
}

/* Widths by this page; columns that the line has no room for are left out, the last ones first. */
static void measure(struct list_table *table, const struct answer *rows, size_t count)
{
    size_t used = ID_WIDTH + STATE_WIDTH + DONE_WIDTH + AGE_WIDTH + 6;
    used += table->sweeps ? COUNT_WIDTH : 0;
    for (size_t c = 0; c < table->count; c++) {
        struct list_column *column = &table->column[c];
        const char *key;
        column->width = strlen(head_of(column));
        for (size_t i = 0; i < count && column->shown; i++) {
            char *shown = cell_text(answer_json_item(rows, i, &key), column);
            size_t width = shown ? cli_text_width(shown) : 0;
            column->width = width > column->width ? width : column->width;
            free(shown);
        }
        column->width = column->width > WIDTH_MAX ? WIDTH_MAX : column->width;
        column->shown = column->shown && used + 2 + column->width <= table->screen.width;
        used += column->shown ? 2 + column->width : 0;
    }
}

static const char *head_of(const struct list_column *column)
{
    return strncmp(column->path, "job.", 4) == 0 ? column->path + 4 : column->path;
}

/* ------------------------------------------------------------------ printing */

int list_table_print(struct list_table *table, const struct answer *rows, size_t count, bool heads)
{
    struct text text = {0};
    const char *key;
    if (heads && count > 0) {
        text_add(&text, "%-*s  %-*s  %*s  %*s", ID_WIDTH, "ID", STATE_WIDTH, "STATE", DONE_WIDTH,
                 "DONE", AGE_WIDTH, "AGE");
        if (table->sweeps)
            text_add(&text, "  %*s", COUNT_WIDTH - 2, "JOBS");
        for (size_t c = 0; c < table->count; c++)
            if (table->column[c].shown)
                add_cell(&text, head_of(&table->column[c]), table->column[c].width);
        text_add(&text, "\n");
    }
    for (size_t i = 0; i < count; i++) {
        const struct answer *record = answer_json_item(rows, i, &key);
        add_fixed(&text, table, record);
        for (size_t c = 0; c < table->count; c++) {
            char *shown = table->column[c].shown ? cell_text(record, &table->column[c]) : NULL;
            if (shown)
                add_cell(&text, shown, table->column[c].width);
            free(shown);
        }
        text_add(&text, "\n");
    }
    if (heads && count == 0 && table->screen.terminal)
        fprintf(stderr, "there are none\n");
    text.failed |= table->failed;
    return cli_print_take(text_take(&text));
}

/* The state of a sweep is that of its jobs. */
static const char *state_of(const struct list_table *table, const struct answer *record)
{
    static const char *const order[] = {"running", "queued", "failed", "cancelled", "done"};
    const struct answer *states = answer_json_at(record, "states");
    const char *state = answer_json_text(record, "state");
    for (size_t i = 0; table->sweeps && i < sizeof order / sizeof *order; i++)
        if (answer_json_number(states, order[i], 0) > 0)
            return order[i];
    return state ? state : "?";
}

static void add_fixed(struct text *text, const struct list_table *table,
                      const struct answer *record)
{
    const char *id = answer_json_text(record, "id"), *state = state_of(table, record);
    int64_t submitted = cli_parse_time(answer_json_text(record, "submitted_at"));
    struct text age = {0};
    if (submitted > 0)
        cli_add_duration(&age, (double)(cli_now_ms() - submitted) / 1000, false);
    char *old = text_take(&age);
    text_add(text, "%-*s  %s%-*s%s  %*.0f %%  %*s", ID_WIDTH, id ? id : "?",
             cli_state_colour(&table->screen, state), STATE_WIDTH, state,
             cli_colour_end(&table->screen), DONE_WIDTH - 2,
             floor(100 * answer_json_number(record, "progress", 0)), AGE_WIDTH, old ? old : "");
    if (table->sweeps)
        text_add(text, "  %*.0f", COUNT_WIDTH - 2, answer_json_number(record, "jobs", 0));
    free(old);
}

/* Right-aligned; control characters replaced, what is too long cut at a character. */
static void add_cell(struct text *text, const char *value, size_t width)
{
    size_t taken = 0, bytes = 0, whole = cli_text_width(value);
    while (value[bytes] && taken + (whole > width) < width) {
        size_t length = text_utf8(value + bytes);
        bytes += length ? length : 1;
        taken++;
    }
    taken += whole > width;
    text_add(text, "  %*s", (int)(width > taken ? width - taken : 0), "");
    for (size_t i = 0; i < bytes; i++) {
        bool control = (unsigned char)value[i] < 0x20 || value[i] == 0x7F;
        text_add_bytes(text, control ? "?" : value + i, 1);
    }
    text_add(text, "%s", whole > width ? "~" : "");
}
