/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli.h - the program `bcd`. A command is one file with one const row, and one line in
 * cli_commands.c. Help,
 * the manual page, the shells' completions and the reading of the command line come from the rows.
 * These functions print; nothing below them does.
 */
#ifndef CLI_H
#define CLI_H

#include "bcd.h"

#include <stdio.h>

/* What the program ends with; after a signal it is 128 + its number (Ctrl-C: 130). */
enum {
    CLI_OK = 0,
    CLI_FAILED = 1,      /* the job is wrong, failed or was cancelled; the server refused */
    CLI_USAGE = 2,       /* wrong command line */
    CLI_UNREACHABLE = 3, /* no server, or it was lost and did not come back */
    CLI_FORBIDDEN = 4,   /* no token, a wrong one, or one that may not do this */
    CLI_SIGNAL = 128
};

/* Words are flowing text, wrapped where they are shown; lines that begin with a blank stay as they
 * are. */
struct cli_option {
    const char *name;  /* without its dashes; NULL ends a list */
    char letter;       /* short form, or 0 */
    const char *value; /* what it takes: "N", "FILE", "DIR"; NULL = nothing */
    const char *doc;
    const char *choices; /* its values if they are few, "a b c"; for completion alone */
    bool many;           /* may be given several times */
    int either;          /* neighbours with the same number exclude one another; 0 = none */
};

struct cli_line;
struct cli_command {
    const char *name;                             /* "run"; "report figures" */
    const char *operands;                         /* "JOB.json"; "" = none */
    size_t least, most;                           /* how many of them */
    const char *doc;                              /* one line */
    const char *text;                             /* more of it, or NULL */
    const struct cli_option *options;             /* ends with {0}; NULL = none */
    bool server;                                  /* talks to one: has cli_server_options too */
    const struct cli_command *const *parts;       /* "report" has parts and no function */
    int (*function)(const struct cli_line *line); /* returns the exit status */
};

/* A command line that was read: every option is in the row and has a value if it needs one. */
enum { CLI_GIVEN_MAX = 128 };
struct cli_line {
    const struct cli_command *command;
    size_t operands;
    char *const *operand;
    size_t given;
    struct {
        const struct cli_option *row;
        const char *value;
    } option[CLI_GIVEN_MAX];
};

extern const struct cli_command cli_run_command, cli_check_command, cli_theory_command;
extern const struct cli_command cli_report_command, cli_bench_command, cli_schema_command;

extern const struct cli_command cli_submit_command, cli_cancel_command, cli_estimate_command;
extern const struct cli_command cli_watch_command, cli_list_command, cli_get_command;
extern const struct cli_command cli_export_command, cli_sweep_command, cli_token_command;
extern const struct cli_command cli_whoami_command, cli_completion_command, cli_backup_command;
extern const struct cli_command cli_owners_command, cli_quota_command, cli_audit_command;
extern const struct cli_command cli_sql_command, cli_worker_command;

/* ---- cli_commands.c */

/* In the order of the documentation; NULL past the last. */
const struct cli_command *cli_command_at(size_t i);
const struct cli_command *cli_command_find(const char *name);
const struct cli_command *cli_part_find(const struct cli_command *command, const char *name);
const char *cli_word(const struct cli_command *command); /* "figures" of "report figures" */

/* ---- cli_line.c */

/* argv[0] is the (last word of the) command's name. CLI_OK; or CLI_USAGE with words on stderr.
 * *help is whether --help was asked for: then nothing else counts. */
int cli_line_read(const struct cli_command *command, int argc, char **argv, struct cli_line *line,
                  bool *help);

/* The i-th option of a command, its own first; NULL past the last. */
const struct cli_option *cli_option_at(const struct cli_command *command, size_t i);

/* The value that was given ("" for one that takes none), the last or the i-th; NULL = it was not.
 * The row must have that name. */
const char *cli_value(const struct cli_line *line, const char *name);
const char *cli_value_at(const struct cli_line *line, const char *name, size_t i);
bool cli_given(const struct cli_line *line, const char *name);

/* ---- cli_help.c, cli_manual.c */

/* "bcd run JOB.json [--workers N] ...", wrapped. */
void cli_usage(FILE *out, const struct cli_command *command);

/* Usage, words and options of a command on stdout. */
int cli_help(const struct cli_command *command);

/* bcd(1), malloc'ed; NULL = out of memory. */
char *cli_manual(void);

/* ---- cli_job.c */

/* A wrong command line: words (printf-style) and usage on stderr; returns CLI_USAGE. */
int cli_wrong(const struct cli_command *command, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The value of --workers, or the number of cores when it was not given; CLI_OK, or CLI_USAGE with
 * words on stderr. */
int cli_workers(const struct cli_line *line, int64_t *workers);

/* Whole number within min..max; false = it is none. */
bool cli_parse_integer(const char *text, int64_t min, int64_t max, int64_t *value);

/* Bytes of a file ("-" = stdin), NUL-terminated, malloc'ed: at most one more than a body may have.
 * NULL with words on stderr. */
char *cli_read_file(const char *path, size_t *size);

/* Reads, completes and prepares the job in a file ("-" = stdin); its faults go to stderr, one a
 * line. CLI_OK and a scene that the caller frees, or CLI_FAILED. */
int cli_load_job(const char *path, struct bcd_scene **scene);
/* The same where preparing it may not take longer than starting it may take the service. */
int cli_check_job(const char *path, struct bcd_scene **scene);

/* Text from elsewhere: control characters must not reach a terminal. */
void cli_put_clean(FILE *out, const char *text);

/* Prints the text on stdout and frees it; NULL = out of memory. CLI_FAILED, with words on stderr,
 * when it could not be written in full. */
int cli_print_take(char *text);
int cli_print_bytes(const char *bytes, size_t size);

#endif
