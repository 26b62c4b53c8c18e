/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "job_seeds.h"

#include <inttypes.h>
#include <sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Bytes before and after the digits of the seed. */
struct split {
    char *bytes;
    size_t before, after; /* where what follows the digits begins */
    size_t size;
};

struct job_seeds {
    struct job_new first; /* but for the hash and the text */
    double min, max;
    struct split text, encoding;
    SHA2_CTX begun; /* with what is before the seed */
};

static char *encode(const struct bcd_scene *scene, size_t *size);
static bool split(struct split *split, const char *mark);

struct job_seeds *job_seeds_create(const struct bcd_scene *scene, const struct job_new *job)
{
    const struct bcd_param *row = bcd_group_find(bcd_scene_job_view(scene), "seed");
    struct job_seeds *seeds = calloc(1, sizeof(*seeds));
    if (!seeds)
        return NULL;
    seeds->first = *job;
    seeds->min = row->min;
    seeds->max = row->max;
    seeds->first.job = NULL;
    seeds->first.derived = strdup(job->derived);
    seeds->text = (struct split){.bytes = strdup(job->job), .size = strlen(job->job)};
    seeds->encoding.bytes = encode(scene, &seeds->encoding.size);
    /* The job's own values come before those of its parts, and are numbers and words. */
    if (!seeds->first.derived || !split(&seeds->text, "\"seed\":") ||
        !split(&seeds->encoding, "\n/seed integer ")) {
        job_seeds_free(seeds);
        return NULL;
    }
    SHA256Init(&seeds->begun);
    SHA256Update(&seeds->begun, (const uint8_t *)seeds->encoding.bytes, seeds->encoding.before);
    return seeds;
}

void job_seeds_free(struct job_seeds *seeds)
{
    if (!seeds)
        return;
    free((char *)seeds->first.derived);
    free(seeds->text.bytes);
    free(seeds->encoding.bytes);
    free(seeds);
}

bool job_seeds_fit(const struct job_seeds *seeds, int64_t seed)
{
    return (double)seed >= seeds->min && (double)seed <= seeds->max;
}

bool job_seeds_fill(const struct job_seeds *seeds, int64_t seed, struct job_new *job)
{
    const struct split *text = &seeds->text, *encoding = &seeds->encoding;
    char digits[24];
    size_t length = (size_t)snprintf(digits, sizeof(digits), "%" PRId64, seed);
    size_t after = text->size - text->after + 1; /* with its NUL */
    char *whole = malloc(text->before + length + after), *derived = strdup(seeds->first.derived);
    SHA2_CTX context = seeds->begun;
    if (!whole || !derived) {
        free(whole);
        free(derived);
        return false;
    }
    memcpy(whole, text->bytes, text->before);
    memcpy(whole + text->before, digits, length);
    memcpy(whole + text->before + length, text->bytes + text->after, after);
    *job = seeds->first;
    job->job = whole;
    job->derived = derived;
    SHA256Update(&context, (const uint8_t *)digits, length);
    SHA256Update(&context, (const uint8_t *)encoding->bytes + encoding->after,
                 encoding->size - encoding->after);
    SHA256Final(job->hash, &context);
    return true;
}

static char *encode(const struct bcd_scene *scene, size_t *size)
{
    *size = bcd_scene_encode(scene, NULL, 0);
    char *bytes = malloc(*size + 1);
    if (!bytes)
        return NULL;
    bcd_scene_encode(scene, bytes, *size);
    bytes[*size] = '\0';
    return bytes;
}

static bool split(struct split *split, const char *mark)
{
    const char *found = split->bytes ? strstr(split->bytes, mark) : NULL;
    if (!found)
        return false;
    split->before = (size_t)(found - split->bytes) + strlen(mark);
    split->after = split->before + strspn(split->bytes + split->before, "0123456789");
    return split->after > split->before;
}
