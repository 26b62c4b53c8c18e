/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "slurm_file.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define HARMLESS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./:@%+=,-[]"
static const char harmless[] = HARMLESS, harmless_or_blank[] = HARMLESS " ";

static const struct {
    const char *key;
    size_t offset;
    bool blanks;
} texts[] = {
    {"command", offsetof(struct slurm_file, command), false},
    {"url", offsetof(struct slurm_file, url), false},
    {"token_file", offsetof(struct slurm_file, token_file), false},
    {"bin", offsetof(struct slurm_file, bin), false},
    {"name", offsetof(struct slurm_file, name), false},
    {"account", offsetof(struct slurm_file, account), false},
    {"partition", offsetof(struct slurm_file, partition), false},
    {"qos", offsetof(struct slurm_file, qos), false},
    {"constraint", offsetof(struct slurm_file, constraint), false},
    {"time", offsetof(struct slurm_file, time), false},
    {"memory", offsetof(struct slurm_file, memory), false},
    {"modules", offsetof(struct slurm_file, modules), true},
};

static const struct {
    const char *key;
    size_t offset;
    long min, max;
} numbers[] = {
    {"pilots", offsetof(struct slurm_file, pilots), 1, SLURM_PILOTS_MAX},
    {"poll", offsetof(struct slurm_file, poll_s), 1, 3600},
    {"idle", offsetof(struct slurm_file, idle_s), 1, 86400},
    {"timeout", offsetof(struct slurm_file, timeout_s), 1, 600},
};

/* NULL, or what is wrong with it. */
static const char *set(struct slurm_file *file, const char *key, const char *value)
{
    for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
        char *to = (char *)file + texts[i].offset;
        if (strcmp(key, texts[i].key) != 0)
            continue;
        if (value[strspn(value, texts[i].blanks ? harmless_or_blank : harmless)])
            return "its value has a character that it may not have";
        if (strlen(value) >= SLURM_TEXT_SIZE)
            return "its value is too long";
        strcpy(to, value);
        return NULL;
    }
    for (size_t i = 0; i < sizeof(numbers) / sizeof(numbers[0]); i++) {
        char *end;
        long number = strtol(value, &end, 10);
        if (strcmp(key, numbers[i].key) != 0)
            continue;
        if (end == value || *end || number < numbers[i].min || number > numbers[i].max)
            return "its value is no whole number, too small or too large";
        *(long *)((char *)file + numbers[i].offset) = number;
        return NULL;
    }
    return "there is no such key";
}

bool slurm_file_harmless(const char *value)
{
    return value[0] && strlen(value) < SLURM_TEXT_SIZE && !value[strspn(value, harmless)];
}

static char *trim(char *text)
{
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r\n", text[length - 1]))
        text[--length] = '\0';
    return text;
}

bool slurm_file_read(const char *path, struct slurm_file *file, char *reason, size_t size)
{
    FILE *from = fopen(path, "re");
    char line[1024];
    const char *wrong = NULL;
    *file = (struct slurm_file){.pilots = 16,
                                .poll_s = 10,
                                .idle_s = 60,
                                .timeout_s = 20,
                                .name = "bcdd",
                                .command = "bcd"};
    if (!from) {
        snprintf(reason, size, "%s: %s", path, strerror(errno));
        return false;
    }
    for (int number = 1; !wrong && fgets(line, sizeof(line), from); number++) {
        char *key = trim(line), *equals = strchr(key, '=');
        if (!*key || *key == '#')
            continue;
        if (!equals) {
            wrong = "a line is key = value";
        } else {
            *equals = '\0';
            key = trim(key);
            wrong = set(file, key, trim(equals + 1));
        }
        if (wrong)
            snprintf(reason, size, "%s, line %d: %.60s: %s", path, number, key, wrong);
    }
    if (!wrong && ferror(from)) {
        wrong = "cannot be read";
        snprintf(reason, size, "%s %s", path, wrong);
    }
    fclose(from);
    return !wrong;
}
