/* SPDX-License-Identifier: GPL-3.0-or-later
 * The seeds and findings of tests/fuzz/corpus/, and what lies near them: every target takes all of
 * its files, each cut short at many places, and with single bytes changed. */
#include "fuzz.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { TARGETS_MAX = 16, FILE_MAX = 1 << 16, CUTS = 12, CHANGES = 24 };

static size_t read_file(const char *path, uint8_t *bytes)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t size = fread(bytes, 1, FILE_MAX, file);
    fclose(file);
    assert_in_range(size, 0, FILE_MAX - 1);
    return size;
}

static void feed(const struct fuzz_target *target, const uint8_t *bytes, size_t size)
{
    uint8_t *copy = malloc(size ? size : 1); /* of its own, for the sanitizers to see its end */
    assert_non_null(copy);
    memcpy(copy, bytes, size);
    target->run(copy, size);
    free(copy);
}

/* splitmix64 */
static uint64_t draw(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

static void feed_near(const struct fuzz_target *target, const uint8_t *bytes, size_t size)
{
    uint8_t *changed = malloc(size);
    uint64_t state = size;
    for (size_t i = 0; i < CUTS; i++)
        feed(target, bytes, size * i / CUTS);
    for (size_t i = 0; i < CHANGES; i++) {
        memcpy(changed, bytes, size);
        changed[draw(&state) % size] = (uint8_t)draw(&state);
        feed(target, changed, size);
    }
    free(changed);
}

static void replay(void **state)
{
    const struct fuzz_target *target = *state;
    char folder[256], path[512];
    size_t count = 0;
    uint8_t *bytes = malloc(FILE_MAX);
    snprintf(folder, sizeof(folder), "tests/fuzz/corpus/%s", target->name);
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));) {
        if (entry->d_name[0] == '.')
            continue;
        snprintf(path, sizeof(path), "%s/%s", folder, entry->d_name);
        size_t size = read_file(path, bytes);
        feed(target, bytes, size);
        if (size > 0)
            feed_near(target, bytes, size);
        count++;
    }
    closedir(dir);
    free(bytes);
    assert_true(count >= 3);
}

int main(void)
{
    struct CMUnitTest tests[TARGETS_MAX];
    size_t count = 0;
    for (; count < TARGETS_MAX && fuzz_target(count); count++)
        tests[count] = (struct CMUnitTest){.name = fuzz_target(count)->name,
                                           .test_func = replay,
                                           .initial_state = (void *)fuzz_target(count)};
    return _cmocka_run_group_tests("corpus", tests, count, NULL, NULL);
}
