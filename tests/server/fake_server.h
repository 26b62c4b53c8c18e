/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * fake_server.h - a server that answers its n-th connection with the n-th text it was given, byte
 * for byte, and hangs up; for clients that must bear whatever comes.
 */
#ifndef FAKE_SERVER_H
#define FAKE_SERVER_H

#include <pthread.h>

enum { FAKE_ANSWERS_MAX = 8, FAKE_REQUEST_SIZE = 4096 };

struct fake_server {
    const char *const *answers; /* NULL ends them; "" hangs up at once; "..." stays silent */
    int listener;
    unsigned port;
    char url[64];
    pthread_t thread;
    int served; /* valid after fake_server_stop */
    char request[FAKE_ANSWERS_MAX]
                [FAKE_REQUEST_SIZE]; /* what each of them asked, header and body */
};

/* Listens on loopback. */
void fake_server_start(struct fake_server *server, const char *const *answers);
/* Ends it, whether all answers were given or not. */
void fake_server_stop(struct fake_server *server);

#endif
