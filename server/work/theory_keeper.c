/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "theory_keeper.h"

#include "limits.h"
#include "log.h"
#include "scene_json.h"
#include "theory_print.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum state {
    STATE_IDLE,
    STATE_COMPUTING,
    STATE_ENDED, /* its thread is to be joined */
};

/* THREADS  `mutex` guards everything but what is atomic and, under a mutex of its own, wake. The
 * scene is the thread's while it is computing. A thread is joined with `mutex` held: its end, which
 * is the call of wake, may wait for others (http.c), so these must not wait for `mutex`:
 * theory_keeper_moved and _leave do without. */
struct theory_keeper {
    struct queue *queue;
    pthread_mutex_t mutex;
    enum state state;
    pthread_t thread;
    unsigned long number; /* of the theory in motion, or of the latest */
    unsigned char hash[JOB_HASH_SIZE];
    struct bcd_scene *scene;
    char *text;     /* of the latest; NULL: it failed or was ended */
    bool no_memory; /* why */
    pthread_mutex_t wake_mutex;
    void (*wake)(void *context);
    void *context;
    atomic_bool stop;
    atomic_ulong ended; /* the number of the latest that has */
    atomic_size_t waiting;
    atomic_int_least64_t left_ms; /* when the last of them left */
};

struct waiting {
    struct theory_keeper *keeper;
    unsigned long number;
};

static int64_t clock_ms(clockid_t clock)
{
    struct timespec now;

    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

struct theory_keeper *theory_keeper_create(struct queue *queue)
{
    struct theory_keeper *keeper = calloc(1, sizeof *keeper);

    if (!keeper)
        return NULL;
    keeper->queue = queue;
    pthread_mutex_init(&keeper->mutex, NULL);
    pthread_mutex_init(&keeper->wake_mutex, NULL);
    return keeper;
}

void theory_keeper_free(struct theory_keeper *keeper)
{
    if (!keeper)
        return;
    atomic_store(&keeper->stop, true);
    pthread_mutex_lock(&keeper->mutex);
    bool begun = keeper->state != STATE_IDLE;
    pthread_mutex_unlock(&keeper->mutex);
    if (begun)
        pthread_join(keeper->thread, NULL);
    bcd_scene_free(keeper->scene);
    free(keeper->text);
    pthread_mutex_destroy(&keeper->wake_mutex);
    pthread_mutex_destroy(&keeper->mutex);
    free(keeper);
}

void theory_keeper_wake(struct theory_keeper *keeper, void (*wake)(void *context), void *context)
{
    if (!keeper)
        return;
    pthread_mutex_lock(&keeper->wake_mutex);
    keeper->wake = wake;
    keeper->context = context;
    pthread_mutex_unlock(&keeper->wake_mutex);
}

/* -------------------------------------------------------------- its thread */

/* Requests leave for a moment whenever they are asked again. */
static bool should_stop(void *context)
{
    const struct theory_keeper *keeper = context;

    return atomic_load(&keeper->stop) ||
           (atomic_load(&keeper->waiting) == 0 &&
            clock_ms(CLOCK_MONOTONIC) - atomic_load(&keeper->left_ms) > LIMIT_THEORY_LEFT_MS);
}

static enum bcd_status compute(struct theory_keeper *keeper, char **text)
{
    struct bcd_watch watch = {.should_stop = should_stop,
                              .context = keeper,
                              .seconds_max = LIMIT_THEORY_ANSWER_SECONDS_MAX,
                              .bytes_max = queue_limits(keeper->queue)->run_bytes};
    struct bcd_theory *theory = NULL;
    enum bcd_status status = theory_cache_make(queue_theories(keeper->queue), keeper->scene,
                                               BCD_THEORY_INFINITE, &watch, &theory);

    if (status == BCD_OK)
        status = theory_print(theory, keeper->scene, text);
    bcd_theory_free(theory);
    log_write(
        LOG_LEVEL_INFO, "theory_computed",
        LOG_FIELDS(log_number("core_seconds", 1e-3 * (double)clock_ms(CLOCK_THREAD_CPUTIME_ID)),
                   log_text("end", bcd_status_text(status))));
    return status;
}

static void *thread_main(void *context)
{
    struct theory_keeper *keeper = context;
    char *text = NULL;
    enum bcd_status status = compute(keeper, &text);

    pthread_mutex_lock(&keeper->mutex);
    keeper->text = text;
    keeper->no_memory = status == BCD_NO_MEMORY;
    bcd_scene_free(keeper->scene);
    keeper->scene = NULL;
    keeper->state = STATE_ENDED;
    atomic_store(&keeper->ended, keeper->number);
    pthread_mutex_unlock(&keeper->mutex);
    pthread_mutex_lock(&keeper->wake_mutex);
    if (keeper->wake)
        keeper->wake(keeper->context);
    pthread_mutex_unlock(&keeper->wake_mutex);
    return NULL;
}

/* ------------------------------------------------------------------- asking */

/* The scene once more, as its thread's own. */
static struct bcd_scene *copy_of(const struct bcd_scene *scene)
{
    struct bcd_scene *copy = NULL;
    char *text = scene_json_job(scene);

    if (text && scene_json_complete(text, strlen(text), NULL, &copy, NULL) != BCD_OK)
        copy = NULL;
    free(text);
    return copy;
}

/* With the mutex held and nothing in motion. */
static enum theory_state begin(struct theory_keeper *keeper, const struct bcd_scene *scene)
{
    free(keeper->text);
    keeper->text = NULL;
    keeper->no_memory = false;
    keeper->scene = copy_of(scene);
    if (!keeper->scene)
        return THEORY_FAILED;
    atomic_store(&keeper->left_ms, clock_ms(CLOCK_MONOTONIC));
    if (pthread_create(&keeper->thread, NULL, thread_main, keeper) != 0) {
        bcd_scene_free(keeper->scene);
        keeper->scene = NULL;
        return THEORY_FAILED;
    }
    keeper->number++;
    keeper->state = STATE_COMPUTING;
    return THEORY_COMPUTING;
}

enum theory_state theory_keeper_ask(struct theory_keeper *keeper, const struct bcd_scene *scene,
                                    char **text)
{
    unsigned char hash[JOB_HASH_SIZE];
    enum theory_state state;

    if (!queue_hash(scene, hash))
        return THEORY_FAILED;
    pthread_mutex_lock(&keeper->mutex);
    if (keeper->state == STATE_ENDED) {
        pthread_join(keeper->thread, NULL); /* it has let the mutex go for good */
        keeper->state = STATE_IDLE;
    }
    bool same = keeper->number > 0 && memcmp(hash, keeper->hash, sizeof hash) == 0;
    if (keeper->state == STATE_COMPUTING) {
        state = same ? THEORY_COMPUTING : THEORY_BUSY;
    } else if (same && keeper->text) {
        *text = strdup(keeper->text);
        state = *text ? THEORY_READY : THEORY_FAILED;
    } else if (same && keeper->no_memory) {
        keeper->no_memory = false; /* told once */
        state = THEORY_FAILED;
    } else {
        memcpy(keeper->hash, hash, sizeof hash);
        state = begin(keeper, scene);
    }
    pthread_mutex_unlock(&keeper->mutex);
    return state;
}

void *theory_keeper_wait(struct theory_keeper *keeper)
{
    struct waiting *waiting = malloc(sizeof *waiting);

    if (!waiting)
        return NULL;
    atomic_fetch_add(&keeper->waiting, 1);
    pthread_mutex_lock(&keeper->mutex);
    *waiting = (struct waiting){keeper, keeper->number};
    pthread_mutex_unlock(&keeper->mutex);
    return waiting;
}

bool theory_keeper_moved(void *state)
{
    const struct waiting *waiting = state;

    return atomic_load(&waiting->keeper->ended) >= waiting->number;
}

void theory_keeper_leave(void *state)
{
    struct waiting *waiting = state;

    atomic_store(&waiting->keeper->left_ms, clock_ms(CLOCK_MONOTONIC));
    atomic_fetch_sub(&waiting->keeper->waiting, 1);
    free(waiting);
}
