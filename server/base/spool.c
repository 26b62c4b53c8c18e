/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "spool.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NAMES_GROWTH = 64 };

bool spool_name_sound(const char *name)
{
    size_t length = strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789-.");
    return name[0] != '.' && length > 0 && length < SPOOL_NAME_SIZE && !name[length];
}

int spool_open(int dir, const char *name)
{
    if (mkdirat(dir, name, 0770) != 0 && errno != EEXIST)
        return -1;
    return openat(dir, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

static bool write_all(int fd, const char *bytes, size_t size)
{
    while (size > 0) {
        ssize_t written = write(fd, bytes, size);
        if (written < 0 && errno != EINTR)
            return false;
        if (written > 0) {
            bytes += written;
            size -= (size_t)written;
        }
    }
    return true;
}

/* The unfinished file has the writer's process in its name: two may put the same one. */
bool spool_put(int dir, const char *name, const void *bytes, size_t size)
{
    char unfinished[SPOOL_NAME_SIZE + 32], host[32] = "";
    gethostname(host, sizeof(host) - 1);
    for (char *c = host; *c; c++)
        if (*c == '/')
            *c = '_';
    snprintf(unfinished, sizeof(unfinished), ".%.60s.%.30s.%ld", name, host, (long)getpid());
    int fd = openat(dir, unfinished, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0660);
    if (fd < 0)
        return false;
    bool whole = write_all(fd, bytes, size) && fsync(fd) == 0;
    int code = errno;
    if (close(fd) != 0 && whole) { /* a network file system may tell only now */
        whole = false;
        code = errno;
    }
    if (whole && renameat(dir, unfinished, dir, name) == 0) {
        fsync(dir);
        return true;
    }
    if (whole)
        code = errno;
    unlinkat(dir, unfinished, 0);
    errno = code;
    return false;
}

static char *read_all(int fd, size_t most, size_t *size)
{
    char *bytes = malloc(most + 2); /* pages that are not written to cost nothing */
    ssize_t got = 1;
    *size = 0;
    while (bytes && *size <= most && got != 0) {
        got = read(fd, bytes + *size, most + 1 - *size);
        if (got < 0 && errno != EINTR) {
            free(bytes);
            return NULL;
        }
        *size += got > 0 ? (size_t)got : 0;
    }
    if (bytes && *size > most) {
        free(bytes);
        errno = EFBIG;
        return NULL;
    }
    if (bytes)
        bytes[*size] = '\0';
    return bytes;
}

char *spool_read(int dir, const char *name, size_t most, size_t *size)
{
    struct stat about;
    /* O_NONBLOCK: opening a FIFO would wait. */
    int fd = openat(dir, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    char *bytes = NULL;
    if (fd < 0)
        return NULL;
    if (fstat(fd, &about) == 0 && S_ISREG(about.st_mode))
        bytes = read_all(fd, most, size);
    else
        errno = EINVAL;
    int code = errno;
    close(fd);
    errno = code;
    return bytes;
}

bool spool_move(int from, const char *name, int to, const char *as)
{
    return renameat(from, name, to, as) == 0;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(a, b);
}

char (*spool_list(int dir, size_t *count))[SPOOL_NAME_SIZE]
{
    /* A descriptor of its own, for reading directories moves it. */
    int fd = openat(dir, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *stream = fd >= 0 ? fdopendir(fd) : NULL;
    char(*names)[SPOOL_NAME_SIZE] = NULL;
    const struct dirent *entry;
    *count = 0;
    if (!stream && fd >= 0)
        close(fd);
    while (stream && (entry = readdir(stream))) {
        if (!spool_name_sound(entry->d_name))
            continue;
        if (*count % NAMES_GROWTH == 0) {
            void *more = realloc(names, (*count + NAMES_GROWTH) * sizeof(*names));
            if (!more)
                break;
            names = more;
        }
        snprintf(names[*count], sizeof(*names), "%.79s", entry->d_name);
        ++*count;
    }
    if (stream)
        closedir(stream);
    if (names)
        qsort(names, *count, sizeof(*names), by_name);
    return names;
}

void spool_remove(int dir, const char *name)
{
    unlinkat(dir, name, 0);
}
