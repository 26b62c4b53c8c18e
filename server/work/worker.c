/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * worker.c - see worker.h. The only file of the daemon that moves runs.
 *
 * A task's runs, one as a rule, go on in slices of about LIMIT_SLICE_MS. Between two slices their
 * progress is published and cancel, stop and checkpoints (worker_checkpoint.c) are looked at; how
 * the slices fall changes no bit of a run, nor do those that go beside it.
 *
 * THREADS  Each worker is one thread with its own run and tallies; what is shared is queue and
 * store.
 */
#include "worker_internal.h"

#include "crash.h"
#include "limits.h"
#include "log.h"
#include "store_attempts.h"
#include "store_results.h"

#include <assert.h>
#include <errno.h>
#include <signal.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum {
    SLICE_GROWTH_MAX = 8,    /* a slice is at most this much longer than the one before */
    BACK_OFF_MS_MIN = 100,   /* between two tries of the store: twice as long each time, */
    BACK_OFF_MS_MAX = 30000, /* but never longer than this */
    BROKEN_TRIES_MAX = 8,    /* a full disk is waited for; anything else gives up in the end */
};

/* ---------------------------------------------------------------------- clock */

int64_t work_now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

int64_t work_cpu_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

void work_tell_use(struct work *work)
{
    int64_t now = work_cpu_ns(), helped = crew_helped_ns(work->lead);

    queue_spend(work->workers->queue, work->task, (double)(now - work->cpu_ns + helped) * 1e-9);
    work->cpu_ns = now;
    work->helped_ns += helped;
}

bool work_should_stop(const struct work *work)
{
    return atomic_load(work->task->cancelled) || queue_stopping(work->workers->queue);
}

double work_seconds(const struct work *work)
{
    return 1e-9 * (double)(work_cpu_ns() - work->began_ns + work->helped_ns);
}

/* Longer than such a part of the job may take? Says so in the error. */
static bool over_time(struct work *work)
{
    const struct job_limits *limits = queue_limits(work->workers->queue);

    if (work->allowed_ns == 0 || work_seconds(work) <= 1e-9 * (double)work->allowed_ns)
        return false;
    work->error.code = BCD_STOPPED;
    snprintf(work->error.text, sizeof work->error.text,
             "this part of it has used %.3g core seconds, more than %g times the estimate and %g "
             "more (LIMIT_OVERRUN_FACTOR, LIMIT_OVERRUN_SECONDS)",
             work_seconds(work), limits->overrun_factor, limits->overrun_seconds);
    return true;
}

/* The engine's question. */
static bool ask_stop(void *context)
{
    struct work *work = context;

    atomic_store(&work->worker->seen_ns, work_now_ns());
    return work_should_stop(work) || over_time(work);
}

/* Waits before try number `tries` + 1 (tries >= 1); false as soon as there is no use in waiting. */
bool work_back_off(const struct work *work, int tries)
{
    const struct timespec nap = {.tv_nsec = LIMIT_SLICE_MS * 1000000L};
    int64_t wait_ms = BACK_OFF_MS_MIN;
    int64_t until;

    for (int i = 1; i < tries && wait_ms < BACK_OFF_MS_MAX; i++)
        wait_ms *= 2;
    until = work_now_ns() + (wait_ms < BACK_OFF_MS_MAX ? wait_ms : BACK_OFF_MS_MAX) * 1000000;
    while (!work_should_stop(work) && work_now_ns() < until)
        nanosleep(&nap, NULL);
    return !work_should_stop(work);
}

/* What to do about a store that answered `status` at try number `tries`: true = try again. */
bool work_try_again(struct work *work, enum store_status status, int tries)
{
    if (status == STORE_BROKEN && tries >= BROKEN_TRIES_MAX)
        return false;
    if (status != STORE_FULL && status != STORE_BROKEN)
        return false;
    log_write(LOG_LEVEL_WARNING, "worker_waits_for_store",
              LOG_FIELDS(log_text("job", work->task->id), log_integer("chunk", work->task->chunk),
                         log_text("cause", status == STORE_FULL ? "disk full" : "store broken"),
                         log_integer("tries", tries)));
    return work_back_off(work, tries);
}

/* ---------------------------------------------------------------------- one task */

/* How many ticks to take next, after `ticks` of them took `elapsed_ns`. */
static int64_t next_slice(int64_t ticks, int64_t elapsed_ns)
{
    const double target_ns = LIMIT_SLICE_MS * 1e6;
    double factor = elapsed_ns > 0 ? target_ns / (double)elapsed_ns : SLICE_GROWTH_MAX;
    double next = (double)ticks * (factor < SLICE_GROWTH_MAX ? factor : SLICE_GROWTH_MAX);

    return next < 1.0 ? 1 : next > 1e15 ? (int64_t)1e15 : (int64_t)next;
}

/* For the counters. */
double work_rod_steps(const struct task *task)
{
    struct bcd_estimate estimate;

    bcd_scene_estimate(task->scene, &estimate);
    return estimate.rod_steps * (double)task->count / (double)bcd_scene_chunks(task->scene);
}

/* Where a run was when its time began to be taken. */
struct measured {
    int64_t ticks, cpu_ns;
};

/* Nominal core seconds of the task. */
static double nominal_seconds(const struct task *task)
{
    const struct bcd_scene *scene = task->scene;
    double mine = (double)(bcd_scene_realizations(scene, task->chunk + task->count) -
                           bcd_scene_realizations(scene, task->chunk)) /
                  (double)bcd_scene_realizations(scene, bcd_scene_chunks(scene));
    struct bcd_estimate estimate;

    bcd_scene_estimate(scene, &estimate);
    return estimate.core_seconds * mine;
}

/* What a finished task has taken, or the part of it that was run here. */
static void note_cost(struct work *work, const struct measured *from)
{
    int64_t total = bcd_team_ticks_total(work->team);

    calibration_note(queue_calibration(work->workers->queue), calibration_method(work->task->scene),
                     nominal_seconds(work->task) * (double)(total - from->ticks) / (double)total,
                     1e-9 * (double)(work_cpu_ns() - from->cpu_ns + work->helped_ns));
}

/* How long the task may take, if something is wrong with it or with its estimate. */
void work_allow(struct work *work)
{
    struct queue *queue = work->workers->queue;
    const struct job_limits *limits = queue_limits(queue);
    const char *method = calibration_method(work->task->scene);
    double expected =
        nominal_seconds(work->task) * calibration_factor(queue_calibration(queue), method, NULL);
    double allowed = limits->overrun_factor * expected + limits->overrun_seconds;

    work->expected_seconds = expected;
    work->allowed_ns = allowed < 1e9 ? (int64_t)(1e9 * allowed) + 1 : 0;
}

/* Help from now on, of those who have nothing else to do. */
static void take_help(struct work *work)
{
    const struct task *task = work->task;

    if (!bcd_scene_takes_hands(task->scene))
        return;
    work->lead = crew_lead(work->workers->crew, task->id, task->chunk);
    if (!work->lead)
        return;
    bcd_run_lend_hands(bcd_team_run(work->team, 0), crew_hands(work->lead));
    queue_tell_idle(work->workers->queue);
}

static void end_help(struct work *work)
{
    work_tell_use(work);
    crew_end(work->lead);
    work->lead = NULL;
}

/* Advances the runs to their end; STOPPED when it was told to stop before. */
static enum run_end advance(struct work *work)
{
    const int64_t total = bcd_team_ticks_total(work->team);
    const double rods_per_tick = work_rod_steps(work->task) / (double)total;
    const struct measured measured = {bcd_team_ticks_done(work->team), work_cpu_ns()};
    int64_t slice = 1, before = work_now_ns(), done = measured.ticks;

    saving_begin(work, before);
    atomic_store(work->task->ticks_done, done);
    atomic_store(work->task->ticks_total, total);
    while (done < total) {
        int64_t after, from = done;

        if (work_should_stop(work))
            return RUN_STOPPED;
        work->error.code = bcd_team_advance(work->team, slice, &work->error);
        if (work->error.code || over_time(work))
            return work_should_stop(work) ? RUN_STOPPED : RUN_FAILED;
        after = work_now_ns();
        done = bcd_team_ticks_done(work->team);
        if (work->lead)
            crew_note(work->lead, done - from, after - before);
        slice = next_slice(slice, after - before);
        atomic_store(&work->worker->seen_ns, after);
        atomic_fetch_add(&work->worker->rod_steps,
                         (int64_t)(rods_per_tick * (double)(done - from)));
        atomic_store(work->task->ticks_done, done);
        work_tell_use(work);
        if (done < total && saving_look(work, after)) {
            if (queue_gives_way(work->workers->queue, work->task))
                return RUN_GAVE_WAY;
            after = work_now_ns();
        }
        before = after;
    }
    note_cost(work, &measured);
    return RUN_DONE;
}

enum run_end work_run_here(struct work *work)
{
    work_allow(work);
    work->error.code = work_create_team(work);
    if ((work->error.code == BCD_NO_MEMORY || work->error.code == BCD_STOPPED) &&
        work_should_stop(work))
        return RUN_STOPPED;
    if (work->error.code)
        return RUN_FAILED;
    take_help(work);
    enum run_end outcome = advance(work);
    end_help(work);
    if (outcome == RUN_DONE)
        return work_put_tallies(work);
    /* Runs that were stopped in the middle of a start go on from their last checkpoints. */
    if (outcome == RUN_STOPPED && !atomic_load(work->task->cancelled) &&
        work->watch.end == BCD_WATCH_GOES_ON)
        saving_last(work);
    return outcome;
}

/* ---------------------------------------------------------------------- the loop */

/* A job that was cancelled meanwhile stays cancelled. */
static void fail_job(struct work *work)
{
    const char *id = work->task->id;
    char reason[sizeof work->error.text + 64];
    enum store_status status;
    int tries = 0;

    /* Who ran it elsewhere has said all. */
    snprintf(reason, sizeof reason, "%s%s%s",
             work->error.code ? bcd_status_text(work->error.code) : "",
             work->error.code && work->error.text[0] ? ": " : "", work->error.text);
    do
        status = store_jobs_fail(work->workers->store, id, reason);
    while (work_try_again(work, status, ++tries));
    if (status != STORE_CONFLICT)
        log_write(LOG_LEVEL_ERROR, "job_failed",
                  LOG_FIELDS(log_text("job", id), log_integer("chunk", work->task->chunk),
                             log_text("reason", reason)));
    queue_cancel(work->workers->queue, id);
}

static void do_task(struct worker *worker, struct task *task)
{
    struct workers *workers = worker->workers;
    struct work work = {.workers = workers, .worker = worker, .task = task};
    work.began_ns = work.cpu_ns = work_cpu_ns();
    work.watch = (struct bcd_watch){.should_stop = ask_stop,
                                    .context = &work,
                                    .bytes_max = queue_limits(workers->queue)->run_bytes};
    bool last = task->chunk == QUEUE_FINISH;

    if (!last) {
        enum run_end outcome = work_run_chunk(&work);

        saving_end(&work,
                   outcome == RUN_DONE || outcome == RUN_FAILED || atomic_load(task->cancelled));
        bcd_team_free(work.team);
        work.team = NULL;
        work_tell_use(&work);
        if (outcome != RUN_DONE) {
            if (outcome == RUN_FAILED)
                fail_job(&work);
            queue_release(workers->queue, task);
            return;
        }
        atomic_fetch_add(&worker->chunks, task->count);
        queue_done(workers->queue, task, &last);
    }
    if (last) {
        work.allowed_ns = 0; /* theory has a limit of its own, and the rest is short */
        enum finish finish = FINISH_ENDED; /* stopped: at the next start */

        if (work_begin(&work)) {
            finish = work_finish(&work);
            work_end(&work);
        }
        if (finish == FINISH_FAILED)
            fail_job(&work);
        work_tell_use(&work);
        if (finish != FINISH_AGAIN)
            queue_forget(workers->queue, task->id);
    }
}

static void *worker_main(void *context)
{
    struct worker *worker = context;
    struct crash_stack *stack = crash_enter(worker->workers->crash_path);
    struct task task;

    atomic_store(&worker->id, gettid());
    while (work_take(worker, &task)) {
        atomic_store(&worker->seen_ns, work_now_ns());
        atomic_store(&worker->busy, true);
        crash_note(task.id, task.chunk);
        do_task(worker, &task);
        crash_note(NULL, 0);
        atomic_store(&worker->busy, false);
    }
    crash_leave(stack);
    atomic_store(&worker->alive, false);
    return NULL;
}

/* A worker that is needed nowhere helps those who run large rings. */
struct idleness {
    const struct queue *queue;
    unsigned news;
};

static bool is_needed(void *context)
{
    const struct idleness *idleness = context;

    return queue_news(idleness->queue) != idleness->news;
}

static bool help_others(void *context, unsigned news)
{
    const struct workers *workers = context;
    struct idleness idleness = {workers->queue, news};

    return crew_help(workers->crew, is_needed, &idleness);
}

struct workers *workers_start(size_t count, struct queue *queue, struct store *store)
{
    return workers_start_lending(count, queue, store, NULL);
}

bool work_grow(struct workers *workers)
{
    struct worker *worker;
    sigset_t all, kept;
    size_t count;
    int code = EAGAIN;

    pthread_mutex_lock(&workers->grow);
    count = atomic_load(&workers->count);
    if (count < workers->most) {
        worker = &workers->each[count];
        worker->workers = workers;
        worker->aside = count < workers->aside;
        atomic_store(&worker->alive, true);
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &kept);
        code = pthread_create(&worker->thread, NULL, worker_main, worker);
        pthread_sigmask(SIG_SETMASK, &kept, NULL);
        if (code == 0) {
            pthread_setname_np(worker->thread, worker->aside ? "finisher" : "worker");
            atomic_store(&workers->count, count + 1);
        } else if (!atomic_exchange(&workers->told, true)) {
            log_write(
                LOG_LEVEL_ERROR, "worker_not_started",
                LOG_FIELDS(log_integer("errno", code), log_integer("started", (int64_t)count)));
        }
    }
    pthread_mutex_unlock(&workers->grow);
    return code == 0;
}

struct workers *workers_start_lending(size_t count, struct queue *queue, struct store *store,
                                      struct leases *leases)
{
    struct workers *workers;
    size_t aside = work_finishers(count), first = count;

    assert(count >= 1 && count <= LIMIT_WORKERS_MAX);
    workers = calloc(1, sizeof *workers + (aside + count) * sizeof workers->each[0]);
    if (!workers)
        return NULL;
    workers->most = aside + count;
    pthread_mutex_init(&workers->grow, NULL);
    workers->aside = aside;
    workers->queue = queue;
    workers->store = store;
    queue_set_workers(queue, leases ? 0 : count); /* chunks are lent one by one */
    workers->crash_path = queue_crash_path(queue);
    if (!workers->crash_path) {
        pthread_mutex_destroy(&workers->grow);
        free(workers);
        return NULL;
    }
    workers->leases = leases;
    if (!leases && count > 1) {
        workers->crew = crew_create(count); /* none: everyone goes alone */
        queue_set_idle(queue, help_others, workers);
    }
    sem_init(&workers->taking, 0, LIMIT_LENDING_TAKE);
    sem_init(&workers->working, 0, LIMIT_LENDING_WORK);
    if (leases && first > LIMIT_LENDING_FIRST)
        first = LIMIT_LENDING_FIRST;
    while (atomic_load(&workers->count) < aside + first)
        if (!work_grow(workers)) {
            workers_stop(workers);
            return NULL;
        }
    return workers;
}

/* Those that come later inherit it from one of these. */
void workers_step_back(struct workers *workers, int nice)
{
    int to = getpriority(PRIO_PROCESS, (id_t)gettid()) + nice;

    pthread_mutex_lock(&workers->grow);
    for (size_t i = 0; i < atomic_load(&workers->count); i++) {
        id_t id;

        while ((id = (id_t)atomic_load(&workers->each[i].id)) == 0) /* it is about to start */
            sched_yield();
        setpriority(PRIO_PROCESS, id, to);
    }
    pthread_mutex_unlock(&workers->grow);
}

void workers_stop(struct workers *workers)
{
    if (!workers)
        return;
    queue_stop(workers->queue);
    if (workers->leases)
        leases_wake(workers->leases);
    /* None begins another once all are joined. */
    for (size_t i = 0; i < atomic_load(&workers->count); i++)
        pthread_join(workers->each[i].thread, NULL);
    store_attempts_stop(workers->store); /* if it fails, they count as lost: no harm */
    sem_destroy(&workers->taking);
    sem_destroy(&workers->working);
    pthread_mutex_destroy(&workers->grow);
    queue_set_idle(workers->queue, NULL, NULL);
    crew_free(workers->crew);
    free(workers->crash_path);
    free(workers);
}

void workers_count(const struct workers *workers, struct workers_counts *counts)
{
    int64_t now = work_now_ns();
    size_t count = atomic_load(&workers->count);

    *counts = (struct workers_counts){.started = count - workers->aside,
                                      .most = workers->most - workers->aside,
                                      .helping = crew_helpers(workers->crew)};
    for (size_t i = 0; i < count; i++) {
        const struct worker *worker = &workers->each[i];
        int64_t silent_ms = (now - atomic_load(&worker->seen_ns)) / 1000000;
        struct timespec used = {0};
        clockid_t clock;

        counts->chunks += atomic_load(&worker->chunks);
        counts->checkpoints += atomic_load(&worker->checkpoints);
        counts->saving_seconds += 1e-9 * (double)atomic_load(&worker->saving_ns);
        counts->rod_steps += (double)atomic_load(&worker->rod_steps);
        if (!atomic_load(&worker->alive))
            continue;
        counts->alive += !worker->aside;
        if (pthread_getcpuclockid(worker->thread, &clock) == 0)
            clock_gettime(clock, &used);
        counts->core_seconds += (double)used.tv_sec + (double)used.tv_nsec * 1e-9;
        if (!atomic_load(&worker->busy))
            continue;
        counts->busy += !worker->aside;
        if (silent_ms > counts->silent_ms)
            counts->silent_ms = silent_ms;
    }
}
