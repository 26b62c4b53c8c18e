/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_sql.c - bcd sql: a question to the database in SQL; see cli.h and store_sql.h. */
#include "cli.h"
#include "limits.h"
#include "sql_print.h"
#include "store_sql.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>

#define TIMEOUT_S 60.0
#define TIMEOUT_S_MAX 86400.0

static bool read_timeout(const char *text, double *timeout_s)
{
    char *end;
    *timeout_s = TIMEOUT_S;
    if (!text)
        return true;
    *timeout_s = strtod(text, &end);
    return end != text && !*end && *timeout_s > 0 && *timeout_s <= TIMEOUT_S_MAX;
}

/* The last resort, for a signal handler. */
static char last_words[96];
static volatile sig_atomic_t printing; /* whoever reads us takes the time, not the question */

static void give_up(int number)
{
    (void)number;
    if (printing) {
        alarm(1);
        return;
    }
    (void)!write(STDERR_FILENO, last_words, strlen(last_words));
    _exit(CLI_FAILED);
}

/* SQLite ends a question in time, unless it is in the middle of one function. */
static void arm(double timeout_s)
{
    struct sigaction action = {.sa_handler = give_up, .sa_flags = SA_RESTART};
    double s = timeout_s + LIMIT_SQL_GRACE_MS / 1000.0;
    struct itimerval late = {.it_value.tv_sec = (time_t)s};
    late.it_value.tv_usec = (suseconds_t)(1e6 * (s - (double)late.it_value.tv_sec));
    snprintf(last_words, sizeof last_words,
             "bcd: it takes longer than %g s, in one function that does not end\n", timeout_s);
    sigaction(SIGALRM, &action, NULL);
    setitimer(ITIMER_REAL, &late, NULL);
}

static void disarm(void)
{
    setitimer(ITIMER_REAL, &(struct itimerval){0}, NULL);
}

static void print_names(void *print, size_t columns, const char *const *name)
{
    printing = 1;
    sql_print_names(print, columns, name);
    printing = 0;
}

static bool print_row(void *print, size_t columns, const struct sql_value *value)
{
    printing = 1;
    bool good = sql_print_row(print, columns, value);
    printing = 0;
    return good;
}

static int ask(const struct cli_line *line, const char *file, const char *sql, double timeout_s)
{
    struct sql_print print;
    char reason[512] = "";
    const struct sql_question question = {.file = file, .sql = sql, .timeout_s = timeout_s};
    const struct sql_reader reader = {&print, print_names, print_row};
    sql_print_init(&print, cli_given(line, "json")  ? SQL_PRINT_JSON
                           : cli_given(line, "csv") ? SQL_PRINT_CSV
                                                    : SQL_PRINT_TABLE);
    arm(timeout_s);
    enum store_status status = store_sql_ask(&question, &reader, reason, sizeof reason);
    disarm();
    bool printed = sql_print_fini(&print);
    if (status != STORE_OK)
        fprintf(stderr, "bcd: %s\n", reason);
    else if (!printed)
        fprintf(stderr, "bcd: the answer cannot be written\n");
    return status == STORE_OK && printed ? CLI_OK : CLI_FAILED;
}

static int sql(const struct cli_line *line)
{
    const char *dir = cli_value(line, "data"), *given = cli_value(line, "file");
    char *file = NULL, *typed = NULL;
    double timeout_s;
    size_t size = 0;
    int status = CLI_FAILED;
    if (cli_given(line, "schema"))
        return cli_print_take(store_sql_schema());
    if (line->operands != 1 || (!dir && !given))
        return cli_wrong(line->command, "%s",
                         line->operands != 1 ? "a statement is wanted, in quotes; - reads it"
                                             : "--data DIR or --file FILE tells the database");
    if (!read_timeout(cli_value(line, "timeout"), &timeout_s))
        return cli_wrong(line->command, "--timeout is up to %g seconds, not \"%s\"", TIMEOUT_S_MAX,
                         cli_value(line, "timeout"));
    if (asprintf(&file, dir ? "%s/bcd.sqlite" : "%s", dir ? dir : given) < 0)
        file = NULL;
    if (strcmp(line->operand[0], "-") == 0)
        typed = cli_read_file("-", &size);
    if (file && (typed || strcmp(line->operand[0], "-") != 0))
        status = ask(line, file, typed ? typed : line->operand[0], timeout_s);
    free(typed);
    free(file);
    return status;
}

static const struct cli_option options[] = {
    {.name = "data", .value = "DIR", .doc = "of a daemon, which may be running", .either = 1},
    {.name = "file", .value = "FILE", .doc = "a backup", .either = 1},
    {.name = "timeout", .value = "S", .doc = "seconds it may take (default: 60)"},
    {.name = "csv", .doc = "CSV instead of a table", .either = 2},
    {.name = "json", .doc = "a list of objects instead", .either = 2},
    {.name = "schema", .doc = "prints what tables there are, with comments"},
    {0},
};

const struct cli_command cli_sql_command = {
    .name = "sql",
    .operands = "[SELECT|-]",
    .most = 1,
    .doc = "asks the database of a daemon, or a backup of it, in SQL",
    .text =
        "jobs has a column for each parameter (diameter, potential_amplitude) and derived fact\n"
        "(derived_steps), and of what became of it (outcome_realizations, "
        "outcome_target_reached);\n"
        "msd(job), density(job), energy(job) and the like are the results of one "
        "job\n"
        "as tables, energy alone those of all jobs; notes(job) the remarks on them:\n"
        "\n"
        "  bcd sql --data data \"select j.diameter, m.lag, m.msd from jobs j, msd(j.id) m\n"
        "                       where j.potential_amplitude = 6 and m.lag < 1e-2\"\n"
        "\n"
        "Nothing can be changed. The same tables in other programs: .load bcd_sqlite in sqlite3.",
    .options = options,
    .function = sql,
};
