/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_report.c - bcd report: many jobs run and judged together; the table of reports. */
#include "cli_report.h"

#include <assert.h>
#include <getopt.h>
#include <stdio.h>
#include <string.h>

/* Names as after `bcd`: help and complaints say "bcd report figures". */
static const struct cli_command reports[] = {
    {.name = "report figures",
     .usage = "[--out DIR] [--only TEXT] [--full] [--method M] [--workers N] [--quiet] [--jobs]",
     .doc =
         "simulates Figs. 3 to 6 of the 2022 paper, Figs. 6 and 7 of the 2024 one, beside theory\n"
         "Density and contact density of hard rods (Figs. 3, 4), both of sticky rods (Fig. 6), "
         "their\n"
         "attraction (Fig. 5, computed); doi 10.1103/PhysRevE.106.054606. Displacements of sticky "
         "rods\n"
         "in wells (Fig. 7 of doi 10.1016/j.cpc.2024.109474; method auto). Run time against N of "
         "the\n"
         "published methods, bcd and strang (its Fig. 6; timed here on one core). Each figure "
         "becomes a\n"
         "picture (SVG), each panel a table (CSV) in DIR. Printed, and kept in 2022-figures.csv, "
         "are\n"
         "for each panel:\n"
         "  L1         integral of |measured - theory| over a period, relative to that of theory\n"
         "  max|z|     largest distance of a bin in standard errors\n"
         "  chi2/dof   sum of z squared per bin, and p, how likely at least as much is by chance\n"
         "  core s     processor time, of all observables of a run together\n"
         "A small p is no failure: method bcd has an error of the square root of the time step, "
         "most\n"
         "of all at contact. Where contacts are rare, z and p take few counts for a normal law.\n"
         "The runs start in exact equilibrium; short ones keep part of it.\n"
         "\n"
         "  --out DIR    where files go; made when missing (default: figures)\n"
         "  --only TEXT  only scenes whose name contains it: fig4, fig3-sigma0.2, gamma10, 2024\n"
         "  --full       long runs with smaller steps: HOURS of one core, not 6 minutes\n"
         "  --method M   another method than the figure's, with the step it chooses itself\n"
         "  --workers N  threads (default: all cores)\n"
         "  --jobs       runs nothing: prints all jobs, completed, as one JSON object\n"
         "  --quiet      no progress bar (there is none either unless stderr is a terminal)",
     .function = cli_report_figures},
    {.name = "report work-precision",
     .usage = "[--out DIR] [--json FILE] [--short | --full] [--scene NAME] [--method M] "
              "[--budget S] [--quiet]",
     .doc =
         "measures error against run time of every method, on this machine\n"
         "Scenes: sparse (sigma 0.5, rho 0.5), medium (0.8, 0.8), dense (0.95, 1), all with U0 = "
         "6;\n"
         "stiff (medium with U0 = 20); sticky (medium with gamma 1, range 0.05). Each method runs "
         "with\n"
         "several time steps, on one core; those that refuse a scene are left out, with their "
         "words.\n"
         "  cost     ns of one core per rod and unit of simulated time, sampling included\n"
         "  energy   mean external energy per rod minus the exact one, kT\n"
         "  L1       integral of |density - exact| over a period, relative; noise: the part of it "
         "that\n"
         "           error bars alone would give\n"
         "  contact  mean contact density relative to the exact one, minus 1\n"
         "  drift    drift velocity under a force relative to a reference run of strang with a\n"
         "           quarter of its own step (there is no exact one), minus 1\n"
         "Below: the order in h of each, with its standard error, and the cost at L1 = 0.005.\n"
         "A dash is what is lost in the noise, or is no order: the JSON has the reason.\n"
         "\n"
         "  --out DIR    work-precision.json, .csv and .svg go there\n"
         "  --json FILE  only the JSON\n"
         "  --short      a tenth of the time: a minute and a half\n"
         "  --full       ten times the time: more than an hour\n"
         "  --budget S   core seconds for the averages of one entry instead (default: 1.5)",
     .function = cli_report_work_precision},
    {.name = "report stability",
     .usage = "[--json FILE] [--only TEXT] [--method M]",
     .doc =
         "tries every method at the extremes: strong fields, dense and jammed systems, long drag, "
         "...\n"
         "  right    within 3 standard errors of the exact value\n"
         "  biased   by how much: energy in kT, density relative L1, velocity relative\n"
         "  ran      finite, and rods in order; there is no exact value, or the run was too "
         "short\n"
         "           to tell: see its words\n"
         "  refused  before it ran, in words\n"
         "Anything else is a silent failure, and the exit status 1. Each runs in a process of its "
         "own:\n"
         "a crash or a hang is a verdict too. About two minutes of one core; Ctrl-C ends it with "
         "what\n"
         "it has.\n"
         "\n"
         "  --json FILE  the verdicts as JSON too, written as they are found\n"
         "  --only TEXT  only extremes whose name contains it: U0, ell, sticky\n"
         "  --method M   only this method",
     .function = cli_report_stability},
    {0},
};

int cli_report(const struct cli_command *self, int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        cli_help(self);
        for (const struct cli_command *report = reports; report->name; report++)
            printf("\n  bcd %s %s\n      %.*s\n", report->name, report->usage,
                   (int)strcspn(report->doc, "\n"), report->doc);
        return CLI_OK;
    }
    for (const struct cli_command *report = reports; report->name; report++)
        if (strcmp(strchr(report->name, ' ') + 1, name) == 0)
            return report->function(report, argc - 1, argv + 1);
    return *name ? cli_wrong(self, "there is no report \"%s\"", name)
                 : cli_wrong(self, "which report?");
}

int cli_report_parse(const struct cli_command *self, int argc, char **argv,
                     const struct cli_report_option *options, bool *help)
{
    enum { HELP = CLI_REPORT_OPTIONS_MAX + 1 }; /* others return their place, counted from 1 */
    struct option names[CLI_REPORT_OPTIONS_MAX + 2] = {{"help", no_argument, NULL, HELP}};
    int c, count = 0;
    for (; options[count].name; count++) {
        assert(count < CLI_REPORT_OPTIONS_MAX);
        names[count + 1] = (struct option){
            options[count].name, options[count].flag ? no_argument : required_argument, NULL,
            count + 1};
    }
    opterr = 0;
    while ((c = getopt_long(argc, argv, ":h", names, NULL)) != -1) {
        *help = c == 'h' || c == HELP;
        if (*help)
            return CLI_OK;
        if (c < 1 || c > count)
            return cli_wrong_option(self, c, argv[optind - 1]);
        if (options[c - 1].flag)
            *options[c - 1].flag = true;
        else
            *options[c - 1].value = optarg;
    }
    return optind == argc ? CLI_OK : cli_wrong(self, "%s is no option", argv[optind]);
}
