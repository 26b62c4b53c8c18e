/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_help.c - usage and help of a command from its row; see cli.h. */
#include "cli.h"
#include "text.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 80, OPTION_WIDTH = 22 };

/* A line that is being filled with words. */
struct line {
    FILE *out;
    size_t column, indent;
    bool empty; /* no word is in it yet */
};

static void add_usage(struct text *text, const struct cli_command *command);
static void put_word(struct line *line, const char *word, size_t size);
static void end_line(struct line *line);
static void put_text(struct line *line, const char *text);
static void put_options(const struct cli_command *command);

void cli_usage(FILE *out, const struct cli_command *command)
{
    struct text text = {0};
    struct line line = {.out = out, .indent = 11, .empty = true};
    add_usage(&text, command);
    char *usage = text_take(&text), *next = usage;
    line.column = (size_t)fprintf(out, "usage:");
    line.empty = false;
    /* Words end at a blank outside of brackets. */
    while (next && *next) {
        size_t size = 0;
        for (int depth = 0; next[size] && (depth > 0 || next[size] != ' '); size++)
            depth += (next[size] == '[') - (next[size] == ']');
        put_word(&line, next, size);
        next += size + (next[size] == ' ');
    }
    end_line(&line);
    free(usage);
}

int cli_help(const struct cli_command *command)
{
    struct line line = {.out = stdout, .empty = true};
    cli_usage(stdout, command);
    end_line(&line);
    put_text(&line, command->doc);
    if (command->text) {
        end_line(&line);
        put_text(&line, command->text);
    }
    put_options(command);
    line.indent = 7;
    for (size_t i = 0; command->parts && command->parts[i]; i++) {
        end_line(&line);
        cli_usage(stdout, command->parts[i]);
        put_text(&line, command->parts[i]->doc);
    }
    return CLI_OK;
}

/* "bcd run JOB.json [--csv OBSERVABLE | --svg OBSERVABLE] [--quiet]" */
static void add_usage(struct text *text, const struct cli_command *command)
{
    const struct cli_option *row, *before = NULL;
    text_add(text, "bcd %s", command->name);
    if (command->parts) {
        text_add(text, " ");
        for (size_t i = 0; command->parts[i]; i++)
            text_add(text, "%s%s", i ? "|" : "", strchr(command->parts[i]->name, ' ') + 1);
        text_add(text, " ...");
    }
    if (command->operands[0])
        text_add(text, " %s", command->operands);
    for (size_t i = 0; (row = cli_option_at(command, i)); i++) {
        bool joined = before && row->either && row->either == before->either;
        if (before && !joined)
            text_add(text, "]%s", before->many ? "..." : "");
        text_add(text, joined ? " | " : " [");
        text_add(text, "--%s%s%s", row->name, row->value ? " " : "", row->value ? row->value : "");
        before = row;
    }
    if (before)
        text_add(text, "]%s", before->many ? "..." : "");
}

static void put_options(const struct cli_command *command)
{
    const struct cli_option *row;
    for (size_t i = 0; (row = cli_option_at(command, i)); i++) {
        struct line line = {.out = stdout, .indent = OPTION_WIDTH, .empty = true};
        if (i == 0)
            end_line(&line);
        line.column = (size_t)printf("  --%s%s%s", row->name, row->value ? " " : "",
                                     row->value ? row->value : "");
        if (row->letter)
            line.column += (size_t)printf(", -%c", row->letter);
        if (line.column + 2 > OPTION_WIDTH)
            end_line(&line);
        put_text(&line, row->doc);
    }
}

/* Puts a word after those in the line, on the next line if it has no room. */
static void put_word(struct line *line, const char *word, size_t size)
{
    if (!line->empty && line->column + 1 + size > WIDTH)
        end_line(line);
    if (line->empty && line->column < line->indent)
        line->column += (size_t)fprintf(line->out, "%*s", (int)(line->indent - line->column), "");
    line->column += (size_t)fprintf(line->out, "%s%.*s", line->empty ? "" : " ", (int)size, word);
    line->empty = false;
}

static void end_line(struct line *line)
{
    fputc('\n', line->out);
    line->column = 0;
    line->empty = true;
}

/* Flowing lines are filled anew, lines that begin with a blank and empty ones stay. */
static void put_text(struct line *line, const char *text)
{
    for (const char *end; *text; text = end + (*end == '\n')) {
        end = text + strcspn(text, "\n");
        if (text == end || *text == ' ') {
            if (!line->empty)
                end_line(line);
            fprintf(line->out, "%.*s\n", (int)(end - text), text);
            continue;
        }
        while (text < end) {
            size_t size = strcspn(text, " \n");
            put_word(line, text, size);
            text += size + (text[size] == ' ');
        }
    }
    if (!line->empty)
        end_line(line);
}
