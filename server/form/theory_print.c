/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "theory_print.h"
#include "table_json.h"

#include <stdlib.h>

enum bcd_status theory_print(const struct bcd_theory *theory, const struct bcd_scene *scene,
                             char **text)
{
    struct bcd_table **tables = NULL;
    size_t count = 0, made = 0;
    enum bcd_status status = BCD_OK;

    while (bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, count))
        count++;
    tables = calloc(count + 1, sizeof *tables);
    if (!tables)
        return BCD_NO_MEMORY;
    for (; made < count; made++) {
        status = bcd_theory_table(theory, scene, made, &tables[made]);
        if (status)
            goto cleanup;
    }
    status = bcd_theory_summary(theory, &tables[made]);
    if (status)
        goto cleanup;
    made++;
    *text = table_json_print_all(tables, made);
    status = *text ? BCD_OK : BCD_NO_MEMORY;
cleanup:
    for (size_t i = 0; i < made; i++)
        bcd_table_free(tables[i]);
    free(tables);
    return status;
}
