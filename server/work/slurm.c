/* SPDX-License-Identifier: GPL-3.0-or-later
 * slurm.c - see slurm.h. */
#include "slurm.h"

#include "log.h"
#include "slurm_command.h"
#include "slurm_file.h"
#include "slurm_pilots.h"
#include "text.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    ARGUMENTS_MAX = 24,
    ARRAYS_AT_ONCE = 8,
    ARRAY_USUAL = 1001,   /* MaxArraySize where Slurm does not say */
    PATIENCE_S_MAX = 600, /* between two tries where pilots fail */
    HUNGER_S = 10         /* who has nothing to do asks more often than that */
};

struct slurm {
    struct slurm_file file;
    struct leases *leases;
    char url[SLURM_TEXT_SIZE], share[SLURM_TEXT_SIZE];
    struct slurm_pilots *pilots;
    long array_max;  /* 0 = not known yet */
    bool accounting; /* sacct knows something */
    bool told;       /* that a command went wrong */
    long alive;      /* pilots when they were counted last; -1 = not known */
    int64_t granted; /* leases at the last look */
    int64_t fed_s;   /* when one was lent last, or there was nothing to lend */
    long dead;       /* pilots that Slurm takes for running */
    int64_t not_before_s, patience_s;
    pthread_t thread;
    pthread_mutex_t mutex; /* guards `counts`, and waiting for `stopping` */
    pthread_cond_t changed;
    atomic_bool stopping;
    struct slurm_counts counts;
};

static int64_t now_s(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec;
}

/* ------------------------------------------------------------------ commands */

/* A command of Slurm; its output (malloc'ed), NULL when it went wrong, which is told once. */
static char *ask(struct slurm *slurm, const char *program, const char **arguments, const char *in)
{
    char path[SLURM_TEXT_SIZE + 32];
    const struct slurm_command command = {.arguments = arguments,
                                          .in = in,
                                          .most_ms = slurm->file.timeout_s * 1000,
                                          .stopping = &slurm->stopping};
    int status;
    char *said;

    snprintf(path, sizeof path, "%s%s%s", slurm->file.bin, slurm->file.bin[0] ? "/" : "", program);
    arguments[0] = path;
    said = slurm_command_run(&command, &status);
    if (!said && !slurm->told && !atomic_load(&slurm->stopping)) {
        log_write(LOG_LEVEL_WARNING, "slurm_silent",
                  LOG_FIELDS(log_text("command", program), log_integer("status", status)));
        slurm->told = true;
    }
    pthread_mutex_lock(&slurm->mutex);
    slurm->counts.answers = said != NULL;
    pthread_mutex_unlock(&slurm->mutex);
    return said;
}

/* Tasks of one array, and whether there is accounting. */
static void ask_configuration(struct slurm *slurm)
{
    const char *arguments[] = {NULL, "show", "config", NULL};
    char *said = ask(slurm, "scontrol", arguments, ""), *line;

    if (said && (line = strstr(said, "MaxArraySize")))
        slurm->array_max = strtol(line + strcspn(line, "0123456789\n"), NULL, 10);
    if (said && slurm->array_max < 1)
        slurm->array_max = 1;
    if (said && (line = strstr(said, "AccountingStorageType"))) {
        line[strcspn(line, "\n")] = '\0';
        slurm->accounting = !strstr(line, "accounting_storage/none") && !strstr(line, "(null)");
    }
    free(said);
}

/* ------------------------------------------------------------------- pilots */

/* Tasks that wait for ever, or for too long. */
static void drop(struct slurm *slurm, const struct pilots_some *some)
{
    const char *arguments[PILOTS_SOME_MAX + 2] = {NULL};
    char *said;

    if (some->count == 0)
        return;
    for (size_t i = 0; i < some->count; i++)
        arguments[i + 1] = some->id[i];
    said = ask(slurm, "scancel", arguments, "");
    if (said)
        log_write(
            LOG_LEVEL_WARNING, "slurm_held_dropped",
            LOG_FIELDS(log_text("job", some->id[0]), log_integer("pilots", (int64_t)some->count)));
    free(said);
}

/* Ends that squeue did not live to tell. */
static void ask_accounting(struct slurm *slurm, struct pilots_ended *ended)
{
    char jobs[512], *said;
    const char *arguments[] = {NULL,     "--noheader", "--parsable2",          "--allocations",
                               "--jobs", jobs,         "--format=JobID,State", NULL};

    if (!slurm_pilots_missing(slurm->pilots, jobs, sizeof jobs))
        return;
    if (slurm->accounting) {
        said = ask(slurm, "sacct", arguments, "");
        if (!said)
            return; /* another time */
        slurm_pilots_accounted(slurm->pilots, said, ended);
        free(said);
    }
    slurm_pilots_forget(slurm->pilots);
}

/* The next ones are asked for later and later. */
static void be_patient(struct slurm *slurm)
{
    slurm->patience_s = slurm->patience_s > 0 ? 2 * slurm->patience_s : slurm->file.poll_s;
    if (slurm->patience_s > PATIENCE_S_MAX)
        slurm->patience_s = PATIENCE_S_MAX;
    slurm->not_before_s = now_s() + slurm->patience_s;
}

/* Pilots that fail would fail again; until they do not, and are lent something. */
static void note_ended(struct slurm *slurm, const struct pilots_ended *ended, int64_t granted)
{
    if (ended->badly > 0) {
        be_patient(slurm);
        log_write(LOG_LEVEL_WARNING, "slurm_pilots_failed",
                  LOG_FIELDS(log_text("job", ended->worst), log_text("state", ended->state),
                             log_integer("pilots", ended->badly),
                             log_integer("wait_seconds", slurm->patience_s)));
    } else if (granted > slurm->granted) {
        slurm->patience_s = slurm->not_before_s = 0;
    }
    slurm->granted = granted;
}

/* One question for all of them, also those of a daemon before this one. False = Slurm does not
 * say. */
static bool see(struct slurm *slurm, struct pilots_seen *seen, int64_t granted)
{
    const char *arguments[] = {NULL,     "--noheader",     "--array",      "--me",
                               "--name", slurm->file.name, "--states=all", "--format=%i %T %r",
                               NULL};
    char *said = ask(slurm, "squeue", arguments, "");
    struct pilots_ended ended = {0};

    if (!said)
        return false;
    slurm_pilots_queue(slurm->pilots, said, seen, &ended);
    free(said);
    if (slurm->array_max == 0)
        ask_configuration(slurm);
    ask_accounting(slurm, &ended);
    drop(slurm, &seen->held);
    note_ended(slurm, &ended, granted);
    pthread_mutex_lock(&slurm->mutex);
    slurm->counts.waiting = seen->waiting + (long)seen->late.count;
    slurm->counts.running = seen->running;
    slurm->counts.failed += ended.badly;
    pthread_mutex_unlock(&slurm->mutex);
    return true;
}

/* What a node runs. Values have no character that a shell would take for something else. */
static char *script_of(const struct slurm *slurm)
{
    const struct slurm_file *file = &slurm->file;
    struct text text = {0};

    text_add(&text, "#!/bin/sh\n");
    if (file->modules[0])
        text_add(&text, ". /etc/profile\nmodule load %s || exit 1\n", file->modules);
    text_add(&text, "exec %s worker --idle %ld", file->command, file->idle_s);
    if (slurm->share[0])
        text_add(&text, " --share %s", slurm->share);
    else
        text_add(&text, " --url %s", slurm->url);
    if (file->token_file[0] && !slurm->share[0])
        text_add(&text, " --token-file %s", file->token_file);
    text_add(&text, " --name \"$(hostname):${SLURM_ARRAY_JOB_ID:-$SLURM_JOB_ID}"
                    "_${SLURM_ARRAY_TASK_ID:-0}\"\n");
    return text_take(&text);
}

/* One array. False = it was not taken. */
static bool submit(struct slurm *slurm, long tasks)
{
    const struct slurm_file *file = &slurm->file;
    const struct {
        const char *option, *value;
    } wishes[] = {{"--account", file->account}, {"--partition", file->partition},
                  {"--qos", file->qos},         {"--constraint", file->constraint},
                  {"--time", file->time},       {"--mem", file->memory}};
    char array[48];
    const char *arguments[ARGUMENTS_MAX] = {
        NULL,         "--parsable",        "--requeue",          "--signal=B:TERM@60",
        "--ntasks=1", "--cpus-per-task=1", "--output=/dev/null", "--job-name",
        file->name};
    size_t count = 9;
    char *script = script_of(slurm), *said = NULL;
    bool taken;

    snprintf(array, sizeof array, "--array=0-%ld", tasks - 1);
    if (slurm->array_max > 1) /* else there are no arrays */
        arguments[count++] = array;
    for (size_t i = 0; i < sizeof wishes / sizeof wishes[0]; i++) {
        if (!wishes[i].value[0])
            continue;
        arguments[count++] = wishes[i].option;
        arguments[count++] = wishes[i].value;
    }
    if (script)
        said = ask(slurm, "sbatch", arguments, script);
    taken = said && slurm_pilots_submitted(slurm->pilots, said, tasks);
    if (taken) {
        said[strcspn(said, ";\n")] = '\0';
        log_write(LOG_LEVEL_INFO, "slurm_pilots",
                  LOG_FIELDS(log_text("job", said), log_integer("pilots", tasks)));
        pthread_mutex_lock(&slurm->mutex);
        slurm->counts.submitted += tasks;
        pthread_mutex_unlock(&slurm->mutex);
    }
    free(script);
    free(said);
    return taken;
}

/* Pilots that have a chunk or will come for one. Slurm takes those of a dead node for running until
 * it has waited for it long enough: running ones that have none while chunks are left lying are
 * counted out, until they have one, or Slurm sees it too. */
static long coming(struct slurm *slurm, const struct lease_counts *counts,
                   const struct pilots_seen *seen)
{
    long idle = seen->running - (long)counts->held;

    idle = idle > 0 ? idle : 0;
    if (now_s() - slurm->fed_s >= HUNGER_S || slurm->dead > idle)
        slurm->dead = idle;
    return seen->waiting + seen->running - slurm->dead;
}

/* As many more pilots as there are chunks that nobody will come for. */
static void look(struct slurm *slurm)
{
    struct lease_counts counts;
    struct pilots_seen seen;
    long more, most;

    leases_count(slurm->leases, &counts);
    if (counts.offered == 0 || counts.granted > slurm->granted)
        slurm->fed_s = now_s();
    if (counts.offered == 0 && slurm->alive == 0)
        return;
    slurm->alive = -1;
    if (!see(slurm, &seen, counts.granted))
        return;
    slurm->told = false;
    slurm->alive = seen.waiting + seen.running + (long)seen.late.count;
    more = (long)(counts.offered + counts.held) - coming(slurm, &counts, &seen);
    most = slurm->file.pilots - slurm->alive;
    if (counts.offered == 0 || now_s() < slurm->not_before_s)
        return;
    if (more > most && seen.late.count > 0) { /* they are in the way */
        drop(slurm, &seen.late);
        most += (long)seen.late.count;
    }
    more = more < most ? more : most;
    most = slurm->array_max > 0 ? slurm->array_max : ARRAY_USUAL;
    for (int i = 0; i < ARRAYS_AT_ONCE && more > 0; i++, more -= most) {
        slurm->fed_s = now_s(); /* they will come */
        if (!submit(slurm, more < most ? more : most)) {
            be_patient(slurm);
            break;
        }
    }
}

/* --------------------------------------------------------------------- thread */

static void *slurm_main(void *context)
{
    struct slurm *slurm = context;
    struct timespec until;

    while (!atomic_load(&slurm->stopping)) {
        int code = 0;

        look(slurm);
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_sec += slurm->file.poll_s;
        pthread_mutex_lock(&slurm->mutex);
        while (code == 0 && !atomic_load(&slurm->stopping))
            code = pthread_cond_timedwait(&slurm->changed, &slurm->mutex, &until);
        pthread_mutex_unlock(&slurm->mutex);
    }
    return NULL;
}

static void slurm_free(struct slurm *slurm)
{
    pthread_cond_destroy(&slurm->changed);
    pthread_mutex_destroy(&slurm->mutex);
    slurm_pilots_free(slurm->pilots);
    free(slurm);
}

static void expect_pilots(const struct slurm *slurm, size_t chunks)
{
    size_t pilots = (size_t)slurm->file.pilots;

    leases_expect(slurm->leases, pilots);
    if (pilots > chunks)
        log_write(LOG_LEVEL_WARNING, "slurm_pilots_too_many",
                  LOG_FIELDS(log_integer("pilots", (int64_t)pilots),
                             log_integer("workers", (int64_t)chunks)));
}

struct slurm *slurm_start(const char *path, struct leases *leases, const struct slurm_way *way,
                          char *reason, size_t size)
{
    struct slurm *slurm = calloc(1, sizeof *slurm);

    if (!slurm) {
        snprintf(reason, size, "out of memory");
        return NULL;
    }
    slurm->leases = leases;
    slurm->alive = -1; /* there may be some of a daemon before this one */
    slurm->fed_s = now_s();
    slurm->counts.answers = true;
    slurm->pilots = slurm_pilots_create();
    pthread_mutex_init(&slurm->mutex, NULL);
    pthread_cond_init(&slurm->changed, NULL);
    if (!slurm->pilots) {
        snprintf(reason, size, "out of memory");
    } else if (!slurm_file_read(path, &slurm->file, reason, size)) {
        /* it has said why */
    } else if (way->share && !slurm_file_harmless(way->share)) {
        snprintf(reason, size, "nodes cannot be told of a directory of this name: %s", way->share);
    } else {
        snprintf(slurm->url, sizeof slurm->url, "%s",
                 slurm->file.url[0] ? slurm->file.url : way->url);
        snprintf(slurm->share, sizeof slurm->share, "%s", way->share ? way->share : "");
        expect_pilots(slurm, way->chunks);
        if (pthread_create(&slurm->thread, NULL, slurm_main, slurm) == 0)
            return slurm;
        snprintf(reason, size, "no thread can be had");
    }
    slurm_free(slurm);
    return NULL;
}

void slurm_stop(struct slurm *slurm)
{
    if (!slurm)
        return;
    pthread_mutex_lock(&slurm->mutex);
    atomic_store(&slurm->stopping, true);
    pthread_cond_signal(&slurm->changed);
    pthread_mutex_unlock(&slurm->mutex);
    pthread_join(slurm->thread, NULL);
    slurm_free(slurm);
}

void slurm_count(struct slurm *slurm, struct slurm_counts *counts)
{
    pthread_mutex_lock(&slurm->mutex);
    *counts = slurm->counts;
    pthread_mutex_unlock(&slurm->mutex);
}
