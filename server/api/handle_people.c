/* SPDX-License-Identifier: GPL-3.0-or-later
 * handle_people.c - tokens, owners with their quotas, the audit log. */
#include "access.h"
#include "faults.h"
#include "handle.h"
#include "limits.h"
#include "people_json.h"
#include "reply.h"
#include "request_check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int64_t now_ms(void);
static void reload(const struct service *service);

void handle_people_token_create(const struct service *service, const struct call *call,
                                struct reply *reply)
{
    const struct request *request = call->request;
    struct token_record token = {.role = ROLE_NONE};
    struct bcd_errors errors = {0};
    char secret[SECRET_SIZE] = "", location[96];
    if (!request_check_json(request, reply))
        return;
    if (!people_json_read_token(request->body, request->body_size, now_ms(), &token, &errors)) {
        reply_bcd(reply, faults_status(&errors), &errors);
    } else if (!secret_make(secret) || !secret_hash(secret, token.hash)) {
        reply_problem(reply, PROBLEM_INTERNAL, "the system has no random bits");
    } else {
        enum store_status status = store_tokens_add(service->store, &token, &call->identity);
        reload(service);
        snprintf(location, sizeof(location), "/v1/tokens/%s", token.id);
        if (status == STORE_CONFLICT)
            reply_problem(
                reply, PROBLEM_TOKENS,
                "the first token must be an admin's, for else nobody could make the next; "
                "and there may be %d at a time (LIMIT_TOKENS_MAX)",
                LIMIT_TOKENS_MAX);
        else if (status != STORE_OK)
            reply_store(reply, status, "the token was not made");
        else
            reply_created_take(reply, location, people_json_token(&token, secret));
    }
    secret_wipe(secret, sizeof(secret));
    free(token.name);
}

void handle_people_token_list(const struct service *service, const struct call *call,
                              struct reply *reply)
{
    struct token_record *tokens = NULL;
    size_t count = 0;
    (void)call;
    enum store_status status = store_tokens_list(service->store, &tokens, &count);
    if (status == STORE_OK)
        reply_json_take(reply, people_json_tokens(tokens, count));
    else
        reply_store(reply, status, "list of tokens");
    token_records_free(tokens, count);
}

void handle_people_token_revoke(const struct service *service, const struct call *call,
                                struct reply *reply)
{
    struct token_record *tokens = NULL;
    size_t count = 0, i = 0;
    enum store_status status =
        store_tokens_revoke(service->store, call->arg[0], false, &call->identity);
    reload(service);
    if (status == STORE_OK)
        status = store_tokens_list(service->store, &tokens, &count);
    while (i < count && strcmp(tokens[i].id, call->arg[0]) != 0)
        i++;
    if (status == STORE_CONFLICT)
        reply_problem(reply, PROBLEM_TOKENS,
                      "it was revoked before, or is the last one of an admin: make another first");
    else if (status != STORE_OK || i == count)
        reply_store(reply, status != STORE_OK ? status : STORE_NOT_FOUND, "such token");
    else
        reply_json_take(reply, people_json_token(&tokens[i], NULL));
    token_records_free(tokens, count);
}

void handle_people_me(const struct service *service, const struct call *call, struct reply *reply)
{
    struct owner_record owner;
    enum store_status status = store_owners_get(service->store, call->identity.owner, &owner);
    if (status == STORE_OK)
        reply_json_take(reply, people_json_me(&call->identity, &owner));
    else
        reply_store(reply, status, "such owner");
}

void handle_people_owners(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct owner_record *owners = NULL;
    size_t count = 0;
    (void)call;
    enum store_status status = store_owners_list(service->store, &owners, &count);
    if (status == STORE_OK)
        reply_json_take(reply, people_json_owners(owners, count));
    else
        reply_store(reply, status, "list of owners");
    free(owners);
}

/* What the body does not name goes back to the default: PUT says all there is to be said. */
void handle_people_owner_put(const struct service *service, const struct call *call,
                             struct reply *reply)
{
    const struct request *request = call->request;
    const char *name = call->arg[0];
    struct owner_record owner;
    double quota[QUOTAS] = {-1, -1, -1};
    struct bcd_errors errors = {0};
    if (!owner_sound(name)) {
        reply_problem(reply, PROBLEM_NOT_FOUND, "an owner has 1 to %d of a-z 0-9 _ -",
                      OWNER_SIZE - 1);
        return;
    }
    if (!request_check_json(request, reply))
        return;
    if (!people_json_read_quotas(request->body, request->body_size, quota, &errors)) {
        reply_bcd(reply, faults_status(&errors), &errors);
        return;
    }
    enum store_status status = store_owners_set_quota(service->store, name, quota, &call->identity);
    if (status == STORE_OK)
        status = store_owners_get(service->store, name, &owner);
    if (status == STORE_OK)
        reply_json_take(reply, people_json_owner(&owner));
    else
        reply_store(reply, status, "the quotas were not set");
}

void handle_people_audit(const struct service *service, const struct call *call,
                         struct reply *reply)
{
    const char *limit = call_query(call, "limit"), *cursor = call_query(call, "cursor");
    struct audit_query query = {
        .owner = call_query(call, "owner"),
        .action = call_query(call, "action"),
        .object = call_query(call, "object"),
        .before_seq = cursor ? strtoll(cursor, NULL, 10) : 0,
        .limit = limit ? (size_t)strtoul(limit, NULL, 10) : LIMIT_LIST_ROWS_DEFAULT,
    };
    struct audit_line *lines = NULL;
    size_t count = 0, shown = query.limit++; /* one more tells whether there is a next page */
    enum store_status status = store_audit_list(service->store, &query, &lines, &count);
    if (status == STORE_OK && count <= shown)
        reply_json_take(reply, people_json_audit(lines, count, 0));
    else if (status == STORE_OK)
        reply_json_take(reply, people_json_audit(lines, shown, lines[shown - 1].seq));
    else
        reply_store(reply, status, "audit log");
    audit_lines_free(lines, count);
}

/* Whoever was just let in or thrown out is so at once. */
static void reload(const struct service *service)
{
    if (service->access)
        access_reload(service->access); /* the store logs why if not; the old ones stay */
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
