/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "share_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

static const char *const places[SHARE_PLACES] = {
    [SHARE_OFFERS] = "offers",   [SHARE_TAKEN] = "taken",     [SHARE_WORDS] = "words",
    [SHARE_RETURNS] = "returns", [SHARE_REFUSED] = "refused",
};

struct share_dir {
    int itself, lock, at[SHARE_PLACES];
};

struct share_dir *share_dir_open(const char *path, char *reason, size_t size)
{
    struct share_dir *dir = calloc(1, sizeof *dir);
    if (!dir) {
        snprintf(reason, size, "out of memory");
        return NULL;
    }
    dir->lock = -1;
    for (int i = 0; i < SHARE_PLACES; i++)
        dir->at[i] = -1;
    dir->itself = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool good = dir->itself >= 0;
    for (int i = 0; good && i < SHARE_PLACES; i++)
        good = (dir->at[i] = spool_open(dir->itself, places[i])) >= 0;
    if (good)
        return dir;
    snprintf(reason, size, "the shared directory %s: %s", path, strerror(errno));
    share_dir_free(dir);
    return NULL;
}

void share_dir_free(struct share_dir *dir)
{
    if (!dir)
        return;
    for (int i = 0; i < SHARE_PLACES; i++)
        if (dir->at[i] >= 0)
            close(dir->at[i]);
    if (dir->lock >= 0)
        close(dir->lock);
    if (dir->itself >= 0)
        close(dir->itself);
    free(dir);
}

int share_dir_at(const struct share_dir *dir, enum share_place place)
{
    return dir->at[place];
}

/* A file system without locks has to do without. */
bool share_dir_lock(struct share_dir *dir)
{
    dir->lock = openat(dir->itself, ".daemon", O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
    return dir->lock < 0 || flock(dir->lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

void share_name(const struct lease_loan *loan, char name[SPOOL_NAME_SIZE])
{
    snprintf(name, SPOOL_NAME_SIZE, "%s.%" PRId64 ".%s", loan->job, loan->chunk, loan->id);
}

bool share_name_is(const char *name, const struct lease_loan *loan)
{
    char whole[SPOOL_NAME_SIZE];
    share_name(loan, whole);
    return loan->id[0] && strcmp(name, whole) == 0;
}

bool share_name_read(const char *name, struct lease_word *word)
{
    struct lease_loan loan = {0};
    const char *first = strchr(name, '.'), *second = first ? strchr(first + 1, '.') : NULL;
    if (!second || first - name >= (ptrdiff_t)sizeof loan.job ||
        strlen(second + 1) >= sizeof loan.id)
        return false;
    memcpy(loan.job, name, (size_t)(first - name));
    loan.chunk = strtoll(first + 1, NULL, 10);
    snprintf(loan.id, sizeof loan.id, "%s", second + 1);
    if (loan.chunk < 0 || !share_name_is(name, &loan)) /* a number can be written in many ways */
        return false;
    *word = (struct lease_word){.chunk = loan.chunk};
    snprintf(word->job, sizeof word->job, "%s", loan.job);
    snprintf(word->id, sizeof word->id, "%s", loan.id);
    return true;
}
