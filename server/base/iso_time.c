/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "iso_time.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const char *read_time(const char *at, struct tm *utc, int64_t *fraction_ms);
static const char *read_zone(const char *at, int *minutes);
static const char *read_digits(const char *at, int count, int *value);
static bool same_day(const struct tm *a, const struct tm *b);

bool iso_time_parse(const char *text, int64_t *ms)
{
    struct tm utc = {0}, normal;
    int64_t fraction_ms = 0;
    int year = 0, month = 0, zone = 0;
    size_t digits = strspn(text, "0123456789");
    if (digits > 4 && text[digits] == '\0') {
        errno = 0;
        *ms = strtoll(text, NULL, 10);
        return errno == 0;
    }
    const char *at = read_digits(text, 4, &year);
    at = at && *at == '-' ? read_digits(at + 1, 2, &month) : NULL;
    at = at && *at == '-' ? read_digits(at + 1, 2, &utc.tm_mday) : NULL;
    if (at && (*at == 'T' || *at == ' '))
        at = read_zone(read_time(at + 1, &utc, &fraction_ms), &zone);
    if (!at || *at)
        return false;
    utc.tm_year = year - 1900;
    utc.tm_mon = month - 1;
    normal = utc;
    time_t seconds = timegm(&normal);
    if (!same_day(&utc, &normal) || utc.tm_hour > 23 || utc.tm_min > 59 || utc.tm_sec > 60)
        return false;
    *ms = ((int64_t)seconds - 60 * zone) * 1000 + fraction_ms;
    return true;
}

/* hh:mm[:ss[.fraction]]; NULL = no time. */
static const char *read_time(const char *at, struct tm *utc, int64_t *fraction_ms)
{
    at = read_digits(at, 2, &utc->tm_hour);
    at = at && *at == ':' ? read_digits(at + 1, 2, &utc->tm_min) : NULL;
    if (!at || *at != ':')
        return at;
    at = read_digits(at + 1, 2, &utc->tm_sec);
    if (!at || *at != '.')
        return at;
    int64_t unit = 100;
    for (at++; *at >= '0' && *at <= '9'; at++, unit /= 10)
        *fraction_ms += unit * (*at - '0');
    return at;
}

/* Z, +01:00, -0530, or nothing; a blank is a plus that was not escaped in a URL. */
static const char *read_zone(const char *at, int *minutes)
{
    int hours = 0, rest = 0;
    if (!at || !*at)
        return at;
    if (*at == 'Z')
        return at + 1;
    if (!strchr("+- ", *at))
        return NULL;
    int sign = *at == '-' ? -1 : 1;
    at = read_digits(at + 1, 2, &hours);
    if (at && *at)
        at = read_digits(at + (*at == ':'), 2, &rest);
    *minutes = sign * (60 * hours + rest);
    return at && hours < 24 && rest < 60 ? at : NULL;
}

static const char *read_digits(const char *at, int count, int *value)
{
    for (*value = 0; count > 0; count--, at++) {
        if (*at < '0' || *at > '9')
            return NULL;
        *value = 10 * *value + (*at - '0');
    }
    return at;
}

/* timegm makes March 2 of February 30. */
static bool same_day(const struct tm *a, const struct tm *b)
{
    bool leap_second = a->tm_sec == 60;
    return leap_second ||
           (a->tm_year == b->tm_year && a->tm_mon == b->tm_mon && a->tm_mday == b->tm_mday);
}
