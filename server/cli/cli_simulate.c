/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_simulate.c - see cli_simulate.h. Besides worker.c the only file that moves runs.
 *
 * THREADS  Workers take chunks by number, several at once where small rings go side by side; each
 *          owns its runs alone. Tallies are merged under
 *          `mutex` in the order of the chunks, as bytes and in the same steps as in the daemon, so
 *          that the result depends on neither workers nor chance. At each milestone of a job with a
 *          target they wait for the verdict. The main thread shows progress and takes the signals,
 *          which are blocked in all threads. Who has no chunk to run helps those who run large
 *          rings (crew.h).
 */
#include "cli_simulate.h"
#include "cli.h"
#include "crew.h"
#include "limits.h"

#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BAR_WIDTH = 30, SHOW_MS = 200, SLICE_GROWTH_MAX = 4 };

/* One worker's chunks in motion, for the progress bar. */
struct motion {
    _Atomic int64_t done, total; /* ticks; total 0 = none in motion */
    _Atomic int64_t chunks;
};

struct job {
    const struct bcd_scene *scene;
    const char *label;
    int64_t chunks, team;   /* team: as many go side by side at most */
    atomic_bool stop;       /* a signal, or a worker that failed */
    struct crew *crew;      /* of large rings; NULL = who has no chunk to run ends */
    atomic_uint news;       /* how often `changed` was told */
    _Atomic int64_t ticks;  /* of finished chunks */
    _Atomic int64_t cpu_ns; /* of ended workers */
    struct motion *motion;  /* [workers] */
    size_t workers, wanted; /* threads that there are, and that there should be */
    pthread_mutex_t mutex;  /* guards what follows */
    pthread_cond_t changed; /* a worker ended, or more chunks may be taken */
    size_t ended, running; /* workers; running: with chunks */
    int64_t next, goal;         /* first chunk that nobody took; chunks up to the milestone */
    struct bcd_verdict verdict; /* at the milestone before */
    int64_t merged; /* chunks whose tallies are in `whole` */
    struct {
        void *bytes;
        size_t size;
    } * waiting; /* [chunks]: finished before their turn */
    struct bcd_tally *whole, *part;
    struct bcd_error error; /* the first failure; code BCD_OK = none */
};

struct worker {
    struct job *job;
    struct motion *motion;
    pthread_t thread;
};

static void start_workers(struct job *job, struct worker *workers);
static int watch(struct job *job, const sigset_t *signals, bool show);
static void choose_signals(sigset_t *signals);
static int judge(const struct job *job, int ended_by);

int cli_simulate(struct cli_simulation *simulation)
{
    const struct bcd_scene *scene = simulation->scene;
    struct job job = {.scene = scene,
                      .label = simulation->label,
                      .chunks = bcd_scene_chunks(scene),
                      .team = bcd_scene_team(scene),
                      .goal = bcd_scene_goal(scene, 0),
                      .mutex = PTHREAD_MUTEX_INITIALIZER,
                      .changed = PTHREAD_COND_INITIALIZER};
    sigset_t signals, before;
    choose_signals(&signals);
    simulation->tally = NULL;
    job.workers = (size_t)(simulation->workers < job.chunks ? simulation->workers : job.chunks);
    if (bcd_scene_takes_hands(scene) && (job.crew = crew_create(job.workers)) != NULL)
        job.workers = (size_t)simulation->workers;
    job.wanted = job.workers;
    job.motion = calloc(job.workers, sizeof *job.motion);
    job.waiting = calloc((size_t)job.chunks, sizeof *job.waiting);
    struct worker *workers = calloc(job.workers, sizeof *workers);
    int ended_by = 0, status = CLI_FAILED;
    if (!job.motion || !job.waiting || !workers || bcd_tally_create(&job.whole, scene) ||
        bcd_tally_create(&job.part, scene)) {
        fprintf(stderr, "bcd: out of memory\n");
        goto cleanup;
    }
    pthread_sigmask(SIG_BLOCK, &signals, &before);
    start_workers(&job, workers);
    ended_by = watch(&job, &signals, !simulation->quiet && isatty(STDERR_FILENO));
    for (size_t i = 0; i < job.workers; i++)
        pthread_join(workers[i].thread, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    simulation->core_seconds = (double)atomic_load(&job.cpu_ns) * 1e-9;
    status = judge(&job, ended_by);
    if (status == CLI_OK) {
        simulation->tally = job.whole;
        simulation->verdict = job.verdict;
        job.whole = NULL;
    }
cleanup:
    for (int64_t i = 0; job.waiting && i < job.chunks; i++)
        free(job.waiting[i].bytes);
    free(job.waiting);
    crew_free(job.crew);
    free(job.motion);
    free(workers);
    bcd_tally_free(job.whole);
    bcd_tally_free(job.part);
    return status;
}

int64_t cli_cores(void)
{
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

/* ----------------------------------------------------------------- workers */

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* Something that others may wait for: under the mutex. */
static void tell(struct job *job)
{
    atomic_fetch_add(&job->news, 1);
    pthread_cond_broadcast(&job->changed);
}

static void fail(struct job *job, enum bcd_status code, const struct bcd_error *error)
{
    pthread_mutex_lock(&job->mutex);
    if (job->error.code == BCD_OK) {
        if (error)
            job->error = *error;
        job->error.code = code;
    }
    atomic_store(&job->stop, true);
    tell(job);
    pthread_mutex_unlock(&job->mutex);
}

/* Help from now on, of those who have nothing else to do. */
static struct crew_lead *take_help(struct job *job, struct bcd_team *team)
{
    struct crew_lead *lead = crew_lead(job->crew, "", 0);
    if (!lead)
        return NULL;
    bcd_run_lend_hands(bcd_team_run(team, 0), crew_hands(lead));
    pthread_mutex_lock(&job->mutex);
    tell(job);
    pthread_mutex_unlock(&job->mutex);
    return lead;
}

/* Advances the runs in slices of about LIMIT_SLICE_MS, to their end or until told to stop. */
static enum bcd_status advance(struct worker *worker, struct bcd_team *team,
                               struct bcd_error *error)
{
    struct crew_lead *lead = take_help(worker->job, team);
    enum bcd_status status = BCD_OK;
    int64_t total = bcd_team_ticks_total(team), slice = 1;
    atomic_store(&worker->motion->done, 0);
    atomic_store(&worker->motion->chunks, bcd_team_count(team));
    atomic_store(&worker->motion->total, total);
    while (status == BCD_OK && bcd_team_ticks_done(team) < total &&
           !atomic_load(&worker->job->stop)) {
        int64_t before = clock_ns(CLOCK_MONOTONIC), done = bcd_team_ticks_done(team);
        status = bcd_team_advance(team, slice, error);
        int64_t elapsed = clock_ns(CLOCK_MONOTONIC) - before;
        if (lead)
            crew_note(lead, bcd_team_ticks_done(team) - done, elapsed);
        double share = (double)elapsed / (LIMIT_SLICE_MS * 1e6);
        double factor = fmin(1 / fmax(share, 1e-9), SLICE_GROWTH_MAX);
        slice = (int64_t)fmin(fmax((double)slice * factor, 1), 1e15);
        atomic_store(&worker->motion->done, bcd_team_ticks_done(team));
    }
    crew_end(lead);
    return status;
}

/* All chunks up to the goal are merged: is that enough? Under the mutex. */
static enum bcd_status judge_milestone(struct job *job)
{
    enum bcd_status status = bcd_tally_judge(job->whole, job->scene, &job->verdict);
    if (status == BCD_OK && job->verdict.stop != BCD_STOP_NOT)
        job->chunks = job->goal;
    job->goal = bcd_scene_goal(job->scene, job->goal);
    if (job->goal > job->chunks)
        job->goal = job->chunks;
    tell(job);
    return status;
}

/* Puts a finished chunk's tally away and merges those whose turn has come. */
static enum bcd_status put_tally(struct job *job, int64_t chunk, const struct bcd_tally *tally,
                                 struct bcd_error *error)
{
    enum bcd_status status = BCD_OK;
    size_t size = bcd_tally_size(tally);
    void *bytes = malloc(size + 1);
    if (!bytes)
        return BCD_NO_MEMORY;
    bcd_tally_save(tally, bytes);
    pthread_mutex_lock(&job->mutex);
    job->waiting[chunk].bytes = bytes;
    job->waiting[chunk].size = size;
    while (status == BCD_OK && job->merged < job->chunks && job->waiting[job->merged].bytes) {
        int64_t turn = job->merged;
        status =
            bcd_tally_restore(job->part, job->waiting[turn].bytes, job->waiting[turn].size, error);
        if (status == BCD_OK)
            bcd_tally_merge(job->whole, job->part);
        free(job->waiting[turn].bytes);
        job->waiting[turn].bytes = NULL;
        job->merged++;
    }
    if (status == BCD_OK && job->merged == job->goal)
        status = judge_milestone(job);
    pthread_mutex_unlock(&job->mutex);
    return status;
}

/* Consecutive chunks in one worker's hands. */
struct share {
    int64_t first, count; /* count 0: there are none any more */
};

static enum bcd_status put_tallies(struct job *job, const struct share *share,
                                   const struct bcd_team *team, struct bcd_error *error)
{
    enum bcd_status status = BCD_OK;
    for (int64_t i = 0; status == BCD_OK && i < share->count; i++)
        status = put_tally(job, share->first + i, bcd_run_tally(bcd_team_run(team, i)), error);
    return status;
}

static void run_chunks(struct worker *worker, const struct share *share)
{
    struct job *job = worker->job;
    const struct bcd_team_wanted wanted = {
        .scene = job->scene, .first = share->first, .count = share->count};
    struct bcd_error error = {0};
    struct bcd_team *team = NULL;
    enum bcd_status status = bcd_team_create(&team, &wanted, &error);
    if (status == BCD_OK)
        status = advance(worker, team, &error);
    if (status == BCD_OK && bcd_team_ticks_done(team) == bcd_team_ticks_total(team)) {
        status = put_tallies(job, share, team, &error);
        atomic_fetch_add(&job->ticks, bcd_team_ticks_done(team));
    }
    atomic_store(&worker->motion->total, 0);
    bcd_team_free(team);
    if (status != BCD_OK)
        fail(job, status, &error);
}

/* Chunks that may be taken now: so many that all workers get their part. Under the mutex. */
static struct share chunks_at_hand(struct job *job)
{
    struct share share = {0};
    if (job->next < job->goal && !atomic_load(&job->stop)) {
        int64_t workers = (int64_t)job->wanted, left = job->goal - job->next;
        share = (struct share){.first = job->next, .count = job->team};
        while (share.count > 1 && share.count > (left + workers - 1) / workers)
            share.count /= 2;
        job->next += share.count;
    }
    return share;
}

/* Since when somebody helps. */
struct since {
    const struct job *job;
    unsigned news;
};

static bool news_since(void *context)
{
    const struct since *since = context;
    return atomic_load(&since->job->news) != since->news;
}

/* The next chunks, once a verdict is there if need be. Those who have none, and will have none
 * before others are done, help them meanwhile if they can. */
static struct share take_chunks(struct job *job)
{
    struct share share;
    pthread_mutex_lock(&job->mutex);
    while ((share = chunks_at_hand(job)).count == 0 && !atomic_load(&job->stop) &&
           (job->goal < job->chunks || (job->crew && job->running > 0))) {
        struct since since = {job, atomic_load(&job->news)};
        pthread_mutex_unlock(&job->mutex);
        bool helped = crew_help(job->crew, news_since, &since);
        pthread_mutex_lock(&job->mutex);
        if (!helped && !news_since(&since))
            pthread_cond_wait(&job->changed, &job->mutex);
    }
    job->running += share.count > 0;
    pthread_mutex_unlock(&job->mutex);
    return share;
}

static void *work(void *context)
{
    struct worker *worker = context;
    struct job *job = worker->job;
    for (struct share share; (share = take_chunks(job)).count > 0;) {
        run_chunks(worker, &share);
        pthread_mutex_lock(&job->mutex);
        job->running--;
        tell(job);
        pthread_mutex_unlock(&job->mutex);
    }
    atomic_fetch_add(&job->cpu_ns, clock_ns(CLOCK_THREAD_CPUTIME_ID));
    pthread_mutex_lock(&job->mutex);
    job->ended++;
    tell(job);
    pthread_mutex_unlock(&job->mutex);
    return NULL;
}

/* ---------------------------------------------------------------- progress */

static void show_progress(struct job *job, int64_t started_ns)
{
    char bar[BAR_WIDTH + 1], left[32] = "";
    pthread_mutex_lock(&job->mutex);
    double finished = (double)job->merged, chunks = (double)job->chunks;
    if (job->verdict.realizations > 0) /* what the last milestone makes one expect */
        chunks = fmin(chunks, fmax((double)job->goal, (double)job->merged *
                                                          job->verdict.expected /
                                                          (double)job->verdict.realizations));
    pthread_mutex_unlock(&job->mutex);
    double ticks = (double)atomic_load(&job->ticks);
    for (size_t i = 0; i < job->workers; i++) {
        double done = (double)atomic_load(&job->motion[i].done);
        double total = (double)atomic_load(&job->motion[i].total);
        if (total > 0) {
            ticks += done;
            finished += fmin(done / total, 1) * (double)atomic_load(&job->motion[i].chunks);
        }
    }
    double share = fmin(finished / chunks, 1);
    double seconds = (double)(clock_ns(CLOCK_MONOTONIC) - started_ns) * 1e-9;
    for (int i = 0; i < BAR_WIDTH; i++)
        bar[i] = i + 1 <= share * BAR_WIDTH ? '#' : '.';
    bar[BAR_WIDTH] = '\0';
    double rest = share > 0 ? seconds * (1 - share) / share : INFINITY;
    long long s = rest < 1e9 ? (long long)ceil(rest) : -1;
    if (s >= 86400)
        snprintf(left, sizeof left, ", %lld d %lld h left", s / 86400, s / 3600 % 24);
    else if (s >= 0)
        snprintf(left, sizeof left, ", %lld:%02lld:%02lld left", s / 3600, s / 60 % 60, s % 60);
    fprintf(stderr, "\r%s[%s] %5.1f %%, %.3g steps/s%s\033[K", job->label ? job->label : "", bar,
            100 * share, seconds > 0 ? ticks / seconds : 0, left);
    fflush(stderr);
}

/* Waits until all workers have ended; shows progress and takes signals meanwhile. Returns the
 * number of the signal that ended the job, or 0. */
static int watch(struct job *job, const sigset_t *signals, bool show)
{
    const struct timespec none = {0};
    int64_t started = clock_ns(CLOCK_MONOTONIC), shown = started;
    int ended_by = 0;
    pthread_mutex_lock(&job->mutex);
    while (job->ended < job->workers) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += SHOW_MS / 2 * 1000000L;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        pthread_cond_timedwait(&job->changed, &job->mutex, &until);
        pthread_mutex_unlock(&job->mutex);
        int number = sigtimedwait(signals, NULL, &none);
        if (show && clock_ns(CLOCK_MONOTONIC) - shown >= SHOW_MS * INT64_C(1000000)) {
            shown = clock_ns(CLOCK_MONOTONIC);
            show_progress(job, started);
        }
        pthread_mutex_lock(&job->mutex);
        if (number > 0) {
            ended_by = number;
            atomic_store(&job->stop, true);
            tell(job);
        }
    }
    pthread_mutex_unlock(&job->mutex);
    if (show && shown != started)
        fputs("\r\033[K", stderr);
    return ended_by;
}

/* --------------------------------------------------------------- beginning and end */

/* Starts the threads, all of them with the signals blocked; sets how many there are. */
static void start_workers(struct job *job, struct worker *workers)
{
    job->workers = 0;
    for (size_t i = 0; i < job->wanted; i++) {
        workers[i] = (struct worker){.job = job, .motion = &job->motion[i]};
        if (pthread_create(&workers[i].thread, NULL, work, &workers[i]) != 0)
            break;
        job->workers++;
    }
}

/* What ends a job; but what whoever started us wants ignored (nohup) stays ignored. */
static void choose_signals(sigset_t *signals)
{
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP};
    sigemptyset(signals);
    for (size_t i = 0; i < sizeof ending / sizeof *ending; i++) {
        struct sigaction action;
        if (sigaction(ending[i], NULL, &action) == 0 && action.sa_handler != SIG_IGN)
            sigaddset(signals, ending[i]);
    }
}

static int judge(const struct job *job, int ended_by)
{
    if (ended_by) {
        fprintf(stderr, "bcd: ended by %s, %lld of %lld chunks done\n", strsignal(ended_by),
                (long long)job->merged, (long long)job->chunks);
        return CLI_SIGNAL + ended_by;
    }
    if (job->error.code != BCD_OK) {
        const char *words = job->error.text[0] ? job->error.text : bcd_status_text(job->error.code);
        fprintf(stderr, "bcd: the job failed: %s%s%s\n", job->error.field,
                job->error.field[0] ? ": " : "", words);
        return CLI_FAILED;
    }
    if (job->merged < job->chunks) {
        fprintf(stderr, "bcd: no thread can be had\n");
        return CLI_FAILED;
    }
    return CLI_OK;
}
