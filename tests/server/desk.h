/* SPDX-License-Identifier: GPL-3.0-or-later
 * desk.h - the handlers behind routes.c on a store and a queue without workers, asked without a
 * socket: jobs are accepted and stay queued. */
#ifndef DESK_H
#define DESK_H

#include "temp_dir.h"

#include "reply.h"
#include "routes.h"

struct desk {
    char dir[TEMP_DIR_SIZE];
    struct service service;
    struct reply reply;   /* to the latest request */
    char id[JOB_ID_SIZE]; /* that a test remembers */
};

/* A small job, and what else is to stand in it: JOB(",\"seed\":2"). */
#define JOB(more)                                                                                  \
    "{\"particles\":5,\"length\":10,\"diameter\":0.5,\"time\":1,\"time_step\":0.01,"               \
    "\"observables\":{\"energy\":{}}" more "}"

/* Test fixtures of cmocka: *state is a struct desk. */
int desk_set_up(void **state);
int desk_tear_down(void **state);
#define DESK_TEST(function) cmocka_unit_test_setup_teardown(function, desk_set_up, desk_tear_down)

/* The same for a desk within something else. open: 0 = it is there; close takes what there is. */
int desk_open(struct desk *desk);
void desk_close(struct desk *desk);

/* Both give the status. body NULL = none. */
int desk_send(struct desk *desk, const struct request *request);
int ask(struct desk *desk, const char *method, const char *path, const char *body);

/* Of the latest reply: this is a part of it; the id in its record. */
void assert_says(const struct desk *desk, const char *part);
void desk_take_id(const struct desk *desk, char id[JOB_ID_SIZE]);

#endif
