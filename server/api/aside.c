/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "aside.h"
#include "limits.h"
#include "reply.h"
#include "store_settle.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { HEADERS = 5, TEXTS = HEADERS + 2 * LIMIT_QUERY_MAX, HOLD_MS = 60000 };

const struct aside_rules aside_rules[LANES] = {
    [LANE_SWEEPS] = {.name = "sweeps",
                     .waiting_max = LIMIT_ASIDE_MAX,
                     .full = "so many sweeps wait to be taken already (LIMIT_ASIDE_MAX)",
                     .owner_max = LIMIT_ASIDE_OWNER_MAX,
                     .enough = "so many sweeps of yours wait, or are being taken "
                               "(LIMIT_ASIDE_OWNER_MAX)",
                     .settles = true},
    [LANE_DRAWINGS] = {.name = "drawing",
                       .waiting_max = LIMIT_ASIDE_MAX,
                       .full = "so many pictures and forecasts wait already (LIMIT_ASIDE_MAX)",
                       .owner_max = LIMIT_ASIDE_OWNER_MAX,
                       .enough = "so many pictures and forecasts of yours wait, or are being made "
                                 "(LIMIT_ASIDE_OWNER_MAX)",
                       .ends = true,
                       .settles = true},
    [LANE_THEORIES] = {.name = "theory",
                       .waiting_max = LIMIT_ASIDE_MAX,
                       .full = "so many theories wait to be computed already (LIMIT_ASIDE_MAX)",
                       .owner_max = LIMIT_THEORY_OWNER_MAX,
                       .enough = "so many of yours wait, or are being computed "
                                 "(LIMIT_THEORY_OWNER_MAX)",
                       .ends = true},
    [LANE_BACKUPS] = {.name = "backup",
                      .full = "another backup is being made or sent",
                      .ends = true,
                      .ms_max = LIMIT_BACKUP_MS},
    [LANE_RESULTS] = {.name = "results",
                      .waiting_max = LIMIT_ASIDE_MAX,
                      .full = "so many long results wait to be printed already (LIMIT_ASIDE_MAX)",
                      .owner_max = LIMIT_RESULTS_OWNER_MAX,
                      .enough = "so many long results that you asked for wait, or are being "
                                "printed (LIMIT_RESULTS_OWNER_MAX)",
                      .ends = true},
};

/* THREADS  Who works at it fills in the reply before `done` is set, whoever takes the reply looks
 * at `done` first. The rest does not change, but for `next`: under the aside's mutex. */
struct errand {
    atomic_int holders; /* the connection's hold, and the aside until it is done with it */
    atomic_int stop;    /* nobody waits for it any more */
    atomic_bool done;
    bool ends;
    handler *handle;
    const struct service *service;
    struct call call;
    struct request request; /* with texts of its own: */
    char *texts[TEXTS];
    struct request_query query[LIMIT_QUERY_MAX];
    struct reply reply;
    struct errand *next;
};

/* THREADS  `mutex` guards all but rules, thread and running. */
struct aside {
    const struct aside_rules *rules;
    pthread_mutex_t mutex;
    pthread_cond_t moved; /* something came, or is done, or it is to stop */
    struct errand *first, *last, *current;
    bool stop;
    pthread_t thread;
    bool running;
};

static struct errand *begin(struct aside *aside, handler *handle, const struct service *service,
                            const struct call *call, struct reply *reply);
static struct errand *copy(const struct call *call);
static const char *push(struct aside *aside, struct errand *errand);
static const char *refusal(const struct aside *aside, const struct errand *errand);
static void *work(void *aside);
static struct errand *pop(struct aside *aside, bool *refuse);
static void answer(struct aside *aside, struct errand *errand, bool refuse);
static bool is_done(void *errand);
static void leave(void *errand);
static void release(struct errand *errand);
static void pulse(const struct service *service);

struct aside *aside_create(const struct aside_rules *rules)
{
    struct aside *aside = calloc(1, sizeof(*aside));
    if (!aside)
        return NULL;
    aside->rules = rules;
    pthread_mutex_init(&aside->mutex, NULL);
    pthread_cond_init(&aside->moved, NULL);
    aside->running = pthread_create(&aside->thread, NULL, work, aside) == 0;
    if (aside->running) {
        pthread_setname_np(aside->thread, rules->name);
        return aside;
    }
    aside_free(aside);
    return NULL;
}

void aside_stop(struct aside *aside)
{
    if (!aside)
        return;
    pthread_mutex_lock(&aside->mutex);
    aside->stop = true;
    if (aside->current && aside->rules->ends)
        atomic_store(&aside->current->stop, 1);
    pthread_cond_broadcast(&aside->moved);
    pthread_mutex_unlock(&aside->mutex);
    if (aside->running)
        pthread_join(aside->thread, NULL);
    aside->running = false;
}

void aside_free(struct aside *aside)
{
    if (!aside)
        return;
    aside_stop(aside);
    pthread_cond_destroy(&aside->moved);
    pthread_mutex_destroy(&aside->mutex);
    free(aside);
}

void aside_answer(struct aside *aside, handler *handle, const struct service *service,
                  const struct call *call, struct reply *reply)
{
    struct errand *errand = call->request->held;
    if (!errand)
        errand = begin(aside, handle, service, call, reply);
    if (!errand)
        return;
    if (call->request->last) { /* the server is stopping: so is the aside, soon */
        pthread_mutex_lock(&aside->mutex);
        while (!atomic_load(&errand->done))
            pthread_cond_wait(&aside->moved, &aside->mutex);
        pthread_mutex_unlock(&aside->mutex);
    }
    int64_t left_ms = aside->rules->ms_max - call->request->waited_ms;
    if (atomic_load(&errand->done)) {
        reply_fini(reply);
        *reply = errand->reply;
        errand->reply = (struct reply){0};
        if (!call->request->held)
            release(errand);
    } else if (aside->rules->ms_max > 0 && left_ms <= 0) {
        reply_problem(reply, PROBLEM_BUSY, "it takes longer than %lld s",
                      (long long)aside->rules->ms_max / 1000);
    } else {
        bool soon = aside->rules->ms_max > 0 && left_ms < HOLD_MS;
        if (call->request->held) /* the hold before is let go of */
            atomic_fetch_add(&errand->holders, 1);
        reply_hold_take(reply, &(const struct hold){.ready = is_done,
                                                    .free = leave,
                                                    .state = errand,
                                                    .wait_ms = soon ? left_ms : HOLD_MS});
    }
}

/* NULL with the reply filled. */
static struct errand *begin(struct aside *aside, handler *handle, const struct service *service,
                            const struct call *call, struct reply *reply)
{
    struct errand *errand = copy(call);
    if (!errand) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
        return NULL;
    }
    errand->handle = handle;
    errand->service = service;
    errand->ends = aside->rules->ends;
    errand->reply.route = reply->route;
    memcpy(errand->reply.owner, reply->owner, sizeof(errand->reply.owner));
    atomic_init(&errand->holders, 2);
    const char *why = push(aside, errand);
    if (!why)
        return errand;
    atomic_store(&errand->holders, 1);
    release(errand);
    reply_problem(reply, PROBLEM_BUSY, "%s", why);
    return NULL;
}

/* What handlers of long requests read of the request. */
static struct errand *copy(const struct call *call)
{
    const struct request *from = call->request;
    struct errand *errand = calloc(1, sizeof(*errand));
    if (!errand)
        return NULL;
    errand->call = *call;
    errand->call.request = &errand->request;
    errand->call.stop = &errand->stop;
    errand->request = (struct request){.body_size = from->body_size, .last = true};
    const struct {
        const char *text, **to;
    } texts[HEADERS] = {{from->method, &errand->request.method},
                        {from->path, &errand->request.path},
                        {from->idempotency_key, &errand->request.idempotency_key},
                        {from->content_type, &errand->request.content_type},
                        {from->id, &errand->request.id}};
    bool sound = true;
    for (size_t i = 0; i < HEADERS; i++) {
        *texts[i].to = errand->texts[i] = texts[i].text ? strdup(texts[i].text) : NULL;
        sound = sound && !texts[i].text == !errand->texts[i];
    }
    errand->request.query = errand->query;
    for (size_t i = 0; i < from->query_count && i < LIMIT_QUERY_MAX; i++) {
        char **pair = &errand->texts[HEADERS + 2 * i];
        pair[0] = strdup(from->query[i].name);
        pair[1] = strdup(from->query[i].value);
        errand->query[i] = (struct request_query){pair[0], pair[1]};
        errand->request.query_count = i + 1;
        sound = sound && pair[0] && pair[1];
    }
    char *body = malloc(from->body_size + 1);
    errand->request.body = body;
    if (body) {
        memcpy(body, from->body, from->body_size);
        body[from->body_size] = '\0';
    }
    if (sound && body)
        return errand;
    atomic_init(&errand->holders, 1);
    release(errand);
    return NULL;
}

/* NULL, or why not. */
static const char *push(struct aside *aside, struct errand *errand)
{
    pthread_mutex_lock(&aside->mutex);
    const char *why = refusal(aside, errand);
    if (!why) {
        if (aside->last)
            aside->last->next = errand;
        else
            aside->first = errand;
        aside->last = errand;
        pthread_cond_broadcast(&aside->moved);
    }
    pthread_mutex_unlock(&aside->mutex);
    return why;
}

/* What nobody waits for any more is in nobody's way, but for the one that is just ending. */
static const char *refusal(const struct aside *aside, const struct errand *errand)
{
    const struct aside_rules *rules = aside->rules;
    size_t all = aside->current != NULL, own = 0;
    if (aside->stop)
        return "the server is stopping";
    for (const struct errand *other = aside->first; other; other = other->next) {
        if (atomic_load(&other->stop))
            continue;
        all++;
        own += strcmp(other->call.identity.owner, errand->call.identity.owner) == 0;
    }
    if (aside->current && !atomic_load(&aside->current->stop))
        own += strcmp(aside->current->call.identity.owner, errand->call.identity.owner) == 0;
    if (rules->owner_max > 0 && own >= rules->owner_max)
        return rules->enough;
    return all > rules->waiting_max ? rules->full : NULL;
}

static void *work(void *context)
{
    struct aside *aside = context;
    struct errand *errand;
    bool refuse;
    while ((errand = pop(aside, &refuse)) != NULL) {
        const struct service *service = errand->service;
        answer(aside, errand, refuse);
        /* What the store has put off, and those who wait for it need not know. */
        if (!refuse && aside->rules->settles && store_settle(service->store))
            pulse(service);
    }
    return NULL;
}

/* NULL = there is none, and there will be none. */
static struct errand *pop(struct aside *aside, bool *refuse)
{
    pthread_mutex_lock(&aside->mutex);
    while (!aside->first && !aside->stop)
        pthread_cond_wait(&aside->moved, &aside->mutex);
    struct errand *errand = aside->first;
    if (errand) {
        aside->first = errand->next;
        aside->last = aside->first ? aside->last : NULL;
        *refuse = aside->stop || atomic_load(&errand->stop);
    }
    aside->current = errand;
    pthread_mutex_unlock(&aside->mutex);
    return errand;
}

static void answer(struct aside *aside, struct errand *errand, bool refuse)
{
    const struct service *service = errand->service;
    if (refuse)
        reply_problem(&errand->reply, PROBLEM_BUSY, "the server is stopping");
    else
        errand->handle(service, &errand->call, &errand->reply);
    pthread_mutex_lock(&aside->mutex);
    aside->current = NULL;
    atomic_store(&errand->done, true);
    pthread_cond_broadcast(&aside->moved);
    pthread_mutex_unlock(&aside->mutex);
    release(errand);
    pulse(service);
}

static bool is_done(void *errand)
{
    return atomic_load(&((struct errand *)errand)->done);
}

/* A hold is freed: the only one, or the one before. */
static void leave(void *state)
{
    struct errand *errand = state;
    if (errand->ends && atomic_load(&errand->holders) <= 2) /* this one and the aside */
        atomic_store(&errand->stop, 1);
    release(errand);
}

static void release(struct errand *errand)
{
    if (atomic_fetch_sub(&errand->holders, 1) > 1)
        return;
    for (size_t i = 0; i < TEXTS; i++)
        free(errand->texts[i]);
    free((char *)errand->request.body);
    reply_fini(&errand->reply);
    free(errand);
}

/* Connections that rest are looked after. */
static void pulse(const struct service *service)
{
    struct http *http = atomic_load(&service->http);
    if (http)
        http_pulse(http);
}
