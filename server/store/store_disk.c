/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_disk.c - what opening a store and copying one share; see store_internal.h. */
#include "store_internal.h"

#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
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

char *store_beside(const struct store *store, const char *name)
{
    size_t dir = (size_t)(strrchr(store->path, '/') - store->path);
    char *path = NULL;

    return asprintf(&path, "%.*s/%s", (int)dir, store->path, name) < 0 ? NULL : path;
}

enum store_status store_sync_dir(const char *path)
{
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    enum store_status status = fd >= 0 && fsync(fd) == 0 ? STORE_OK : STORE_BROKEN;

    if (fd >= 0)
        close(fd);
    return status;
}
