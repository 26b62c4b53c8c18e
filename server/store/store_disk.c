/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_disk.c - what opening a store and copying one share; see store_internal.h. */
#include "store_internal.h"

#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

enum store_status store_refuse(const struct store_reason *reason, enum store_status status,
                               const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(reason->text, reason->size, format, arguments);
    va_end(arguments);
    return status;
}

enum store_status store_sync_dir(const char *path)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    enum store_status status = fd >= 0 && fsync(fd) == 0 ? STORE_OK : STORE_BROKEN;

    if (fd >= 0)
        close(fd);
    return status;
}
