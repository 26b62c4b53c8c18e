/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "faults.h"

void faults_no_memory(struct bcd_errors *errors, const char *field)
{
    size_t at = errors->count;
    bcd_errors_add(errors, field, "no memory");
    if (at < errors->count)
        errors->items[at].code = BCD_NO_MEMORY;
}

enum bcd_status faults_status(const struct bcd_errors *errors)
{
    for (size_t i = 0; i < errors->count; i++)
        if (errors->items[i].code == BCD_NO_MEMORY)
            return BCD_NO_MEMORY;
    return errors->count > 0 ? BCD_INVALID : BCD_OK;
}
