/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle_events.c - what happens to one job, or to all of them, as Server-Sent Events.
 *
 * THREADS  A listener belongs to its stream: http.c calls its functions one at a time.
 */
#include "handle.h"
#include "job_request.h"
#include "limits.h"
#include "reply.h"
#include "stream_counts.h"
#include "stream_events.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RETRY_MS = 2000, MOVES_AT_ONCE = 64, BATCHES_A_COUNT = 8 };
static const double progress_step = 0.001; /* less is not worth an event */

/* Who listens, until their token ends. */
struct guest {
    const struct service *service;
    struct identity identity;
};

/* Somebody who listens to one job. */
struct job_listener {
    struct guest guest; /* first: leave() frees any listener */
    char id[JOB_ID_SIZE];
    int64_t seq;
    uint64_t since;
    double told;
    enum job_state state;
    bool begun;
};

/* Somebody who listens to all, or to those of an owner or a sweep. */
struct listener {
    struct guest guest;      /* first */
    char owner[OWNER_SIZE];  /* "" = of all */
    int64_t sweep;           /* seq; 0 = of any and none */
    uint64_t since, counted; /* the change told last; the one that the latest counts were told at */
    int batches;             /* since those counts */
    bool begun, behind;      /* behind: there was more than went into a batch */
    struct feed_progress told[LIMIT_FEED_RUNNING];
    size_t told_count;
};

static bool enter(const struct service *service, const struct call *call, struct guest *guest,
                  struct reply *reply);
static void leave(void *state);
static bool may_stay(const struct guest *guest, struct text *text);
static bool job_fresh(void *state);
static enum events_next job_next(void *state, struct text *text);
static void add_job(struct text *text, const char *event, const struct job_move *job,
                    double progress);
static bool all_fresh(void *state);
static enum events_next all_next(void *state, struct text *text);
static bool concerns(const struct listener *listener, const struct job_move *job);
static void add_moves(struct listener *listener, struct text *text);
static void add_progress(struct listener *listener, struct text *text);
static void add_counts(struct listener *listener, struct text *text);
static uint64_t resume_after(const struct service *service, const char *last_id);

void handle_events_job(const struct service *service, const struct call *call, struct reply *reply)
{
    struct job_record record = {0};
    enum store_status status = store_jobs_get(service->store, call->arg[0], &record);
    struct job_listener *listener = calloc(1, sizeof(*listener));
    if (status != STORE_OK || !listener) {
        free(listener);
        if (status != STORE_OK)
            reply_store(reply, status, "such job");
        else
            reply_bcd(reply, BCD_NO_MEMORY, NULL);
        job_record_fini(&record);
        return;
    }
    listener->seq = record.seq;
    memcpy(listener->id, record.id, sizeof(listener->id));
    job_record_fini(&record);
    if (!enter(service, call, &listener->guest, reply)) {
        free(listener);
        return;
    }
    const struct stream stream = stream_events_take(&(const struct events){
        .fresh = job_fresh, .next = job_next, .free = leave, .state = listener});
    reply_events_take(reply, &stream);
}

/* False, with the reply filled, when the owner has enough streams. */
static bool enter(const struct service *service, const struct call *call, struct guest *guest,
                  struct reply *reply)
{
    *guest = (struct guest){.service = service, .identity = call->identity};
    if (!service->streams || stream_counts_take(service->streams, guest->identity.owner))
        return true;
    reply_problem(reply, PROBLEM_QUOTA,
                  "%s has %d event streams open already (LIMIT_OWNER_STREAMS_MAX)",
                  guest->identity.owner, LIMIT_OWNER_STREAMS_MAX);
    return false;
}

/* A listener begins with its guest. */
static void leave(void *state)
{
    const struct guest *guest = state;
    if (guest->service->streams)
        stream_counts_give(guest->service->streams, guest->identity.owner);
    free(state);
}

/* Looked at whenever events may be written: at least once a second. */
static bool may_stay(const struct guest *guest, struct text *text)
{
    const char *why;
    if (!guest->service->access || access_still(guest->service->access, &guest->identity, &why))
        return true;
    text_add(text, "event: end\ndata: {\"reason\":\"%s\"}\n\n", why);
    return false;
}

static bool job_fresh(void *state)
{
    struct job_listener *listener = state;
    if (feed_moved(listener->guest.service->feed, &listener->since, listener->seq))
        return true;
    double progress = queue_progress(listener->guest.service->queue, listener->id);
    return progress >= 0 && fabs(progress - listener->told) >= progress_step;
}

/* Events of a change, of progress, and `done` when there will be no more. */
static enum events_next job_next(void *state, struct text *text)
{
    struct job_listener *listener = state;
    const struct service *service = listener->guest.service;
    struct job_record record = {0};
    if (!may_stay(&listener->guest, text))
        return EVENTS_END;
    if (!listener->begun)
        text_add(text, "retry: %d\n\n", RETRY_MS);
    else if (!job_fresh(listener))
        return EVENTS_LATER;
    listener->since = feed_now(service->feed); /* before the store is asked */
    if (store_jobs_get(service->store, listener->id, &record) != STORE_OK)
        return EVENTS_LATER; /* the log says why; it is tried again */
    double progress = job_request_progress(service, &record);
    struct job_move job = {.state = record.state};
    memcpy(job.id, record.id, sizeof(job.id));
    bool ended = record.finished_ms != 0;
    if (!listener->begun || record.state != listener->state ||
        fabs(progress - listener->told) >= progress_step)
        add_job(text, "progress", &job, progress);
    if (ended)
        add_job(text, "done", &job, progress);
    listener->begun = true;
    listener->state = record.state;
    listener->told = progress;
    job_record_fini(&record);
    return ended ? EVENTS_END : EVENTS_LATER;
}

static void add_job(struct text *text, const char *event, const struct job_move *job,
                    double progress)
{
    text_add(text, "event: %s\ndata: {\"id\":\"%s\",\"state\":\"%s\",", event, job->id,
             job_state_name(job->state));
    if (job->owner[0])
        text_add(text, "\"owner\":\"%s\",", job->owner);
    text_add(text, "\"progress\":");
    text_add_number(text, progress);
    text_add(text, "}\n\n");
}

void handle_events_all(const struct service *service, const struct call *call, struct reply *reply)
{
    const char *owner = call_query(call, "owner");
    const char *sweep = call_query(call, "sweep");
    int64_t sweep_seq = 0;
    enum store_status status =
        sweep ? store_watch_sweep(service->store, sweep, &sweep_seq) : STORE_OK;
    if (status != STORE_OK) {
        reply_store(reply, status, "such sweep");
        return;
    }
    struct listener *listener = calloc(1, sizeof(*listener));
    if (!listener) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
        return;
    }
    if (!enter(service, call, &listener->guest, reply)) {
        free(listener);
        return;
    }
    listener->sweep = sweep_seq;
    listener->counted = FEED_UNKNOWN;
    listener->since = resume_after(service, call->request->last_event_id);
    if (owner)
        snprintf(listener->owner, sizeof(listener->owner), "%s", owner);
    const struct stream stream = stream_events_take(&(const struct events){
        .fresh = all_fresh, .next = all_next, .free = leave, .state = listener});
    reply_events_take(reply, &stream);
}

/* The number of the change that the client saw last; of an earlier start of the server it is one
 * that is lost. Without an id, what happened before is not told. */
static uint64_t resume_after(const struct service *service, const char *last_id)
{
    uint64_t start, number, now = feed_now(service->feed);
    if (!last_id)
        return now;
    if (sscanf(last_id, "%" SCNx64 "-%" SCNu64, &start, &number) == 2 &&
        start == feed_start(service->feed) && number <= now)
        return number;
    return FEED_UNKNOWN;
}

static bool all_fresh(void *state)
{
    struct listener *listener = state;
    struct feed_progress jobs[LIMIT_FEED_RUNNING];
    if (listener->behind || feed_now(listener->guest.service->feed) != listener->since)
        return true;
    size_t count = feed_progress(listener->guest.service->feed, jobs, LIMIT_FEED_RUNNING);
    if (count != listener->told_count)
        return true;
    for (size_t i = 0; i < count; i++)
        if (jobs[i].job.seq != listener->told[i].job.seq ||
            fabs(jobs[i].progress - listener->told[i].progress) >= progress_step)
            return true;
    return false;
}

/* While more happens than the client takes, the counts still come, every few batches. */
static enum events_next all_next(void *state, struct text *text)
{
    struct listener *listener = state;
    if (!may_stay(&listener->guest, text))
        return EVENTS_END;
    if (!listener->begun)
        text_add(text, "retry: %d\n\n", RETRY_MS);
    listener->begun = true;
    add_moves(listener, text);
    if (!listener->behind)
        add_progress(listener, text);
    bool due = !listener->behind || ++listener->batches >= BATCHES_A_COUNT;
    if (due && listener->counted != listener->since && !listener->owner[0])
        add_counts(listener, text);
    return listener->behind ? EVENTS_MORE : EVENTS_LATER;
}

static bool concerns(const struct listener *listener, const struct job_move *job)
{
    return (!listener->owner[0] || strcmp(listener->owner, job->owner) == 0) &&
           (listener->sweep == 0 || job_move_in_sweep(job, listener->sweep));
}

/* Of several changes of a job in one batch only the last is told. Each has its own number, so that
 * who is cut off within a batch goes on there. */
static void add_moves(struct listener *listener, struct text *text)
{
    struct feed *feed = listener->guest.service->feed;
    struct job_move moves[MOVES_AT_ONCE];
    bool lost;
    size_t count = feed_read(feed, &listener->since, moves, MOVES_AT_ONCE, &lost);
    listener->behind = count == MOVES_AT_ONCE;
    if (lost)
        text_add(text, "event: lost\ndata: {\"reason\":\"more jobs changed than are told one by "
                       "one: list them\"}\n\n");
    for (size_t i = 0; i < count; i++) {
        size_t later = i + 1;
        while (later < count && moves[later].seq != moves[i].seq)
            later++;
        if (later < count || !concerns(listener, &moves[i]))
            continue;
        double progress = moves[i].state == JOB_DONE
                              ? 1
                              : queue_progress(listener->guest.service->queue, moves[i].id);
        text_add(text, "id: %" PRIx64 "-%" PRIu64 "\n", feed_start(feed),
                 listener->since - (count - 1 - i));
        add_job(text, "job", &moves[i], progress < 0 ? 0 : progress);
    }
}

static void add_progress(struct listener *listener, struct text *text)
{
    struct feed_progress jobs[LIMIT_FEED_RUNNING];
    size_t count = feed_progress(listener->guest.service->feed, jobs, LIMIT_FEED_RUNNING);
    for (size_t i = 0; i < count; i++) {
        size_t old = 0;
        while (old < listener->told_count && listener->told[old].job.seq != jobs[i].job.seq)
            old++;
        if (old < listener->told_count &&
            fabs(jobs[i].progress - listener->told[old].progress) < progress_step)
            jobs[i].progress = listener->told[old].progress;
        else if (concerns(listener, &jobs[i].job))
            add_job(text, "job", &jobs[i].job, jobs[i].progress);
    }
    memcpy(listener->told, jobs, count * sizeof(jobs[0]));
    listener->told_count = count;
}

static void add_counts(struct listener *listener, struct text *text)
{
    int64_t counts[JOB_STATES];
    const struct service *service = listener->guest.service;
    enum store_status status = listener->sweep
                                   ? store_watch_counts(service->store, listener->sweep, counts)
                                   : store_jobs_counts(service->store, counts);
    if (status != STORE_OK)
        return;
    listener->counted = listener->since;
    listener->batches = 0;
    text_add(text, "id: %" PRIx64 "-%" PRIu64 "\nevent: counts\ndata: {", feed_start(service->feed),
             listener->since);
    for (int state = 0; state < JOB_STATES; state++)
        text_add(text, "%s\"%s\":%" PRId64, state ? "," : "", job_state_name((enum job_state)state),
                 counts[state]);
    text_add(text, "}\n\n");
}
