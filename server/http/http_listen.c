/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "http_listen.h"
#include "limits.h"

#include <arpa/inet.h>
#include <errno.h>
#include <sys/socket.h>
#include <unistd.h>

int http_listen(const char *host, uint16_t port, uint16_t *bound)
{
    union {
        struct sockaddr any;
        struct sockaddr_in v4;
        struct sockaddr_in6 v6;
    } address = {.any = {0}};
    socklen_t length = sizeof(address.v4);
    if (inet_pton(AF_INET, host, &address.v4.sin_addr) == 1) {
        address.v4.sin_family = AF_INET;
        address.v4.sin_port = htons(port);
    } else if (inet_pton(AF_INET6, host, &address.v6.sin6_addr) == 1) {
        address.v6.sin6_family = AF_INET6;
        address.v6.sin6_port = htons(port);
        length = sizeof(address.v6);
    } else {
        errno = EADDRNOTAVAIL;
        return -1;
    }
    int fd = socket(address.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return -1;
    int yes = 1; /* a restart need not wait for old connections to be forgotten */
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    /* Connections inherit it. Otherwise it grows to megabytes for each client that does not read.
     */
    int room = LIMIT_SEND_BUFFER_BYTES;
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &room, sizeof(room));
    if (bind(fd, &address.any, length) == 0 && listen(fd, SOMAXCONN) == 0 &&
        getsockname(fd, &address.any, &length) == 0) {
        *bound =
            ntohs(address.any.sa_family == AF_INET ? address.v4.sin_port : address.v6.sin6_port);
        return fd;
    }
    int cause = errno;
    close(fd);
    errno = cause;
    return -1;
}
