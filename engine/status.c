/* SPDX-License-Identifier: GPL-3.0-or-later
 * status.c - see status.h. */
#include "status.h"

#include <stdarg.h>
#include <stdio.h>

const char *bcd_status_text(enum bcd_status status)
{
    static const char *const text[] = {
        [BCD_OK] = "ok",
        [BCD_INVALID] = "the job is not valid",
        [BCD_NO_MEMORY] = "not enough memory",
        [BCD_CORRUPT] = "stored data is damaged or of another kind",
        [BCD_INTERNAL] = "internal error",
        [BCD_STOPPED] = "stopped before it was done",
    };
    return (size_t)status < sizeof text / sizeof *text ? text[status] : "unknown status";
}

static void fill(struct bcd_error *error, enum bcd_status code, const char *field,
                 const char *format, va_list arguments)
{
    error->code = code;
    snprintf(error->field, sizeof error->field, "%s", field);
    vsnprintf(error->text, sizeof error->text, format, arguments);
}

enum bcd_status error_set(struct bcd_error *error, enum bcd_status code, const char *field,
                          const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    if (error)
        fill(error, code, field, format, arguments);
    va_end(arguments);
    return code;
}

void bcd_errors_add(struct bcd_errors *errors, const char *field, const char *format, ...)
{
    if (!errors)
        return;
    if (errors->count == BCD_ERRORS_MAX) {
        errors->dropped++;
        return;
    }
    va_list arguments;
    va_start(arguments, format);
    fill(&errors->items[errors->count++], BCD_INVALID, field, format, arguments);
    va_end(arguments);
}

void errors_no_memory(struct bcd_errors *errors, const char *field)
{
    size_t at = errors->count;
    bcd_errors_add(errors, field, "no memory");
    if (at < errors->count)
        errors->items[at].code = BCD_NO_MEMORY;
}

enum bcd_status errors_status(const struct bcd_errors *errors)
{
    for (size_t i = 0; i < errors->count; i++)
        if (errors->items[i].code == BCD_NO_MEMORY)
            return BCD_NO_MEMORY;
    return errors->count > 0 ? BCD_INVALID : BCD_OK;
}
