/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "http_guard.h"
#include "text.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <string.h>
#include <strings.h>

static bool decode(char *text);
static int hex_digit(char c);

bool http_guard_loopback(const char *address)
{
    struct in_addr v4;
    struct in6_addr v6;
    if (inet_pton(AF_INET, address, &v4) == 1)
        return ntohl(v4.s_addr) >> 24 == 127;
    return inet_pton(AF_INET6, address, &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

bool http_guard_host(const char *host, const char *listen_address, const char *const *names)
{
    bool loopback = http_guard_loopback(listen_address);
    if (!loopback && (!names || !names[0]))
        return true;
    bool bracket = host[0] == '[';
    const char *name = host + bracket;
    size_t length = strcspn(name, bracket ? "]" : ":");
    const char *rest = name + length;
    if (bracket && *rest++ != ']')
        return false;
    if (*rest == ':')
        rest += 1 + strspn(rest + 1, "0123456789");
    char address[256];
    if (*rest != '\0' || length >= sizeof(address))
        return false;
    memcpy(address, name, length);
    address[length] = '\0';
    if (bracket != (strchr(address, ':') != NULL))
        return false;
    for (; names && *names; names++)
        if (strcasecmp(address, *names) == 0)
            return true;
    return strcasecmp(address, listen_address) == 0 ||
           (loopback && (strcasecmp(address, "localhost") == 0 || http_guard_loopback(address)));
}

const char *http_guard_target(char *target, char **host)
{
    *host = NULL;
    if (target[0] == '/')
        return NULL;
    size_t scheme = strncasecmp(target, "http://", 7) == 0    ? 7
                    : strncasecmp(target, "https://", 8) == 0 ? 8
                                                              : 0;
    if (scheme == 0)
        return "what is asked for must be a path that begins with a slash";
    size_t length = strcspn(target + scheme, "/");
    const char *rest = target + scheme + length;
    *host = strndup(target + scheme, length);
    if (!*host)
        return "out of memory";
    memmove(target + 1, rest + (*rest == '/'), strlen(rest + (*rest == '/')) + 1);
    target[0] = '/';
    return NULL;
}

bool http_guard_origin(const char *origin, const char *host)
{
    const char *rest = strstr(origin, "://");
    return rest && host && strcasecmp(rest + 3, host) == 0;
}

const char *http_guard_query(char *raw, struct request_query *query, size_t room, size_t *count)
{
    *count = 0;
    for (char *pair = raw; pair && *pair;) {
        char *next = strchr(pair, '&');
        if (next)
            *next++ = '\0';
        if (*pair) {
            if (*count == room)
                return "too many query parameters";
            char *value = strchr(pair, '=');
            if (value)
                *value++ = '\0';
            else
                value = pair + strlen(pair);
            if (!decode(pair) || !decode(value))
                return "a query parameter has a bad %-escape or is not UTF-8";
            query[(*count)++] = (struct request_query){.name = pair, .value = value};
        }
        pair = next;
    }
    return NULL;
}

/* Decodes in place; false when it cannot be text. */
static bool decode(char *text)
{
    char *out = text;
    for (const char *c = text; *c; c++) {
        char byte = *c == '+' ? ' ' : *c;
        if (*c == '%') {
            int high = hex_digit(c[1]), low = high < 0 ? -1 : hex_digit(c[2]);
            if (low < 0 || (high == 0 && low == 0))
                return false;
            byte = (char)(high * 16 + low);
            c += 2;
        }
        *out++ = byte;
    }
    *out = '\0';
    for (const char *c = text; *c;) {
        size_t length = text_utf8(c);
        if (length == 0)
            return false;
        c += length;
    }
    return true;
}

static int hex_digit(char c)
{
    if (!isxdigit((unsigned char)c))
        return -1;
    return c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10;
}
