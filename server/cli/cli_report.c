/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_report.c - bcd report: many jobs run and judged together; the rows of the reports. */
#include "cli_report.h"

static const struct cli_option figures_options[] = {
    {.name = "out", .value = "DIR", .doc = "where files go; made when missing (default: figures)"},
    {.name = "only",
     .value = "TEXT",
     .doc = "only scenes whose name contains it: fig4, fig3-sigma0.2, gamma10, 2024"},
    {.name = "full", .doc = "long runs with smaller steps: HOURS of one core, not 6 minutes"},
    {.name = "method",
     .value = "M",
     .doc = "another method than the figure's, with the step it chooses itself"},
    {.name = "workers", .value = "N", .doc = "threads (default: all cores)"},
    {.name = "jobs", .doc = "runs nothing: prints all jobs, completed, as one JSON object"},
    {.name = "quiet",
     .letter = 'q',
     .doc = "no progress bar (there is none either unless stderr is a terminal)"},
    {0},
};

static const struct cli_command figures = {
    .name = "report figures",
    .operands = "",
    .doc = "simulates Figs. 3 to 6 of the 2022 paper, Figs. 6 and 7 of the 2024 one, beside theory",
    .text =
        "Density and contact density of hard rods (Figs. 3, 4), both of sticky rods (Fig. 6),\n"
        "their attraction (Fig. 5, computed); doi 10.1103/PhysRevE.106.054606. Displacements of\n"
        "sticky rods in wells (Fig. 7 of doi 10.1016/j.cpc.2024.109474; method auto). Run time\n"
        "against N of the published methods, bcd and strang (its Fig. 6; timed here on one core).\n"
        "Each figure becomes a picture (SVG), each panel a table (CSV) in DIR. Printed, and kept\n"
        "in 2022-figures.csv, are for each panel:\n"
        "  L1         integral of |measured - theory| over a period, relative to that of theory\n"
        "  max|z|     largest distance of a bin in standard errors\n"
        "  chi2/dof   sum of z squared per bin, and p, how likely as much is by chance\n"
        "  core s     processor time, of all observables of a run together\n"
        "A small p is no failure: method bcd has an error of the square root of the time step,\n"
        "most of all at contact. Where contacts are rare, z and p take few counts for a normal\n"
        "law. The runs start in exact equilibrium; short ones keep part of it.",
    .options = figures_options,
    .function = cli_report_figures,
};

static const struct cli_option work_precision_options[] = {
    {.name = "out", .value = "DIR", .doc = "work-precision.json, .csv and .svg go there"},
    {.name = "json", .value = "FILE", .doc = "only the JSON"},
    {.name = "short", .doc = "a tenth of the time: a minute and a half", .either = 1},
    {.name = "full", .doc = "ten times the time: more than an hour", .either = 1},
    {.name = "scene", .value = "NAME", .doc = "only this scene"},
    {.name = "method", .value = "M", .doc = "only this method"},
    {.name = "budget",
     .value = "S",
     .doc = "core seconds for the averages of one entry instead (default: 1.5)"},
    {.name = "quiet", .letter = 'q', .doc = "no progress on the terminal"},
    {0},
};

static const struct cli_command work_precision = {
    .name = "report work-precision",
    .operands = "",
    .doc = "measures error against run time of every method, on this machine",
    .text =
        "Scenes: sparse (sigma 0.5, rho 0.5), medium (0.8, 0.8), dense (0.95, 1), all with U0 =\n"
        "6; stiff (medium with U0 = 20); sticky (medium with gamma 1, range 0.05). Each method\n"
        "runs with several time steps, on one core; those that refuse a scene are left out, with\n"
        "their words.\n"
        "  cost     ns of one core per rod and unit of simulated time, sampling included\n"
        "  energy   mean external energy per rod minus the exact one, kT\n"
        "  L1       integral of |density - exact| over a period, relative; noise: the part\n"
        "           of it that error bars alone would give\n"
        "  contact  mean contact density relative to the exact one, minus 1\n"
        "  drift    drift velocity under a force relative to a reference run of strang with\n"
        "           a quarter of its own step (there is no exact one), minus 1\n"
        "Below: the order in h of each, with its standard error, and the cost at L1 = 0.005.\n"
        "A dash is what is lost in the noise, or is no order: the JSON has the reason.",
    .options = work_precision_options,
    .function = cli_report_work_precision,
};

static const struct cli_option stability_options[] = {
    {.name = "json", .value = "FILE", .doc = "the verdicts as JSON too, written as they are found"},
    {.name = "only",
     .value = "TEXT",
     .doc = "only extremes whose name contains it: U0, ell, sticky"},
    {.name = "method", .value = "M", .doc = "only this method"},
    {0},
};

static const struct cli_command stability = {
    .name = "report stability",
    .operands = "",
    .doc = "tries every method at the extremes: strong fields, jammed systems, long drag, ...",
    .text =
        "  right    within 3 standard errors of the exact value\n"
        "  biased   by how much: energy in kT, density relative L1, velocity relative\n"
        "  ran      finite, and rods in order; there is no exact value, or the run was too\n"
        "           short to tell: see its words\n"
        "  refused  before it ran, in words\n"
        "Anything else is a silent failure, and the exit status 1. Each runs in a process of its\n"
        "own: a crash or a hang is a verdict too. About two minutes of one core; Ctrl-C ends it\n"
        "with what it has.",
    .options = stability_options,
    .function = cli_report_stability,
};

static const struct cli_command *const reports[] = {&figures, &work_precision, &stability, NULL};

const struct cli_command cli_report_command = {
    .name = "report",
    .operands = "",
    .doc = "runs many jobs here and judges them together",
    .parts = reports,
};
