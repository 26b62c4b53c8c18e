/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "request_check.h"
#include "limits.h"
#include "reply.h"

#include <string.h>
#include <strings.h>

static bool media_json(const char *type);

bool request_check_json(const struct request *request, struct reply *reply)
{
    if (media_json(request->content_type))
        return true;
    reply_problem(reply, PROBLEM_MEDIA_TYPE, "Content-Type should be application/json");
    return false;
}

bool request_check_key(const struct request *request, struct reply *reply)
{
    const char *key = request->idempotency_key;
    if (!key)
        return true;
    size_t length = strlen(key);
    bool sound = length > 0 && length <= LIMIT_IDEMPOTENCY_KEY_BYTES_MAX;
    for (size_t i = 0; i < length && sound; i++)
        sound = key[i] > ' ' && key[i] < 0x7F;
    if (!sound)
        reply_problem(reply, PROBLEM_BAD_REQUEST,
                      "an Idempotency-Key has 1 to %d printable ASCII characters and no spaces",
                      LIMIT_IDEMPOTENCY_KEY_BYTES_MAX);
    return sound;
}

/* Also what `curl -d` says when it is not told otherwise. */
static bool media_json(const char *type)
{
    if (!type)
        return true;
    size_t length = strcspn(type, "; \t");
    static const char *const exact[] = {"application/json", "text/json",
                                        "application/x-www-form-urlencoded"};
    for (size_t i = 0; i < sizeof(exact) / sizeof(exact[0]); i++)
        if (strlen(exact[i]) == length && strncasecmp(type, exact[i], length) == 0)
            return true;
    return length > 17 && strncasecmp(type, "application/", 12) == 0 &&
           strncasecmp(type + length - 5, "+json", 5) == 0;
}
