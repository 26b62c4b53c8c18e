/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle_page.c - the web page: the files of server/page/, compiled in. They hold no data: what the
 * page shows it asks for like any client.
 */
#include "handle.h"
#include "reply.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

struct page_file {
    const char *name, *type, *sum;
    const unsigned char *plain;
    size_t plain_size;
    const unsigned char *gzip;
    size_t gzip_size;
};
#include "page.inc"
#include "scenes.inc"

#define INDEX "index.html"

static void answer(const struct call *call, const char *name, struct reply *reply);
static bool takes_gzip(const char *accepted);

void handle_page_index(const struct service *service, const struct call *call, struct reply *reply)
{
    (void)service;
    answer(call, INDEX, reply);
}

void handle_page_file(const struct service *service, const struct call *call, struct reply *reply)
{
    (void)service;
    answer(call, strcmp(call->arg[0], INDEX) == 0 ? "" : call->arg[0], reply);
}

void handle_page_scenes(const struct service *service, const struct call *call, struct reply *reply)
{
    (void)service, (void)call;
    reply_json_take(reply, strdup(scenes_json));
}

/* Asked for again each time, and not sent again while it is the same: a page and its parts are
 * never of two versions for longer than a reload. */
static void answer(const struct call *call, const char *name, struct reply *reply)
{
    const struct page_file *file = NULL;
    for (size_t i = 0; i < sizeof(page_files) / sizeof(page_files[0]); i++)
        if (strcmp(page_files[i].name, name) == 0)
            file = &page_files[i];
    if (!file) {
        reply_problem(reply, PROBLEM_NOT_FOUND, "the page has no such file");
        return;
    }
    bool gzip = takes_gzip(call->request->accept_encoding);
    char etag[ETAG_SIZE];
    snprintf(etag, sizeof(etag), "%s%s", file->sum, gzip ? "-gzip" : "");
    if (!reply_unchanged(reply, call->request, etag))
        reply_bytes(reply, file->type, gzip ? "gzip" : "identity", gzip ? file->gzip : file->plain,
                    gzip ? file->gzip_size : file->plain_size);
    else
        reply->encoding = "identity";
    reply_revalidate(reply, etag);
}

/* "gzip" or "*" among the encodings of a header, not with q=0. */
static bool takes_gzip(const char *accepted)
{
    for (const char *at = accepted; at && *at;) {
        at += strspn(at, " \t,");
        size_t length = strcspn(at, " \t,;");
        bool named =
            (length == 4 && strncasecmp(at, "gzip", 4) == 0) || (length == 1 && *at == '*');
        at += length + strspn(at + length, " \t");
        const char *share = at + strspn(at, "; \t");
        if (named) /* "q=0", "q=0.000" */
            return strncasecmp(share, "q=0", 3) != 0 ||
                   isdigit((unsigned char)share[3 + strspn(share + 3, ".0")]);
        at += strcspn(at, ",");
    }
    return false;
}
