/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_handle_backup.c - GET /v1/backup without a socket: it is made while the answer is held, one
 * at a time until it is sent, and whoever leaves takes it along: told to stop, or made for nobody.
 */
#include "desk.h"

#include "aside.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static int ask_backup(struct desk *f, void *held)
{
    const struct request request = {
        .method = "GET", .path = "/v1/backup", .body = "", .held = held};
    return desk_send(f, &request);
}

/* Begins one; the answer is held. */
static struct hold begin(struct desk *f)
{
    ask_backup(f, NULL);
    assert_non_null(f->reply.hold.ready);
    struct hold hold = f->reply.hold;
    f->reply.hold = (struct hold){0};
    return hold;
}

static void pause_a_little(void)
{
    const struct timespec pause = {.tv_nsec = 5000000};
    nanosleep(&pause, NULL);
}

/* The same as soon as the one before has ended. */
static struct hold begin_soon(struct desk *f)
{
    for (int i = 0; i < 2000; i++) {
        ask_backup(f, NULL);
        if (f->reply.hold.ready)
            break;
        assert_int_equal(f->reply.status, 503);
        pause_a_little();
    }
    assert_non_null(f->reply.hold.ready);
    struct hold hold = f->reply.hold;
    f->reply.hold = (struct hold){0};
    return hold;
}

static void open_lane(struct desk *f, atomic_flag *busy)
{
    f->service.backup = busy;
    f->service.lane[LANE_BACKUPS] = aside_create(&aside_rules[LANE_BACKUPS]);
    assert_non_null(f->service.lane[LANE_BACKUPS]);
}

static void close_lane(struct desk *f)
{
    aside_free(f->service.lane[LANE_BACKUPS]);
    f->service.lane[LANE_BACKUPS] = NULL;
}

static void until_ready(struct hold *hold)
{
    for (int i = 0; i < 2000 && !hold->ready(hold->state); i++)
        pause_a_little();
    assert_true(hold->ready(hold->state));
}

static void one_is_made_and_sent(void **state)
{
    struct desk *f = *state;
    atomic_flag busy = ATOMIC_FLAG_INIT;
    char bytes[4096];
    ssize_t got, size = 0;
    open_lane(f, &busy);
    assert_int_equal(ask(f, "POST", "/v1/jobs", JOB("")), 202);
    struct hold hold = begin(f);
    assert_int_equal(ask_backup(f, NULL), 503); /* while it is made */
    assert_says(f, "another backup is being made or sent");
    until_ready(&hold);
    assert_int_equal(ask_backup(f, hold.state), 200);
    struct stream stream = f->reply.stream;
    f->reply.stream = (struct stream){0};
    hold_fini(&hold);
    hold = begin_soon(f); /* while it is sent */
    until_ready(&hold);
    assert_int_equal(ask_backup(f, hold.state), 503);
    hold_fini(&hold);
    while ((got = stream.read(stream.state, bytes, sizeof(bytes))) > 0) {
        if (size == 0)
            assert_memory_equal(bytes, "SQLite format 3", 16);
        size += got;
    }
    assert_int_equal(got, STREAM_END);
    assert_true(size > 100000);
    stream_fini(&stream);
    hold = begin_soon(f);
    hold_fini(&hold);
    close_lane(f);
}

static void whoever_leaves_takes_it_along(void **state)
{
    struct desk *f = *state;
    atomic_flag busy = ATOMIC_FLAG_INIT;
    open_lane(f, &busy);
    for (int i = 0; i < 20; i++) {
        struct hold hold = begin_soon(f);
        if (i % 2)
            until_ready(&hold);
        hold_fini(&hold);
    }
    close_lane(f); /* what was told to stop has */
    DIR *dir = opendir(f->dir);
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));)
        assert_null(strstr(entry->d_name, "backup"));
    closedir(dir);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        DESK_TEST(one_is_made_and_sent),
        DESK_TEST(whoever_leaves_takes_it_along),
    };
    return cmocka_run_group_tests_name("handle_backup", tests, NULL, NULL);
}
