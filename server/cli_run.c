/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd run and bcd check: a job without the daemon. Besides worker.c the only file that moves runs.
 *
 * THREADS  Workers take chunks by number from a counter; each owns its run alone. Finished tallies
 *          are merged under `mutex` in the order of the chunks, as bytes and in the same steps as
 *          in the daemon, so that the result depends on neither workers nor chance. The main
 *          thread shows progress and takes the signals, which are blocked in all threads.
 */
#include "caption.h"
#include "cli.h"
#include "limits.h"
#include "plot_svg.h"
#include "record_json.h"
#include "scene_json.h"
#include "table_csv.h"
#include "table_json.h"
#include "text.h"

#include <errno.h>
#include <getopt.h>
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

struct options {
    const char *path, *csv, *svg;
    bool record, quiet, help;
    int64_t workers;
};

/* One worker's chunk in motion, for the progress bar. */
struct motion {
    _Atomic int64_t done, total; /* ticks; total 0 = none in motion */
};

struct job {
    const struct bcd_scene *scene;
    int64_t chunks;
    _Atomic int64_t next;  /* first chunk that nobody took */
    atomic_bool stop;      /* a signal, or a worker that failed */
    _Atomic int64_t ticks; /* of finished chunks */
    struct motion *motion; /* [workers] */
    size_t workers;
    pthread_mutex_t mutex;  /* guards what follows */
    pthread_cond_t changed; /* a worker ended */
    size_t ended;
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

static int parse_options(const struct cli_command *self, int argc, char **argv,
                         struct options *options);
static int find_observable(const struct cli_command *self, const struct bcd_scene *scene,
                           const char *name);
static int run_job(const struct bcd_scene *scene, const struct options *options,
                   struct bcd_tally **tally);
static int print_results(const struct bcd_scene *scene, const struct bcd_tally *tally,
                         const struct options *options);

int cli_run(const struct cli_command *self, int argc, char **argv)
{
    struct options options;
    struct bcd_scene *scene = NULL;
    struct bcd_tally *tally = NULL;
    int status = parse_options(self, argc, argv, &options);
    if (status != CLI_OK)
        return status;
    if (options.help)
        return cli_help(self);
    status = cli_load_job(options.path, &scene);
    if (status == CLI_OK && options.csv)
        status = find_observable(self, scene, options.csv);
    if (status == CLI_OK && options.svg)
        status = find_observable(self, scene, options.svg);
    if (status == CLI_OK)
        status = run_job(scene, &options, &tally);
    if (status == CLI_OK)
        status = print_results(scene, tally, &options);
    bcd_tally_free(tally);
    bcd_scene_free(scene);
    return status;
}

int cli_check(const struct cli_command *self, int argc, char **argv)
{
    struct bcd_scene *scene = NULL;
    struct bcd_estimate estimate;
    struct text text = {0};
    if (argc == 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0))
        return cli_help(self);
    if (argc != 2 || (argv[1][0] == '-' && argv[1][1] != '\0'))
        return cli_wrong(self, "one file with a job is needed");
    int status = cli_load_job(argv[1], &scene);
    if (status != CLI_OK)
        return status;
    bcd_scene_estimate(scene, &estimate);
    char *pieces[] = {scene_json_job(scene), scene_json_derived(scene),
                      record_json_estimate(&estimate, bcd_scene_chunks(scene))};
    if (pieces[0] && pieces[1] && pieces[2])
        text_add(&text, "{\"job\":%s,\n\"derived\":%s,\n\"estimate\":%.*s}\n", pieces[0], pieces[1],
                 (int)strcspn(pieces[2], "\n"), pieces[2]);
    else
        text.failed = true;
    for (size_t i = 0; i < 3; i++)
        free(pieces[i]);
    bcd_scene_free(scene);
    return cli_print_take(text_take(&text));
}

/* ----------------------------------------------------------------- options */

static int64_t cores(void)
{
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

static int parse_options(const struct cli_command *self, int argc, char **argv,
                         struct options *options)
{
    static const struct option names[] = {
        {"workers", required_argument, NULL, 'w'},
        {"csv", required_argument, NULL, 'c'},
        {"svg", required_argument, NULL, 's'},
        {"record", no_argument, NULL, 'r'},
        {"quiet", no_argument, NULL, 'q'},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    int c;
    *options = (struct options){.workers = cores()};
    opterr = 0;
    while ((c = getopt_long(argc, argv, ":hq", names, NULL)) != -1) {
        switch (c) {
        case 'w':
            if (!cli_parse_integer(optarg, 1, LIMIT_WORKERS_MAX, &options->workers))
                return cli_wrong(self, "--workers must be 1 to %d, not \"%s\"", LIMIT_WORKERS_MAX,
                                 optarg);
            break;
        case 'c':
            options->csv = optarg;
            break;
        case 's':
            options->svg = optarg;
            break;
        case 'r':
            options->record = true;
            break;
        case 'q':
            options->quiet = true;
            break;
        case 'h':
            options->help = true;
            return CLI_OK;
        default:
            return cli_wrong(self, c == ':' ? "%s needs a value" : "%s is no option",
                             argv[optind - 1]);
        }
    }
    if (optind + 1 != argc)
        return cli_wrong(self, "one file with a job is needed");
    if ((options->csv != NULL) + (options->svg != NULL) + options->record > 1)
        return cli_wrong(self, "--csv, --svg and --record exclude one another");
    options->path = argv[optind];
    return CLI_OK;
}

static int find_observable(const struct cli_command *self, const struct bcd_scene *scene,
                           const char *name)
{
    const struct bcd_group *part;
    struct text names = {0};
    for (size_t i = 0; (part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i)) != NULL; i++) {
        if (strcmp(part->type, name) == 0) {
            free(text_take(&names));
            return CLI_OK;
        }
        text_add(&names, "%s%s", i ? ", " : "", part->type);
    }
    char *list = text_take(&names);
    int status = cli_wrong(self, "the job does not ask for \"%s\", but for %s", name,
                           list ? list : "others");
    free(list);
    return status;
}

/* ----------------------------------------------------------------- workers */

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void fail(struct job *job, enum bcd_status code, const struct bcd_error *error)
{
    pthread_mutex_lock(&job->mutex);
    if (job->error.code == BCD_OK) {
        if (error)
            job->error = *error;
        job->error.code = code;
    }
    pthread_mutex_unlock(&job->mutex);
    atomic_store(&job->stop, true);
}

/* Advances the run to its end, in slices of about LIMIT_SLICE_MS; false when told to stop. */
static bool advance(struct worker *worker, struct bcd_run *run)
{
    int64_t total = bcd_run_ticks_total(run), slice = 1;
    atomic_store(&worker->motion->done, 0);
    atomic_store(&worker->motion->total, total);
    while (bcd_run_ticks_done(run) < total) {
        if (atomic_load(&worker->job->stop))
            return false;
        int64_t before = now_ns();
        bcd_run_advance(run, slice);
        double share = (double)(now_ns() - before) / (LIMIT_SLICE_MS * 1e6);
        double factor = fmin(1 / fmax(share, 1e-9), SLICE_GROWTH_MAX);
        slice = (int64_t)fmin(fmax((double)slice * factor, 1), 1e15);
        atomic_store(&worker->motion->done, bcd_run_ticks_done(run));
    }
    return true;
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
    pthread_mutex_unlock(&job->mutex);
    return status;
}

static void run_chunk(struct worker *worker, int64_t chunk)
{
    struct job *job = worker->job;
    struct bcd_error error = {0};
    struct bcd_run *run = NULL;
    enum bcd_status status = bcd_run_create(&run, job->scene, chunk, &error);
    if (status == BCD_OK && advance(worker, run)) {
        status = put_tally(job, chunk, bcd_run_tally(run), &error);
        atomic_fetch_add(&job->ticks, bcd_run_ticks_done(run));
    }
    atomic_store(&worker->motion->total, 0);
    bcd_run_free(run);
    if (status != BCD_OK)
        fail(job, status, &error);
}

static void *work(void *context)
{
    struct worker *worker = context;
    struct job *job = worker->job;
    while (!atomic_load(&job->stop)) {
        int64_t chunk = atomic_fetch_add(&job->next, 1);
        if (chunk >= job->chunks)
            break;
        run_chunk(worker, chunk);
    }
    pthread_mutex_lock(&job->mutex);
    job->ended++;
    pthread_cond_signal(&job->changed);
    pthread_mutex_unlock(&job->mutex);
    return NULL;
}

/* ---------------------------------------------------------------- progress */

static void show_progress(struct job *job, int64_t started_ns)
{
    char bar[BAR_WIDTH + 1], left[32] = "";
    pthread_mutex_lock(&job->mutex);
    double finished = (double)job->merged;
    pthread_mutex_unlock(&job->mutex);
    double ticks = (double)atomic_load(&job->ticks);
    for (size_t i = 0; i < job->workers; i++) {
        double done = (double)atomic_load(&job->motion[i].done);
        double total = (double)atomic_load(&job->motion[i].total);
        if (total > 0) {
            ticks += done;
            finished += fmin(done / total, 1);
        }
    }
    double share = fmin(finished / (double)job->chunks, 1);
    double seconds = (double)(now_ns() - started_ns) * 1e-9;
    for (int i = 0; i < BAR_WIDTH; i++)
        bar[i] = i + 1 <= share * BAR_WIDTH ? '#' : '.';
    bar[BAR_WIDTH] = '\0';
    double rest = share > 0 ? seconds * (1 - share) / share : INFINITY;
    long long s = rest < 1e9 ? (long long)ceil(rest) : -1;
    if (s >= 86400)
        snprintf(left, sizeof left, ", %lld d %lld h left", s / 86400, s / 3600 % 24);
    else if (s >= 0)
        snprintf(left, sizeof left, ", %lld:%02lld:%02lld left", s / 3600, s / 60 % 60, s % 60);
    fprintf(stderr, "\r[%s] %5.1f %%, %.3g steps/s%s\033[K", bar, 100 * share,
            seconds > 0 ? ticks / seconds : 0, left);
    fflush(stderr);
}

/* Waits until all workers have ended; shows progress and takes signals meanwhile. Returns the
 * number of the signal that ended the job, or 0. */
static int watch(struct job *job, const sigset_t *signals, bool show)
{
    const struct timespec none = {0};
    int64_t started = now_ns(), shown = started;
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
        if (number > 0) {
            ended_by = number;
            atomic_store(&job->stop, true);
        }
        if (show && now_ns() - shown >= SHOW_MS * INT64_C(1000000)) {
            shown = now_ns();
            show_progress(job, started);
        }
        pthread_mutex_lock(&job->mutex);
    }
    pthread_mutex_unlock(&job->mutex);
    if (show && shown != started)
        fputs("\r\033[K", stderr);
    return ended_by;
}

/* --------------------------------------------------------------------- job */

/* Starts up to job->workers threads, all of them with the signals blocked; sets how many there are.
 */
static void start_workers(struct job *job, struct worker *workers)
{
    size_t wanted = job->workers;
    job->workers = 0;
    for (size_t i = 0; i < wanted; i++) {
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

static int run_job(const struct bcd_scene *scene, const struct options *options,
                   struct bcd_tally **tally)
{
    struct job job = {.scene = scene,
                      .chunks = bcd_scene_chunks(scene),
                      .mutex = PTHREAD_MUTEX_INITIALIZER,
                      .changed = PTHREAD_COND_INITIALIZER};
    sigset_t signals, before;
    choose_signals(&signals);
    job.workers = (size_t)(options->workers < job.chunks ? options->workers : job.chunks);
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
    ended_by = watch(&job, &signals, !options->quiet && isatty(STDERR_FILENO));
    for (size_t i = 0; i < job.workers; i++)
        pthread_join(workers[i].thread, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    status = judge(&job, ended_by);
    if (status == CLI_OK) {
        *tally = job.whole;
        job.whole = NULL;
    }
cleanup:
    for (int64_t i = 0; job.waiting && i < job.chunks; i++)
        free(job.waiting[i].bytes);
    free(job.waiting);
    free(job.motion);
    free(workers);
    bcd_tally_free(job.whole);
    bcd_tally_free(job.part);
    return status;
}

/* ----------------------------------------------------------------- results */

static char *print_named(const struct bcd_scene *scene, const struct bcd_table *table,
                         const struct options *options)
{
    if (options->csv)
        return table_csv_print(table);
    char *caption = caption_print(scene);
    char *svg = caption ? plot_svg_print(table, table->name, caption) : NULL;
    free(caption);
    return svg;
}

static char *print_record(const struct bcd_scene *scene, const char *results)
{
    struct text text = {0};
    char *job = scene_json_job(scene), *derived = scene_json_derived(scene);
    if (results && job && derived)
        text_add(&text, "{\"job\":%s,\n\"derived\":%s,\n\"results\":%.*s}\n", job, derived,
                 (int)strcspn(results, "\n"), results);
    else
        text.failed = true;
    free(job);
    free(derived);
    return text_take(&text);
}

static int print_results(const struct bcd_scene *scene, const struct bcd_tally *tally,
                         const struct options *options)
{
    const char *name = options->csv ? options->csv : options->svg;
    const struct bcd_group *part;
    size_t count = 0;
    while (bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, count))
        count++;
    struct bcd_table **tables = calloc(count + 1, sizeof *tables);
    struct bcd_theory *theory = NULL;
    enum bcd_status status = tables ? bcd_theory_create(&theory, scene) : BCD_NO_MEMORY;
    char *text = NULL;
    for (size_t i = 0; status == BCD_OK && i < count; i++) {
        status = bcd_tally_table(tally, scene, theory, i, &tables[i]);
        part = bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i);
        if (status == BCD_OK && name && strcmp(part->type, name) == 0)
            text = print_named(scene, tables[i], options);
    }
    if (status == BCD_OK && !name)
        text = table_json_print_all(tables, count);
    if (status == BCD_OK && options->record) {
        char *results = text;
        text = print_record(scene, results);
        free(results);
    }
    for (size_t i = 0; tables && i < count; i++)
        bcd_table_free(tables[i]);
    free(tables);
    bcd_theory_free(theory);
    if (status == BCD_OK)
        return cli_print_take(text);
    fprintf(stderr, "bcd: the results cannot be had: %s\n", bcd_status_text(status));
    free(text);
    return CLI_FAILED;
}
