/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "slurm_command.h"

#include "text.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { LOOK_MS = 50 }; /* at the clock and at `stopping` */

extern char **environ;

static int64_t now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
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

/* Starts it with signals as programs expect them, and in a group of its own, so that what it starts
 * can be ended with it; 0, or an errno. */
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
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF |
                                              POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    code =
        posix_spawnp(pid, arguments[0], &actions, &attributes, (char *const *)arguments, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return code;
}

static bool is_over(const struct slurm_command *command, int64_t until)
{
    return now_ms() >= until || (command->stopping && atomic_load(command->stopping));
}

/* What it writes, to the end; false = time is up. */
static bool listen_to(const struct slurm_command *command, int64_t until, int from,
                      struct text *out)
{
    char bytes[4096];

    while (!is_over(command, until)) {
        struct pollfd poll_from = {.fd = from, .events = POLLIN};

        if (poll(&poll_from, 1, LOOK_MS) <= 0)
            continue;
        ssize_t size = read(from, bytes, sizeof bytes);
        if (size == 0)
            return true;
        if (size > 0 && out->size < SLURM_ANSWER_BYTES_MAX)
            text_add_bytes(out, bytes, (size_t)size);
    }
    return false;
}

/* One that closed its stdout may still run. */
static int wait_for(const struct slurm_command *command, int64_t until, pid_t pid, bool killed)
{
    const struct timespec nap = {.tv_nsec = 2000000};
    int status = -1;

    for (;;) {
        if (killed || is_over(command, until)) {
            kill(-pid, SIGKILL);
            killed = true;
        }
        pid_t ended = waitpid(pid, &status, killed ? 0 : WNOHANG);
        if (ended == pid)
            return !killed && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        if (ended < 0 && errno != EINTR)
            return -1;
        nanosleep(&nap, NULL);
    }
}

char *slurm_command_run(const struct slurm_command *command, int *status)
{
    int64_t until = now_ms() + command->most_ms;
    int pipes[2] = {-1, -1}, from = file_of(command->in), code;
    struct text out = {0};
    pid_t pid = 0;

    code = from >= 0 && pipe2(pipes, O_CLOEXEC) == 0
               ? spawn(command->arguments, from, pipes[1], &pid)
               : errno;
    if (pipes[1] >= 0)
        close(pipes[1]);
    *status = -1 - code;
    if (code == 0) {
        text_add(&out, "%s", "");
        bool whole = listen_to(command, until, pipes[0], &out);
        *status = wait_for(command, until, pid, !whole);
    }
    if (pipes[0] >= 0)
        close(pipes[0]);
    if (from >= 0)
        close(from);
    char *said = text_take(&out);
    if (*status == 0)
        return said;
    free(said);
    return NULL;
}
