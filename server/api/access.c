/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "access.h"
#include "limits.h"
#include "log.h"
#include "store_audit.h"
#include "store_tokens.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

/* THREADS  `lock` guards what follows it. */
struct access {
    struct store *store;
    enum access_mode mode;
    bool loopback;
    pthread_rwlock_t lock;
    struct token_record *tokens;
    size_t count;
    int64_t refused_ms; /* when a refusal was noted last, */
    size_t refused;     /* and how many there were since */
};

static bool is_open(const struct access *access);
static bool any_admin(const struct access *access);
static const char *bearer(const char *authorization);
static int64_t now_ms(void);

bool access_mode_parse(const char *name, enum access_mode *mode)
{
    static const char *const names[] = {"auto", "required", "open"};
    for (int i = 0; i < 3; i++) {
        if (strcmp(name, names[i]) == 0) {
            *mode = (enum access_mode)i;
            return true;
        }
    }
    return false;
}

enum store_status access_create(struct access **access, struct store *store, enum access_mode mode,
                                bool loopback, char *reason, size_t size)
{
    struct access *made = calloc(1, sizeof(*made));
    if (!made)
        return STORE_BROKEN;
    made->store = store;
    made->mode = mode;
    made->loopback = loopback;
    pthread_rwlock_init(&made->lock, NULL);
    store_tokens_forget(store); /* the store logs why if not: next time then */
    enum store_status status = access_reload(made);
    if (status == STORE_OK && !loopback && !any_admin(made)) {
        snprintf(reason, size,
                 "this address can be reached from other machines, and no admin has a token that "
                 "is good: make one (bcdd token create --data DIR --owner NAME --role admin), or "
                 "listen on 127.0.0.1");
        status = STORE_CONFLICT;
    } else if (status == STORE_OK && !loopback && mode == ACCESS_OPEN) {
        snprintf(reason, size, "--auth open is for loopback addresses only");
        status = STORE_CONFLICT;
    }
    if (status == STORE_OK)
        *access = made;
    else
        access_free(made);
    return status;
}

void access_free(struct access *access)
{
    if (!access)
        return;
    token_records_free(access->tokens, access->count);
    pthread_rwlock_destroy(&access->lock);
    free(access);
}

enum store_status access_reload(struct access *access)
{
    struct token_record *tokens = NULL;
    size_t count = 0;
    /* Locked while it reads, so that of two at a time the later one stays. */
    pthread_rwlock_wrlock(&access->lock);
    enum store_status status = store_tokens_list(access->store, &tokens, &count);
    if (status == STORE_OK) {
        token_records_free(access->tokens, access->count);
        access->tokens = tokens;
        access->count = count;
    }
    pthread_rwlock_unlock(&access->lock);
    return status;
}

/* Every token is looked at, so that the time tells nothing. */
struct identity access_identify(struct access *access, const struct request *request,
                                const char **why)
{
    struct identity identity = {.role = ROLE_NONE};
    unsigned char hash[SECRET_HASH_SIZE];
    const char *token = bearer(request->authorization);
    bool sound = token && secret_hash(token, hash);
    const struct token_record *found = NULL;
    *why = "this needs a token: Authorization: Bearer bcd_...";
    pthread_rwlock_rdlock(&access->lock);
    bool open = is_open(access);
    for (size_t i = 0; sound && i < access->count; i++)
        if (secret_same(hash, access->tokens[i].hash))
            found = &access->tokens[i];
    if (found && token_record_live(found, now_ms())) {
        identity.role = found->role;
        snprintf(identity.owner, sizeof(identity.owner), "%s", found->owner);
        snprintf(identity.token, sizeof(identity.token), "%s", found->id);
    } else if (found) {
        *why = found->revoked_ms ? "this token was revoked" : "this token has expired";
    } else if (request->authorization) {
        *why = sound ? "this token is not known here" : "this is no token: Bearer bcd_...";
    } else if (open) {
        identity = (struct identity){.owner = OWNER_LOCAL, .role = ROLE_ADMIN};
    }
    pthread_rwlock_unlock(&access->lock);
    return identity;
}

bool access_still(struct access *access, const struct identity *identity, const char **why)
{
    const struct token_record *found = NULL;
    *why = "from now on this needs a token";
    pthread_rwlock_rdlock(&access->lock);
    bool still = !identity->token[0] && is_open(access);
    for (size_t i = 0; identity->token[0] && !found && i < access->count; i++)
        if (strcmp(access->tokens[i].id, identity->token) == 0)
            found = &access->tokens[i];
    if (identity->token[0]) {
        still = found && token_record_live(found, now_ms());
        *why = found && !found->revoked_ms ? "the token has expired" : "the token was revoked";
    }
    pthread_rwlock_unlock(&access->lock);
    return still;
}

void access_note_refusal(struct access *access, const char *route, const char *why)
{
    static const struct identity nobody = {.role = ROLE_NONE};
    char detail[160];
    pthread_rwlock_wrlock(&access->lock);
    int64_t now = now_ms();
    size_t before = access->refused++;
    bool note = now < access->refused_ms || now >= access->refused_ms + LIMIT_AUDIT_REFUSED_MS;
    if (note) {
        access->refused_ms = now;
        access->refused = 0;
    }
    pthread_rwlock_unlock(&access->lock);
    if (!note)
        return;
    snprintf(detail, sizeof(detail), "%s; %zu others since the line before", why, before);
    log_write(LOG_LEVEL_WARNING, "access_refused",
              LOG_FIELDS(log_text("route", route), log_text("reason", detail)));
    store_audit_write(access->store, &(struct audit_new){&nobody, "access.refuse", route, detail});
}

/* To everybody on this machine. The lock is held. */
static bool is_open(const struct access *access)
{
    return access->loopback && access->mode != ACCESS_REQUIRED &&
           (access->mode == ACCESS_OPEN || access->count == 0);
}

static bool any_admin(const struct access *access)
{
    for (size_t i = 0; i < access->count; i++)
        if (access->tokens[i].role == ROLE_ADMIN && token_record_live(&access->tokens[i], now_ms()))
            return true;
    return false;
}

/* What stands behind "Bearer ", NULL when there is nothing of the kind. */
static const char *bearer(const char *authorization)
{
    if (!authorization || strncasecmp(authorization, "Bearer ", 7) != 0)
        return NULL;
    return authorization + 7 + strspn(authorization + 7, " ");
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}
