/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "temp_dir.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void temp_dir_make(char path[TEMP_DIR_SIZE])
{
    const char *base = getenv("TMPDIR");

    snprintf(path, TEMP_DIR_SIZE, "%s/bcdd-test-XXXXXX", base && *base ? base : "/tmp");
    if (!mkdtemp(path)) {
        perror(path);
        abort();
    }
}

static void remove_files(const char *path)
{
    DIR *dir = opendir(path);
    struct dirent *entry;

    while (dir && (entry = readdir(dir)))
        if (strcmp(entry->d_name, ".") && strcmp(entry->d_name, ".."))
            unlinkat(dirfd(dir), entry->d_name, 0);
    if (dir)
        closedir(dir);
    rmdir(path);
}

void temp_dir_remove(const char *path)
{
    char below[TEMP_DIR_SIZE + 16];

    snprintf(below, sizeof below, "%s/checkpoints", path);
    remove_files(below);
    remove_files(path);
}
