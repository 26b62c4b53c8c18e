/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fake_server.h"

#include <arpa/inet.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { PATIENCE_MS = 30000, SILENCE_MS = 2500 };

/* Until the header is there, and the body it speaks of. */
static void read_request(int fd, char request[FAKE_REQUEST_SIZE])
{
    size_t size = 0;
    for (;;) {
        ssize_t got = recv(fd, request + size, FAKE_REQUEST_SIZE - 1 - size, 0);
        if (got <= 0)
            return;
        size += (size_t)got;
        request[size] = '\0';
        const char *end = strstr(request, "\r\n\r\n");
        const char *length = strcasestr(request, "Content-Length: ");
        if (end &&
            size >= (size_t)(end + 4 - request) + (length ? strtoul(length + 16, NULL, 10) : 0))
            return;
    }
}

static void *serve(void *context)
{
    struct fake_server *server = context;
    for (; server->answers[server->served]; server->served++) {
        struct pollfd ready = {.fd = server->listener, .events = POLLIN};
        if (poll(&ready, 1, PATIENCE_MS) <= 0)
            break;
        int fd = accept(server->listener, NULL, NULL);
        if (fd < 0) /* told to stop */
            break;
        const char *answer = server->answers[server->served];
        read_request(fd, server->request[server->served]);
        if (strcmp(answer, "...") == 0)
            poll(NULL, 0, SILENCE_MS);
        else
            send(fd, answer, strlen(answer), MSG_NOSIGNAL);
        close(fd);
    }
    return NULL;
}

void fake_server_start(struct fake_server *server, const char *const *answers)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    *server = (struct fake_server){.answers = answers};
    server->listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (bind(server->listener, (struct sockaddr *)&address, size) != 0 ||
        listen(server->listener, 8) != 0 ||
        getsockname(server->listener, (struct sockaddr *)&address, &size) != 0)
        abort();
    server->port = ntohs(address.sin_port);
    snprintf(server->url, sizeof server->url, "http://127.0.0.1:%u", server->port);
    if (pthread_create(&server->thread, NULL, serve, server) != 0)
        abort();
}

void fake_server_stop(struct fake_server *server)
{
    shutdown(server->listener, SHUT_RDWR);
    pthread_join(server->thread, NULL);
    close(server->listener); /* from now on nobody is there */
}
