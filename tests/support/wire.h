/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * wire.h - one HTTP connection of a client that has hundreds of them in one thread: never waits,
 * keeps the connection, opens it anew when the server has ended it. Loopback only.
 */
#ifndef WIRE_H
#define WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct wire {
    int fd, epoll; /* fd: -1 = not open */
    uint16_t port;
    void *owner; /* what epoll_wait gives back */
    char *out, *in;
    size_t out_size, out_done, in_size, in_room;
    int64_t begun_us, took_us; /* of the request; until its answer was there */
    bool again;                /* on a connection that was used before */
};

enum wire_state { WIRE_WAITS, WIRE_DONE, WIRE_LOST };

/* The answer: `body` is borrowed until the next request. */
struct wire_answer {
    int status;
    const char *body;
    size_t size;
};

void wire_init(struct wire *wire, int epoll, uint16_t port, void *owner);
void wire_fini(struct wire *wire);

/* Begins a request. token, body: NULL = none. False = no memory, or no connection. */
struct wire_request {
    const char *method, *path, *token, *body;
};
bool wire_ask(struct wire *wire, const struct wire_request *request);

/* To be called whenever epoll names its owner. */
enum wire_state wire_go(struct wire *wire, struct wire_answer *answer);

int64_t wire_now_us(void);

#endif
