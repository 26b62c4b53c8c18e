/* SPDX-License-Identifier: GPL-3.0-or-later
 * Chunks lent through a directory: who moves an offer away has it alone; what comes back is what a
 * worker wrote or is not taken; whoever stays away loses the chunk, daemon and worker alike.
 * Waits: for looks into a directory, and for leases to end. */
#include "share.h"

#include "lease_bench.h"
#include "share_dir.h"
#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

enum { LEASE_MS = 1500, FOREVER_MS = 600000 };

/* The daemon's side, and a worker's. */
struct meeting {
    char path[TEMP_DIR_SIZE];
    struct lease_bench bench;
    struct share *share;
    struct share_dir *dir; /* the worker's */
};

static void meet(struct meeting *meeting, int64_t lease_ms)
{
    char reason[256];
    temp_dir_make(meeting->path);
    lease_bench_start(&meeting->bench, lease_ms);
    meeting->share = share_start(meeting->path, meeting->bench.leases, lease_ms, reason, 256);
    meeting->dir = share_dir_open(meeting->path, reason, sizeof(reason));
    assert_non_null(meeting->share);
    assert_non_null(meeting->dir);
}

static void part(struct meeting *meeting)
{
    static const char *const places[] = {"offers", "taken", "words", "returns", "refused"};
    char path[TEMP_DIR_SIZE + 16];
    share_stop(meeting->share);
    share_dir_free(meeting->dir);
    for (size_t i = 0; i < sizeof(places) / sizeof(places[0]); i++) {
        snprintf(path, sizeof(path), "%s/%s", meeting->path, places[i]);
        temp_dir_remove(path);
    }
    temp_dir_remove(meeting->path);
    lease_bench_stop(&meeting->bench);
}

/* How many files are in a place, when there are `wanted` of them or half a minute has gone. */
static size_t files(const struct meeting *meeting, enum share_place place, size_t wanted)
{
    const struct timespec nap = {.tv_nsec = 20000000};
    size_t count = 0;
    for (int i = 0; i < 1500; i++) {
        free(spool_list(share_dir_at(meeting->dir, place), &count));
        if (count == wanted)
            break;
        nanosleep(&nap, NULL);
    }
    return count;
}

/* Takes an offer as a worker does. */
static bool take(const struct meeting *meeting, struct lease_loan *loan)
{
    const int offers = share_dir_at(meeting->dir, SHARE_OFFERS);
    const int taken = share_dir_at(meeting->dir, SHARE_TAKEN);
    struct bcd_errors errors = {0};
    size_t count, size;
    char(*names)[SPOOL_NAME_SIZE] = spool_list(offers, &count);
    bool good = count > 0 && spool_move(offers, names[0], taken, names[0]);
    char *text = good ? spool_read(taken, names[0], SHARE_FILE_BYTES_MAX, &size) : NULL;
    good = text && lease_json_read_loan(text, size, loan, &errors) && share_name_is(names[0], loan);
    free(text);
    free(names);
    return good;
}

static char *word_of(const struct lease_loan *loan, const struct blob *bytes, bool ended)
{
    struct lease_word word = {.chunk = loan->chunk,
                              .ticks_done = 4,
                              .ticks_total = 10,
                              .core_seconds = 1.5,
                              .bytes = bytes ? *bytes : (struct blob){0}};
    snprintf(word.job, sizeof(word.job), "%s", loan->job);
    return lease_json_word(&word, ended);
}

/* Puts there what a worker says, or the first bytes of it. */
static void say(const struct meeting *meeting, const struct lease_loan *loan,
                const struct blob *tally, size_t most)
{
    char *text = word_of(loan, tally, tally != NULL);
    size_t size = strlen(text);
    assert_true(spool_put(share_dir_at(meeting->dir, tally ? SHARE_RETURNS : SHARE_WORDS), loan->id,
                          text, size < most ? size : most));
    free(text);
}

static struct lease_counts counts(struct meeting *meeting)
{
    struct lease_counts found;
    leases_count(meeting->bench.leases, &found);
    return found;
}

/* A file is gone a moment before what it said is counted. */
static void await_count(struct meeting *meeting, size_t offset, int64_t wanted)
{
    const struct timespec nap = {.tv_nsec = 20000000};
    int64_t found = -1;
    for (int i = 0; i < 1500 && found != wanted; i++) {
        struct lease_counts all = counts(meeting);
        memcpy(&found, (const char *)&all + offset, sizeof(found));
        if (found != wanted)
            nanosleep(&nap, NULL);
    }
    assert_int_equal(found, wanted);
}

#define AWAIT_COUNT(member, wanted)                                                                \
    await_count(&meeting, offsetof(struct lease_counts, member), wanted)

static void an_offer_goes_and_its_tally_comes(void **state)
{
    struct meeting meeting;
    struct lease_loan loan;
    struct lease_news news;
    (void)state;
    meet(&meeting, FOREVER_MS);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    assert_int_equal(counts(&meeting).offered, 2); /* nobody runs them */
    assert_true(take(&meeting, &loan));
    assert_int_equal(files(&meeting, SHARE_OFFERS, 1), 1);
    say(&meeting, &loan, NULL, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_WORDS, 0), 0);
    AWAIT_COUNT(held, 1);
    lease_wait(meeting.bench.lease[loan.chunk], 20000, &news);
    assert_true(news.core_seconds > 0.5);
    assert_int_equal(meeting.bench.done[loan.chunk], 4);
    struct blob tally = lease_bench_tally(meeting.bench.scene, loan.chunk);
    say(&meeting, &loan, &tally, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_RETURNS, 0), 0);
    assert_int_equal(files(&meeting, SHARE_TAKEN, 0), 0);
    lease_wait(meeting.bench.lease[loan.chunk], 20000, &news);
    assert_true(news.returned);
    assert_int_equal(news.tally.size, tally.size);
    assert_memory_equal(news.tally.bytes, tally.bytes, tally.size);
    blob_fini(&news.tally);

    /* It comes once more, from another worker; and with other bits. */
    say(&meeting, &loan, &tally, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_RETURNS, 0), 0);
    AWAIT_COUNT(again, 1);
    ((unsigned char *)tally.bytes)[tally.size / 2] ^= 1;
    say(&meeting, &loan, &tally, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_REFUSED, 1), 1);
    AWAIT_COUNT(differed, 1);
    AWAIT_COUNT(returned, 1);
    blob_fini(&tally);
    lease_loan_fini(&loan);
    part(&meeting);
}

/* Half a file, whichever half, is refused, and does not end the lease. */
static void torn_files_are_refused(void **state)
{
    struct meeting meeting;
    struct lease_loan loan;
    (void)state;
    meet(&meeting, FOREVER_MS);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    assert_true(take(&meeting, &loan));
    struct blob tally = lease_bench_tally(meeting.bench.scene, loan.chunk);
    char *text = word_of(&loan, &tally, true);
    const size_t sizes[] = {0, 1, strlen(text) / 2, strlen(text) - 3};
    for (size_t i = 0; i < sizeof(sizes) / sizeof(sizes[0]); i++) {
        say(&meeting, &loan, &tally, sizes[i]);
        assert_int_equal(files(&meeting, SHARE_RETURNS, 0), 0);
    }
    assert_int_equal(files(&meeting, SHARE_REFUSED, 1), 1); /* the last of them is kept */
    *strstr(text, "\"tally\":\"") = ' ';
    const int returns = share_dir_at(meeting.dir, SHARE_RETURNS);
    assert_true(spool_put(returns, "l0", text, strlen(text)));
    assert_true(spool_put(returns, "not-a-lease-by-its-length", text, strlen(text)));
    assert_int_equal(files(&meeting, SHARE_REFUSED, 3), 3);
    assert_int_equal(counts(&meeting).returned, 0);
    say(&meeting, &loan, &tally, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_RETURNS, 0), 0);
    AWAIT_COUNT(returned, 1);
    free(text);
    blob_fini(&tally);
    lease_loan_fini(&loan);
    part(&meeting);
}

static void who_is_silent_loses_the_chunk(void **state)
{
    struct meeting meeting;
    struct lease_loan loan, again;
    (void)state;
    meet(&meeting, LEASE_MS);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    assert_true(take(&meeting, &loan));
    assert_int_equal(files(&meeting, SHARE_OFFERS, 1), 1);
    assert_int_equal(files(&meeting, SHARE_TAKEN, 0), 0); /* gone: the worker sees it */
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    assert_true(counts(&meeting).expired >= 1);
    while (take(&meeting, &again) && again.chunk != loan.chunk)
        lease_loan_fini(&again);
    assert_int_equal(again.chunk, loan.chunk);
    assert_string_not_equal(again.id, loan.id);
    lease_loan_fini(&again);
    lease_loan_fini(&loan);
    part(&meeting);
}

static void who_is_not_wanted_is_told(void **state)
{
    struct meeting meeting;
    struct lease_loan loan;
    (void)state;
    meet(&meeting, FOREVER_MS);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    assert_true(take(&meeting, &loan));
    assert_int_equal(files(&meeting, SHARE_TAKEN, 1), 1);
    atomic_store(&meeting.bench.cancelled, true);
    assert_int_equal(files(&meeting, SHARE_TAKEN, 0), 0);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 0), 0);
    lease_loan_fini(&loan);
    part(&meeting);
}

/* Another daemon: what lies there of the one before is taken up, or away. */
static void the_daemon_is_started_anew(void **state)
{
    struct meeting meeting;
    struct lease_loan loan;
    struct lease_news news;
    char reason[256];
    (void)state;
    meet(&meeting, FOREVER_MS);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    assert_null(share_start(meeting.path, meeting.bench.leases, 1000, reason, sizeof(reason)));
    assert_non_null(strstr(reason, "another daemon's"));
    assert_true(take(&meeting, &loan));
    share_stop(meeting.share);
    lease_bench_stop(&meeting.bench);
    struct stat before, after;
    char name[SPOOL_NAME_SIZE];
    share_name(&loan, name);
    assert_int_equal(fstatat(share_dir_at(meeting.dir, SHARE_TAKEN), name, &before, 0), 0);

    lease_bench_start(&meeting.bench, FOREVER_MS);
    meeting.share = share_start(meeting.path, meeting.bench.leases, FOREVER_MS, reason, 256);
    assert_non_null(meeting.share);
    struct blob tally = lease_bench_tally(meeting.bench.scene, loan.chunk);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 1), 1);
    say(&meeting, &loan, NULL, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_WORDS, 0), 0);
    assert_int_equal(fstatat(share_dir_at(meeting.dir, SHARE_TAKEN), name, &after, 0), 0);
    say(&meeting, &loan, &tally, SIZE_MAX);
    assert_int_equal(files(&meeting, SHARE_RETURNS, 0), 0);
    AWAIT_COUNT(returned, 1);
    do { /* a heartbeat is news as well */
        lease_wait(meeting.bench.lease[loan.chunk], 20000, &news);
        blob_fini(&news.tally);
    } while (!news.returned);
    blob_fini(&tally);
    lease_loan_fini(&loan);
    part(&meeting);
}

static void strangers(void **state)
{
    struct meeting meeting;
    char path[2 * TEMP_DIR_SIZE];
    size_t size;
    (void)state;
    meet(&meeting, FOREVER_MS);
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    const int words = share_dir_at(meeting.dir, SHARE_WORDS);
    /* A link to elsewhere, a FIFO that nobody writes to, a name of no lease. */
    assert_int_equal(symlinkat("/etc/passwd", words, "l1"), 0);
    snprintf(path, sizeof(path), "%s/words/l2", meeting.path);
    assert_int_equal(mkfifo(path, 0600), 0);
    assert_true(spool_put(share_dir_at(meeting.dir, SHARE_TAKEN), "nobody", "", 0));
    assert_int_equal(files(&meeting, SHARE_REFUSED, 3), 3);
    assert_null(spool_read(share_dir_at(meeting.dir, SHARE_REFUSED), "read.l1", 1000, &size));
    assert_int_equal(files(&meeting, SHARE_OFFERS, 2), 2);
    part(&meeting);
}

static void names(void **state)
{
    static const char *const wrong[] = {"", ".", "..", ".x", "a/b", "A", "a b", "\xc3\xa4"};
    static const char *const strange[] = {
        "j1",      "j1.2", "j1.02.l3", "j1.-2.l3",
        "j1.x.l3", "..l3", "j1.2.",    "j1.2.l3l3l3l3l3l3l3l3l3l3l3"};
    struct lease_word word;
    char name[SPOOL_NAME_SIZE + 1];
    (void)state;
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++)
        assert_false(spool_name_sound(wrong[i]));
    memset(name, 'a', sizeof(name));
    name[SPOOL_NAME_SIZE] = '\0';
    assert_false(spool_name_sound(name));
    name[SPOOL_NAME_SIZE - 1] = '\0';
    assert_true(spool_name_sound(name));
    for (size_t i = 0; i < sizeof(strange) / sizeof(strange[0]); i++)
        assert_false(share_name_read(strange[i], &word));
    assert_true(share_name_read("j1x.20.l3", &word));
    assert_string_equal(word.job, "j1x");
    assert_int_equal(word.chunk, 20);
    assert_string_equal(word.id, "l3");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names),
        cmocka_unit_test(an_offer_goes_and_its_tally_comes),
        cmocka_unit_test(torn_files_are_refused),
        cmocka_unit_test(who_is_silent_loses_the_chunk),
        cmocka_unit_test(who_is_not_wanted_is_told),
        cmocka_unit_test(the_daemon_is_started_anew),
        cmocka_unit_test(strangers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
