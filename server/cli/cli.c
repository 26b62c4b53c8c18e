/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd, the command line: main and the table of subcommands.
 */
#include "cli.h"
#include "record_json.h"

#include <gsl/gsl_errno.h>

#include <stdio.h>
#include <string.h>

static const struct cli_command commands[] = {
    {.name = "run",
     .usage = "JOB.json [--workers N] [--csv OBSERVABLE | --svg OBSERVABLE | --record] [--quiet]",
     .doc =
         "runs a job and prints its results as JSON\n"
         "The numbers are those of the service, bit for bit, whatever the number of workers.\n"
         "\n"
         "  JOB.json          the job; - reads it from stdin\n"
         "  --workers N       threads (default: all cores)\n"
         "  --csv OBSERVABLE  prints this observable as CSV instead\n"
         "  --svg OBSERVABLE  prints this observable as a picture instead\n"
         "  --record          prints {\"job\", \"derived\", \"results\"}\n"
         "  --quiet           no progress bar (there is none either unless stderr is a "
         "terminal)\n"
         "\n"
         "Exit status: 0 done, 1 the job is wrong or failed, 2 wrong command line, 130 ended by\n"
         "Ctrl-C.",
     .function = cli_run},
    {.name = "check",
     .usage = "JOB.json",
     .doc = "checks a job without running it\n"
            "Prints the job completed with its defaults, what follows from it, and an estimate of\n"
            "memory and time: {\"job\", \"derived\", \"estimate\"}. All faults go to stderr, each "
            "with the\n"
            "JSON pointer of its field; the exit status is then 1.",
     .function = cli_check},
    {.name = "theory",
     .usage = "JOB.json",
     .doc = "prints the exact references of a job\n"
            "For each observable the exact values on its own bins or lags: \"theory\" is the ring "
            "of N\n"
            "rods that a simulation samples, \"infinite\" the infinite system at the same density; "
            "null\n"
            "with a reason where there is none.",
     .function = cli_theory},
    {.name = "report",
     .usage = "NAME [options]",
     .doc = "runs many jobs and judges them together\n"
            "bcd report NAME --help tells more. The reports:",
     .function = cli_report},
    {.name = "bench",
     .usage = "[--json FILE]",
     .doc = "measures what a step costs, per method and scene\n"
            "Nanoseconds of one core per rod and step, and the ratio to drawing the noise and\n"
            "evaluating the force alone, measured in turns with it; 10 to 10^7 rods, medians with\n"
            "standard errors, bytes per rod. Then what a second worker gains and what observables\n"
            "cost. On a shared machine trust the ratio. About three minutes.",
     .function = cli_bench},
    {0},
};

static const struct cli_command *find(const char *name)
{
    for (const struct cli_command *command = commands; command->name; command++)
        if (strcmp(command->name, name) == 0)
            return command;
    return NULL;
}

static void usage(FILE *out)
{
    fputs("usage: bcd COMMAND ...\n\n", out);
    for (const struct cli_command *command = commands; command->name; command++)
        fprintf(out, "  %-8s %.*s\n", command->name, (int)strcspn(command->doc, "\n"),
                command->doc);
    fputs("\nbcd help COMMAND tells more; bcd --version tells the version.\n", out);
}

static int help(int argc, char **argv)
{
    const struct cli_command *command = argc > 2 ? find(argv[2]) : NULL;
    if (command)
        return cli_help(command);
    if (argc > 2) {
        fprintf(stderr, "bcd: there is no command \"%s\"\n", argv[2]);
        usage(stderr);
        return CLI_USAGE;
    }
    usage(stdout);
    return CLI_OK;
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    const struct cli_command *command = find(name);
    gsl_set_error_handler_off(); /* its own would abort the process */
    record_json_seed();
    if (command)
        return command->function(command, argc - 1, argv + 1);
    if (strcmp(name, "--version") == 0) {
        puts("bcd " BCD_VERSION);
        return CLI_OK;
    }
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0 || strcmp(name, "help") == 0)
        return help(argc, argv);
    if (*name)
        fprintf(stderr, "bcd: there is no command \"%s\"\n", name);
    usage(stderr);
    return CLI_USAGE;
}
