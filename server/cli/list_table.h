/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * list_table.h - records as a table: which columns tell them apart, and how wide they are, is
 * decided by the first page; those that follow are printed as they come.
 */
#ifndef LIST_TABLE_H
#define LIST_TABLE_H

#include "answer_json.h"
#include "cli_words.h"

struct list_column {
    char *path;  /* within the record: "job.diameter" */
    char *first; /* value where it was met first, as text */
    size_t met;  /* rows that have it */
    bool differs, shown;
    size_t width;
};

struct list_table {
    struct cli_screen screen;
    const char *asked; /* "diameter,label", or NULL; borrowed */
    bool sweeps;
    struct list_column *column;
    size_t count;
    bool failed; /* no memory */
};

/* `what` is "jobs" or "sweeps". */
void list_table_init(struct list_table *table, const char *asked, const char *what);
void list_table_choose(struct list_table *table, const struct answer *rows, size_t count);

/* The first page begins with the heads. CLI_OK, or CLI_FAILED with words on stderr. */
int list_table_print(struct list_table *table, const struct answer *rows, size_t count, bool heads);
void list_table_fini(struct list_table *table);

#endif
