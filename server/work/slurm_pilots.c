/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "slurm_pilots.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ARRAYS_MAX = 32, TASKS_MAX = 16384 };

/* Tasks of one sbatch. */
struct array {
    long job, tasks, told; /* how many ends were told */
    unsigned char *task;   /* of each: */
};
enum { TASK_SEEN = 1, TASK_TOLD = 2 };

struct slurm_pilots {
    struct array arrays[ARRAYS_MAX]; /* the newest last */
    size_t count;
};

struct slurm_pilots *slurm_pilots_create(void)
{
    return calloc(1, sizeof(struct slurm_pilots));
}

void slurm_pilots_free(struct slurm_pilots *pilots)
{
    for (size_t i = 0; pilots && i < pilots->count; i++)
        free(pilots->arrays[i].task);
    free(pilots);
}

static void remove_array(struct slurm_pilots *pilots, size_t i)
{
    free(pilots->arrays[i].task);
    pilots->count--;
    memmove(&pilots->arrays[i], &pilots->arrays[i + 1],
            (pilots->count - i) * sizeof *pilots->arrays);
}

bool slurm_pilots_submitted(struct slurm_pilots *pilots, const char *said, long tasks)
{
    char *end;
    struct array made = {.job = strtol(said, &end, 10), .tasks = tasks};

    if (end == said || made.job <= 0 || tasks < 1 || tasks > TASKS_MAX)
        return false;
    made.task = calloc((size_t)tasks, 1);
    if (made.task) { /* else their ends are not news */
        if (pilots->count == ARRAYS_MAX)
            remove_array(pilots, 0);
        pilots->arrays[pilots->count++] = made;
    }
    return true;
}

/* The place of "12_3", or "12", in what was submitted; NULL = not by us. */
static unsigned char *find(struct slurm_pilots *pilots, const char *id, struct array **array)
{
    char *end;
    long job = strtol(id, &end, 10), task = *end == '_' ? strtol(end + 1, NULL, 10) : 0;

    for (size_t i = 0; i < pilots->count; i++)
        if (pilots->arrays[i].job == job && task >= 0 && task < pilots->arrays[i].tasks) {
            *array = &pilots->arrays[i];
            return &pilots->arrays[i].task[task];
        }
    return NULL;
}

static bool begins(const char *text, const char *with)
{
    return strncmp(text, with, strlen(with)) == 0;
}

/* Slurm's words for jobs that will not go on. Whoever is stopped from outside has done no wrong. */
static bool has_ended(const char *state, bool *badly)
{
    static const char *const wells[] = {"COMPLETED", "CANCELLED", "TIMEOUT", "DEADLINE",
                                        "PREEMPTED", "NODE_FAIL", "REVOKED"};
    static const char *const bad[] = {"FAILED", "OUT_OF_MEMORY", "BOOT_FAIL", "LAUNCH_FAILED"};

    *badly = false;
    for (size_t i = 0; i < sizeof wells / sizeof *wells; i++)
        if (begins(state, wells[i]))
            return true;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (begins(state, bad[i]))
            *badly = true;
    return *badly;
}

static void note_end(struct slurm_pilots *pilots, const char *id, const char *state, bool badly,
                     struct pilots_ended *ended)
{
    struct array *array;
    unsigned char *task = find(pilots, id, &array);

    if (!task || *task & TASK_TOLD)
        return;
    *task |= TASK_TOLD;
    array->told++;
    ended->well += !badly;
    ended->badly += badly;
    if (badly) {
        snprintf(ended->worst, sizeof ended->worst, "%s", id);
        snprintf(ended->state, sizeof ended->state, "%.*s", (int)strcspn(state, " |\n"), state);
    }
}

static void remove_ended(struct slurm_pilots *pilots)
{
    for (size_t i = pilots->count; i-- > 0;)
        if (pilots->arrays[i].told == pilots->arrays[i].tasks)
            remove_array(pilots, i);
}

static void note(struct pilots_some *some, const char *id)
{
    if (some->count < PILOTS_SOME_MAX)
        snprintf(some->id[some->count++], sizeof some->id[0], "%s", id);
}

void slurm_pilots_queue(struct slurm_pilots *pilots, char *said, struct pilots_seen *seen,
                        struct pilots_ended *ended)
{
    char *line;

    *seen = (struct pilots_seen){0};
    for (size_t i = 0; i < pilots->count; i++)
        for (long k = 0; k < pilots->arrays[i].tasks; k++)
            pilots->arrays[i].task[k] &= (unsigned char)~TASK_SEEN;
    while ((line = strsep(&said, "\n"))) {
        char *id = strsep(&line, " "), *state = line ? strsep(&line, " ") : NULL;
        const char *why = line ? line : "";
        struct array *array;
        unsigned char *task;
        bool badly;

        if (!state || !*id)
            continue;
        if ((task = find(pilots, id, &array)))
            *task |= TASK_SEEN;
        if (has_ended(state, &badly))
            note_end(pilots, id, state, badly, ended);
        else if (begins(why, "launch failed requeued held"))
            note(&seen->held, id);
        else if (begins(state, "PENDING") && begins(why, "BeginTime"))
            note(&seen->late, id);
        else if (begins(state, "PENDING") || begins(state, "REQUEUED"))
            seen->waiting++;
        else
            seen->running++;
    }
    remove_ended(pilots);
}

static bool is_missing(const struct array *array)
{
    for (long k = 0; k < array->tasks; k++)
        if (!array->task[k])
            return true;
    return false;
}

bool slurm_pilots_missing(const struct slurm_pilots *pilots, char *jobs, size_t size)
{
    size_t length = 0;

    jobs[0] = '\0';
    for (size_t i = 0; i < pilots->count && length + 24 < size; i++)
        if (is_missing(&pilots->arrays[i]))
            length += (size_t)snprintf(jobs + length, size - length, "%s%ld", length ? "," : "",
                                       pilots->arrays[i].job);
    return length > 0;
}

void slurm_pilots_accounted(struct slurm_pilots *pilots, char *said, struct pilots_ended *ended)
{
    char *line;

    while ((line = strsep(&said, "\n"))) {
        char *id = strsep(&line, "|");
        bool badly;

        if (line && has_ended(line, &badly))
            note_end(pilots, id, line, badly, ended);
    }
    remove_ended(pilots);
}

void slurm_pilots_forget(struct slurm_pilots *pilots)
{
    for (size_t i = 0; i < pilots->count; i++)
        for (long k = 0; k < pilots->arrays[i].tasks; k++)
            if (!pilots->arrays[i].task[k]) {
                pilots->arrays[i].task[k] = TASK_TOLD;
                pilots->arrays[i].told++;
            }
    remove_ended(pilots);
}
