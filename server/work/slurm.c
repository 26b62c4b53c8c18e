/* SPDX-License-Identifier: GPL-3.0-or-later
 * slurm.c - see slurm.h. No shell on this side: programs are started with their arguments. */
#include "slurm.h"

#include "log.h"
#include "slurm_file.h"
#include "text.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum {
    COMMAND_MS = 20000, /* a command that hangs is ended */
    ARGUMENTS_MAX = 24,
    HELD_MAX = 64,
    ARRAY_USUAL = 1001, /* MaxArraySize where Slurm does not say */
};

extern char **environ;

struct slurm {
    struct slurm_file file;
    struct leases *leases;
    char url[SLURM_TEXT_SIZE];
    long array_max;
    long alive;  /* pilots when they were counted last; -1 = not known */
    bool silent; /* the last command went wrong */
    pthread_t thread;
    pthread_mutex_t mutex; /* guards `stopping` */
    pthread_cond_t changed;
    bool stopping;
};

static int64_t now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* ------------------------------------------------------------------ commands */

/* What the command writes, until it ends or time is up; its status, -1 = it was ended. */
static int listen_to(pid_t pid, int from, struct text *out)
{
    int64_t until = now_ms() + COMMAND_MS;
    int status = -1;
    char bytes[4096];
    ssize_t size = 1;

    while (size > 0) {
        struct pollfd poll_from = {.fd = from, .events = POLLIN};
        int64_t left = until - now_ms();

        if (left <= 0 || poll(&poll_from, 1, (int)left) == 0)
            break;
        size = read(from, bytes, sizeof bytes);
        if (size > 0)
            text_add_bytes(out, bytes, (size_t)size);
        else if (size < 0 && errno == EINTR)
            size = 1;
    }
    while (waitpid(pid, &status, WNOHANG) == 0) {
        const struct timespec nap = {.tv_nsec = 10000000};

        if (now_ms() >= until)
            kill(pid, SIGKILL);
        nanosleep(&nap, NULL);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* A file in memory, for stdin; -1 = none can be had. */
static int file_of(const char *text)
{
    int fd = memfd_create("stdin", MFD_CLOEXEC);
    size_t size = strlen(text);

    if (fd >= 0 && (write(fd, text, size) != (ssize_t)size || lseek(fd, 0, SEEK_SET) != 0)) {
        close(fd);
        return -1;
    }
    return fd;
}

/* Starts it with signals as programs expect them; 0, or an errno. */
static int spawn(const char *const *arguments, int in, int out, pid_t *pid)
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none, usual;
    int code;

    sigemptyset(&none);
    sigemptyset(&usual);
    sigaddset(&usual, SIGPIPE);
    sigaddset(&usual, SIGXFSZ);
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    code =
        posix_spawnp(pid, arguments[0], &actions, &attributes, (char *const *)arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return code;
}

/* Runs a command of Slurm; its output (malloc'ed), NULL when it went wrong, which is told once. */
static char *ask(struct slurm *slurm, const char *command, const char **arguments, const char *in)
{
    char program[SLURM_TEXT_SIZE + 32];
    struct text out = {0};
    int pipes[2] = {-1, -1}, from = file_of(in), status = -1, code;
    pid_t pid;

    snprintf(program, sizeof program, "%s%s%s", slurm->file.bin, slurm->file.bin[0] ? "/" : "",
             command);
    arguments[0] = program;
    code =
        from >= 0 && pipe2(pipes, O_CLOEXEC) == 0 ? spawn(arguments, from, pipes[1], &pid) : errno;
    if (pipes[1] >= 0)
        close(pipes[1]);
    if (code == 0) {
        text_add(&out, "%s", "");
        status = listen_to(pid, pipes[0], &out);
    }
    if (pipes[0] >= 0)
        close(pipes[0]);
    if (from >= 0)
        close(from);
    char *said = text_take(&out);
    if (code != 0 || status != 0) {
        if (!slurm->silent)
            log_write(LOG_LEVEL_WARNING, "slurm_silent",
                      LOG_FIELDS(log_text("command", command), log_integer("status", status),
                                 log_integer("errno", code)));
        slurm->silent = true;
        free(said);
        return NULL;
    }
    return said;
}

/* ------------------------------------------------------------------- pilots */

/* Tasks that Slurm could not launch, and holds until somebody looks at them (their node died): they
 * go, for they would wait for ever. */
static void drop_held(struct slurm *slurm, char *const *ids, size_t count)
{
    const char *arguments[HELD_MAX + 2] = {NULL};
    char *said;

    for (size_t i = 0; i < count; i++)
        arguments[i + 1] = ids[i];
    said = ask(slurm, "scancel", arguments, "");
    if (said)
        log_write(LOG_LEVEL_WARNING, "slurm_held_dropped",
                  LOG_FIELDS(log_text("job", ids[0]), log_integer("pilots", (int64_t)count)));
    free(said);
}

/* Pilots that wait or run, also those of a daemon before this one; -1 = Slurm does not say. */
static long count_pilots(struct slurm *slurm)
{
    const char *arguments[] = {NULL,     "--noheader",     "--array",        "--me",
                               "--name", slurm->file.name, "--format=%i %r", NULL};
    char *said = ask(slurm, "squeue", arguments, ""), *rest = said, *line;
    char *held[HELD_MAX];
    size_t held_count = 0;
    long count = said ? 0 : -1;

    while (said && (line = strsep(&rest, "\n"))) {
        if (!*line)
            continue;
        if (!strstr(line, " launch failed requeued held")) {
            count++;
        } else if (held_count < HELD_MAX) {
            line[strcspn(line, " ")] = '\0';
            held[held_count++] = line;
        }
    }
    if (held_count > 0)
        drop_held(slurm, held, held_count);
    free(said);
    return count;
}

/* Tasks of one array. */
static long ask_array_max(struct slurm *slurm)
{
    const char *arguments[] = {NULL, "show", "config", NULL};
    char *said = ask(slurm, "scontrol", arguments, ""), *line;
    long max = 0;

    line = said ? strstr(said, "MaxArraySize") : NULL;
    if (line)
        max = strtol(line + strcspn(line, "0123456789\n"), NULL, 10);
    free(said);
    return max;
}

/* What a node runs. Values have no character that a shell would take for something else. */
static char *script_of(const struct slurm *slurm)
{
    const struct slurm_file *file = &slurm->file;
    struct text text = {0};

    text_add(&text, "#!/bin/sh\n");
    if (file->modules[0])
        text_add(&text, ". /etc/profile\nmodule load %s || exit 1\n", file->modules);
    text_add(&text, "exec %s worker --url %s --idle %ld", file->command, slurm->url, file->idle_s);
    if (file->token_file[0])
        text_add(&text, " --token-file %s", file->token_file);
    text_add(&text, " --name \"$(hostname):${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\"\n");
    return text_take(&text);
}

static void submit(struct slurm *slurm, long pilots)
{
    const struct slurm_file *file = &slurm->file;
    const struct {
        const char *option, *value;
    } wishes[] = {{"--account", file->account}, {"--partition", file->partition},
                  {"--qos", file->qos},         {"--constraint", file->constraint},
                  {"--time", file->time},       {"--mem", file->memory}};
    char array[48];
    const char *arguments[ARGUMENTS_MAX] = {NULL,
                                            "--parsable",
                                            "--requeue",
                                            "--signal=B:TERM@60",
                                            "--ntasks=1",
                                            "--cpus-per-task=1",
                                            "--output=/dev/null",
                                            "--job-name",
                                            file->name,
                                            array};
    size_t count = 10;
    char *script = script_of(slurm), *said = NULL;

    snprintf(array, sizeof array, "--array=0-%ld", pilots - 1);
    for (size_t i = 0; i < sizeof wishes / sizeof wishes[0]; i++) {
        if (!wishes[i].value[0])
            continue;
        arguments[count++] = wishes[i].option;
        arguments[count++] = wishes[i].value;
    }
    if (script)
        said = ask(slurm, "sbatch", arguments, script);
    if (said) {
        said[strcspn(said, ";\n")] = '\0';
        log_write(LOG_LEVEL_INFO, "slurm_pilots",
                  LOG_FIELDS(log_text("job", said), log_integer("pilots", pilots)));
    }
    free(script);
    free(said);
}

/* As many more pilots as there are chunks that nobody will come for. */
static void look(struct slurm *slurm)
{
    struct lease_counts counts;
    long alive, more;

    leases_count(slurm->leases, &counts);
    if (counts.offered == 0 && slurm->alive == 0)
        return;
    alive = count_pilots(slurm);
    slurm->alive = alive;
    if (alive >= 0 && slurm->array_max == 0)
        slurm->array_max = ask_array_max(slurm);
    if (alive < 0)
        return;
    slurm->silent = false;
    more = (long)(counts.offered + counts.held);
    if (more > slurm->file.pilots)
        more = slurm->file.pilots;
    more -= alive;
    if (more > (slurm->array_max > 0 ? slurm->array_max : ARRAY_USUAL))
        more = slurm->array_max > 0 ? slurm->array_max : ARRAY_USUAL;
    if (more > 0 && counts.offered > 0)
        submit(slurm, more);
}

static void *slurm_main(void *context)
{
    struct slurm *slurm = context;
    struct timespec until;

    pthread_mutex_lock(&slurm->mutex);
    while (!slurm->stopping) {
        int code = 0;

        pthread_mutex_unlock(&slurm->mutex);
        look(slurm);
        pthread_mutex_lock(&slurm->mutex);
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_sec += slurm->file.poll_s;
        while (code == 0 && !slurm->stopping)
            code = pthread_cond_timedwait(&slurm->changed, &slurm->mutex, &until);
    }
    pthread_mutex_unlock(&slurm->mutex);
    return NULL;
}

struct slurm *slurm_start(const char *path, struct leases *leases, const char *url, char *reason,
                          size_t size)
{
    struct slurm *slurm = calloc(1, sizeof *slurm);

    if (!slurm) {
        snprintf(reason, size, "out of memory");
        return NULL;
    }
    slurm->leases = leases;
    slurm->alive = -1; /* there may be some of a daemon before this one */
    pthread_mutex_init(&slurm->mutex, NULL);
    pthread_cond_init(&slurm->changed, NULL);
    if (!slurm_file_read(path, &slurm->file, reason, size))
        goto cleanup;
    snprintf(slurm->url, sizeof slurm->url, "%s", slurm->file.url[0] ? slurm->file.url : url);
    if (pthread_create(&slurm->thread, NULL, slurm_main, slurm) == 0)
        return slurm;
    snprintf(reason, size, "no thread can be had");
cleanup:
    pthread_cond_destroy(&slurm->changed);
    pthread_mutex_destroy(&slurm->mutex);
    free(slurm);
    return NULL;
}

void slurm_stop(struct slurm *slurm)
{
    if (!slurm)
        return;
    pthread_mutex_lock(&slurm->mutex);
    slurm->stopping = true;
    pthread_cond_signal(&slurm->changed);
    pthread_mutex_unlock(&slurm->mutex);
    pthread_join(slurm->thread, NULL);
    pthread_cond_destroy(&slurm->changed);
    pthread_mutex_destroy(&slurm->mutex);
    free(slurm);
}
