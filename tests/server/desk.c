/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "desk.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

int desk_set_up(void **state)
{
    struct desk *desk = calloc(1, sizeof(*desk));
    *state = desk;
    return desk_open(desk);
}

int desk_tear_down(void **state)
{
    desk_close(*state);
    free(*state);
    return 0;
}

int desk_open(struct desk *desk)
{
    char reason[256];
    temp_dir_make(desk->dir);
    if (store_open(&desk->service.store, desk->dir, reason, sizeof(reason)) != STORE_OK)
        return -1;
    return queue_create(&desk->service.queue, desk->service.store) == STORE_OK ? 0 : -1;
}

void desk_close(struct desk *desk)
{
    reply_fini(&desk->reply);
    queue_stop(desk->service.queue);
    queue_free(desk->service.queue);
    store_close(desk->service.store);
    temp_dir_remove(desk->dir);
}

int desk_send(struct desk *desk, const struct request *request)
{
    reply_fini(&desk->reply);
    routes_dispatch(&desk->service, request, &desk->reply);
    if (desk->reply.body) /* else it is a stream */
        assert_int_equal(desk->reply.body_size, strlen(desk->reply.body));
    return desk->reply.status;
}

int ask(struct desk *desk, const char *method, const char *path, const char *body)
{
    const struct request request = {.method = method,
                                    .path = path,
                                    .body = body ? body : "",
                                    .body_size = body ? strlen(body) : 0};
    return desk_send(desk, &request);
}

void assert_says(const struct desk *desk, const char *part)
{
    if (!strstr(desk->reply.body, part))
        fail_msg("no %s in %s", part, desk->reply.body);
}

void desk_take_id(const struct desk *desk, char id[JOB_ID_SIZE])
{
    char format[32];
    snprintf(format, sizeof(format), "{\"id\":\"%%%d[a-z0-9-]", JOB_ID_SIZE - 1);
    assert_int_equal(sscanf(desk->reply.body, format, id), 1);
}
