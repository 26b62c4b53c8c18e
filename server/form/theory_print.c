/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "theory_print.h"
#include "table_json.h"

#include <stdlib.h>

char *theory_print(const struct bcd_scene *scene)
{
    struct bcd_theory *theory = NULL;
    struct bcd_table **tables = NULL;
    size_t count = 0, made = 0;
    char *text = NULL;

    while (bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, count))
        count++;
    tables = calloc(count + 1, sizeof *tables);
    if (!tables || bcd_theory_create(&theory, scene, BCD_THEORY_INFINITE))
        goto cleanup;
    for (; made < count; made++)
        if (bcd_theory_table(theory, scene, made, &tables[made]))
            goto cleanup;
    if (bcd_theory_summary(theory, &tables[made]))
        goto cleanup;
    made++;
    text = table_json_print_all(tables, made);
cleanup:
    for (size_t i = 0; i < made; i++)
        bcd_table_free(tables[i]);
    free(tables);
    bcd_theory_free(theory);
    return text;
}
