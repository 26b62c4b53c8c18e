/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * http_rest.c - connections that wait for something to happen, without a thread: suspended in the
 * library, resumed by the reaper's thread.
 *
 * A connection is suspended and resumed under `mutex`, each once in turn: to the library of version
 * 0.9.75 a second resumption means that the next suspension does not happen, and a reader that has
 * nothing and is not suspended is never asked again.
 */
#include "http_internal.h"

enum { LOOK_MS = 1000 }; /* a resting connection is looked after this often in any case */

static void resume(struct http *http, struct connection *c, enum woken woken);

void http_pulse(struct http *http)
{
    pthread_mutex_lock(&http->mutex);
    atomic_fetch_add(&http->pulses, 1);
    if (http->resting > 0 && !http->pulsed) {
        http->pulsed = true;
        pthread_cond_signal(&http->wake_reaper);
    }
    pthread_mutex_unlock(&http->mutex);
}

bool http_rest_begin(struct http *http, struct connection *c, const struct resting *resting)
{
    pthread_mutex_lock(&http->mutex);
    bool rests = !atomic_load(&http->stopping);
    if (rests) {
        int64_t now_ms = http_clock_ms();
        c->rest = REST_SUSPENDED;
        c->ready = resting->ready;
        c->ready_state = resting->state;
        c->rest_until_ms = resting->until_ms;
        c->resume_ms = now_ms + LOOK_MS;
        c->deadline_ms = now_ms + LIMIT_ANSWER_AGE_MS_MAX;
        MHD_suspend_connection(c->handle);
        bool missed = atomic_load(&http->pulses) != resting->pulses;
        http->pulsed |= missed;
        if (http->resting++ == 0 || missed)
            pthread_cond_signal(&http->wake_reaper);
    }
    pthread_mutex_unlock(&http->mutex);
    return rests;
}

enum woken http_rest_end(struct http *http, struct connection *c)
{
    pthread_mutex_lock(&http->mutex);
    c->rest = REST_NOT;
    enum woken woken = c->woken;
    pthread_mutex_unlock(&http->mutex);
    return woken;
}

void http_rest_wake(struct http *http, int64_t now_ms)
{
    bool all = atomic_load(&http->stopping);
    for (struct connection *c = http->connections; c && http->resting > 0; c = c->next) {
        if (c->rest != REST_SUSPENDED)
            continue;
        if (all || now_ms >= c->rest_until_ms || c->ready(c->ready_state))
            resume(http, c, WOKEN_DUE);
        else if (now_ms >= c->resume_ms)
            resume(http, c, WOKEN_LOOK);
    }
}

/* The library asks for the answer before it looks at the socket. */
void http_rest_drop(struct http *http, struct connection *c)
{
    resume(http, c, WOKEN_LEFT);
}

static void resume(struct http *http, struct connection *c, enum woken woken)
{
    c->rest = REST_RESUMED;
    c->woken = woken;
    http->resting--;
    MHD_resume_connection(c->handle);
}
