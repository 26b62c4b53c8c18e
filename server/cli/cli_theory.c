/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_theory.c - bcd theory: the exact references of a job; see cli.h. */
#include "cli.h"
#include "theory_print.h"

/* However long it takes; NULL = out of memory. */
static char *print(const struct bcd_scene *scene)
{
    struct bcd_theory *exact = NULL;
    char *text = NULL;
    if (bcd_theory_create(&exact, scene, BCD_THEORY_INFINITE, NULL, NULL) == BCD_OK)
        theory_print(exact, scene, &text);
    bcd_theory_free(exact);
    return text;
}

static int theory(const struct cli_line *line)
{
    struct bcd_scene *scene = NULL;
    int status = cli_load_job(line->operand[0], &scene);
    if (status == CLI_OK)
        status = cli_print_take(print(scene));
    bcd_scene_free(scene);
    return status;
}

const struct cli_command cli_theory_command = {
    .name = "theory",
    .operands = "JOB.json",
    .least = 1,
    .most = 1,
    .doc = "prints the exact references of a job",
    .text = "For each observable the exact values on its own bins or lags: \"theory\" is the ring\n"
            "of N rods that a simulation samples, \"infinite\" the infinite system at the same\n"
            "density; null with a reason where there is none.",
    .function = theory,
};
