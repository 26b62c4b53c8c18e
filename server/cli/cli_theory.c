/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_theory.c - bcd theory: the exact references of a job; see cli.h. */
#include "cli.h"
#include "theory_print.h"

int cli_theory(const struct cli_command *self, int argc, char **argv)
{
    struct bcd_scene *scene = NULL;
    if (argc != 2)
        return cli_wrong(self, "one job is needed");
    int status = cli_load_job(argv[1], &scene);
    if (status == CLI_OK)
        status = cli_print_take(theory_print(scene));
    bcd_scene_free(scene);
    return status;
}
