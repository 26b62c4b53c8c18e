/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_table.h"
#include "cli.h"
#include "cli_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void print_cell(const struct answer *row, const struct cli_column *column)
{
    struct text text = {0};
    double number = answer_json_number(row, column->path, NAN);
    if (column->cell == CELL_NUMBER && isfinite(number))
        cli_add_number(&text, number);
    else if (column->cell == CELL_BYTES && isfinite(number))
        cli_add_bytes(&text, number);
    else
        answer_json_add(&text, answer_json_at(row, column->path));
    char *words = text_take(&text);
    if (words && column->cell == CELL_TIME && cli_parse_time(words) > 0 && strlen(words) > 16) {
        words[10] = ' ';
        words[16] = '\0';
    }
    const char *shown = words && *words ? words : "-";
    int left = column->width - (int)cli_text_width(shown);
    cli_put_clean(stdout, shown);
    printf("%*s", column->width == 0 ? 0 : left > 2 ? left : 2, "");
    free(words);
}

void cli_table_heads(const struct cli_column *columns)
{
    for (; columns->head; columns++)
        printf("%-*s", columns->width, columns->head);
    putchar('\n');
}

void cli_table_row(const struct cli_column *columns, const struct answer *row)
{
    for (; columns->head; columns++)
        print_cell(row, columns);
    putchar('\n');
}
