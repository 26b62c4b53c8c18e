/* SPDX-License-Identifier: GPL-3.0-or-later
 * wire.c - see wire.h. */
#include "support/wire.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { ROOM_LEAST = 8192 };

int64_t wire_now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

void wire_init(struct wire *wire, int epoll, uint16_t port, void *owner)
{
    *wire = (struct wire){.fd = -1, .epoll = epoll, .port = port, .owner = owner};
}

static void hang_up(struct wire *wire)
{
    if (wire->fd >= 0)
        close(wire->fd);
    wire->fd = -1;
    wire->again = false;
}

void wire_fini(struct wire *wire)
{
    hang_up(wire);
    free(wire->out);
    free(wire->in);
    wire->out = wire->in = NULL;
}

static bool dial(struct wire *wire)
{
    struct sockaddr_in to = {.sin_family = AF_INET,
                             .sin_port = htons(wire->port),
                             .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    struct epoll_event event = {.events = EPOLLIN | EPOLLOUT | EPOLLRDHUP | EPOLLET,
                                .data.ptr = wire->owner};
    const int on = 1;
    wire->again = false;
    wire->fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (wire->fd < 0)
        return false;
    setsockopt(wire->fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    if ((connect(wire->fd, (struct sockaddr *)&to, sizeof(to)) == 0 || errno == EINPROGRESS) &&
        epoll_ctl(wire->epoll, EPOLL_CTL_ADD, wire->fd, &event) == 0)
        return true;
    hang_up(wire);
    return false;
}

/* Sends what is left to be sent; false = the connection is lost. */
static bool push(struct wire *wire)
{
    while (wire->out_done < wire->out_size) {
        ssize_t sent = send(wire->fd, wire->out + wire->out_done, wire->out_size - wire->out_done,
                            MSG_NOSIGNAL);
        if (sent > 0)
            wire->out_done += (size_t)sent;
        else
            return errno == EAGAIN || errno == EINTR || errno == ENOTCONN;
    }
    return true;
}

bool wire_ask(struct wire *wire, const struct wire_request *request)
{
    size_t body = request->body ? strlen(request->body) : 0;
    char length[96] = "";
    if (request->body)
        snprintf(length, sizeof(length),
                 "Content-Type: application/json\r\nContent-Length: %zu\r\n", body);
    free(wire->out);
    int size =
        asprintf(&wire->out, "%s %s HTTP/1.1\r\nHost: 127.0.0.1\r\n%s%s%s%s\r\n%s", request->method,
                 request->path, request->token ? "Authorization: Bearer " : "",
                 request->token ? request->token : "", request->token ? "\r\n" : "", length,
                 request->body ? request->body : "");
    if (size < 0) {
        wire->out = NULL;
        return false;
    }
    wire->out_size = (size_t)size;
    wire->out_done = wire->in_size = 0;
    wire->begun_us = wire_now_us();
    if (wire->fd < 0 && !dial(wire))
        return false;
    return push(wire) || (wire->again && (hang_up(wire), dial(wire)));
}

/* Where a header's value begins; NULL = it is not there. */
static const char *header(const char *head, const char *name)
{
    for (const char *line = strstr(head, "\r\n"); line && line[2] != '\r';
         line = strstr(line + 2, "\r\n"))
        if (strncasecmp(line + 2, name, strlen(name)) == 0)
            return line + 2 + strlen(name);
    return NULL;
}

/* Whether all of the answer is there. */
static bool whole(const struct wire *wire, struct wire_answer *answer)
{
    static const char last[] = "\r\n0\r\n\r\n";
    const char *end = strstr(wire->in, "\r\n\r\n"), *length;
    if (!end)
        return false;
    *answer =
        (struct wire_answer){.body = end + 4, .size = wire->in_size - (size_t)(end + 4 - wire->in)};
    if (sscanf(wire->in, "HTTP/1.1 %d", &answer->status) != 1)
        return false;
    length = header(wire->in, "Content-Length:");
    if (length)
        return answer->size >= strtoull(length, NULL, 10);
    return answer->size >= strlen(last) - 2 &&
           strcmp(wire->in + wire->in_size - strlen(last), last) == 0;
}

enum wire_state wire_go(struct wire *wire, struct wire_answer *answer)
{
    bool open = wire->fd >= 0 && push(wire);
    while (open) {
        if (wire->in_room - wire->in_size < ROOM_LEAST) {
            size_t room = 2 * wire->in_room + 2 * ROOM_LEAST;
            char *more = realloc(wire->in, room);
            if (!more)
                return WIRE_LOST;
            wire->in = more;
            wire->in_room = room;
        }
        ssize_t got =
            recv(wire->fd, wire->in + wire->in_size, wire->in_room - wire->in_size - 1, 0);
        if (got > 0)
            wire->in_size += (size_t)got;
        else
            open = got < 0 && (errno == EAGAIN || errno == EINTR || errno == ENOTCONN);
        if (got <= 0)
            break;
    }
    if (wire->in)
        wire->in[wire->in_size] = '\0';
    if (wire->in_size > 0 && whole(wire, answer)) {
        wire->took_us = wire_now_us() - wire->begun_us;
        wire->again = true;
        return WIRE_DONE;
    }
    if (open)
        return WIRE_WAITS;
    /* The server may end a connection that has been idle just when it is used again. */
    bool once_more = wire->again && wire->in_size == 0;
    hang_up(wire);
    wire->out_done = 0;
    return once_more && dial(wire) ? WIRE_WAITS : WIRE_LOST;
}
