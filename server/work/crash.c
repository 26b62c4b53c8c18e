/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * crash.c - see crash.h. The handler uses what is safe in one: no allocation, no printf, no lock.
 */
#include "crash.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <ucontext.h>
#include <unistd.h>

enum { STACK_BYTES = 64 << 10, PATH_BYTES = 4096, NOTES_MAX = 64 };

static const uint64_t magic = 0x68736172632d6463; /* "cd-crash" */

static const int fatal[] = {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT, SIGSYS};
enum { FATAL = sizeof fatal / sizeof fatal[0] };

/* Stacks grow downwards: what stands first is what the handler's frames reach last. */
struct crash_stack {
    uint64_t magic;
    stack_t before;
    int64_t chunk;
    char job[JOB_ID_SIZE]; /* "" = none */
    char path[PATH_BYTES];
    char room[STACK_BYTES];
};

/* -------------------------------------------------------------------- handler */

static size_t put_number(char *to, int64_t number)
{
    char digits[24];
    size_t count = 0, size = 0;
    uint64_t rest = number < 0 ? (uint64_t)-number : (uint64_t)number;

    do
        digits[count++] = (char)('0' + rest % 10);
    while ((rest /= 10) > 0);
    if (number < 0)
        to[size++] = '-';
    while (count > 0)
        to[size++] = digits[--count];
    return size;
}

/* "jabc 3 11\n": job, chunk, signal. */
static void leave_note(const struct crash_stack *stack, int number)
{
    char line[JOB_ID_SIZE + 64];
    size_t size = strnlen(stack->job, JOB_ID_SIZE - 1);
    int fd;

    memcpy(line, stack->job, size);
    line[size++] = ' ';
    size += put_number(line + size, stack->chunk);
    line[size++] = ' ';
    size += put_number(line + size, number);
    line[size++] = '\n';
    fd = open(stack->path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd >= 0 && write(fd, line, size) > 0)
        close(fd);
}

/* The thread's alternate stack, if it has one, is ours and holds what the thread is at. The signal,
 * still blocked, comes once more as soon as this returns, and finds no handler. */
static void note_and_die(int number, siginfo_t *info, void *context)
{
    const ucontext_t *interrupted = context;
    const struct crash_stack *stack = interrupted->uc_stack.ss_sp;

    (void)info;
    signal(number, SIG_DFL);
    if (stack && !(interrupted->uc_stack.ss_flags & SS_DISABLE) && stack->magic == magic &&
        stack->job[0])
        leave_note(stack, number);
    raise(number);
}

void crash_watch(void)
{
    struct sigaction action = {.sa_sigaction = note_and_die, .sa_flags = SA_SIGINFO | SA_ONSTACK};

    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < FATAL; i++) {
        struct sigaction there;

        if (sigaction(fatal[i], NULL, &there) == 0 && !(there.sa_flags & SA_SIGINFO) &&
            there.sa_handler == SIG_DFL)
            sigaction(fatal[i], &action, NULL);
    }
}

/* --------------------------------------------------------------------- threads */

struct crash_stack *crash_enter(const char *path)
{
    struct crash_stack *stack = calloc(1, sizeof *stack);
    stack_t own = {.ss_sp = stack, .ss_size = sizeof *stack};
    sigset_t taken;

    if (!stack || strlen(path) >= sizeof stack->path) {
        free(stack);
        return NULL;
    }
    stack->magic = magic;
    strcpy(stack->path, path);
    if (sigaltstack(&own, &stack->before) != 0) {
        free(stack);
        return NULL;
    }
    sigemptyset(&taken);
    for (size_t i = 0; i < FATAL; i++)
        sigaddset(&taken, fatal[i]);
    pthread_sigmask(SIG_UNBLOCK, &taken, NULL);
    return stack;
}

void crash_leave(struct crash_stack *stack)
{
    if (!stack)
        return;
    sigaltstack(&stack->before, NULL);
    free(stack);
}

void crash_note(const char *job, int64_t chunk)
{
    struct crash_stack *stack;
    stack_t own;

    if (sigaltstack(NULL, &own) != 0 || (own.ss_flags & SS_DISABLE))
        return;
    stack = own.ss_sp;
    if (stack->magic != magic)
        return;
    stack->chunk = chunk;
    snprintf(stack->job, sizeof stack->job, "%s", job ? job : "");
}

/* ------------------------------------------------------------------- next start */

static bool read_note(FILE *file, struct attempt_crash *crash)
{
    char line[JOB_ID_SIZE + 64], place[40] = "";
    int64_t chunk;
    int number;
    const char *name;

    for (;;) {
        if (!fgets(line, sizeof line, file))
            return false;
        if (sscanf(line, "%23s %" SCNd64 " %d", crash->job, &chunk, &number) == 3)
            break;
    }
    name = sigabbrev_np(number);
    if (chunk >= 0)
        snprintf(place, sizeof place, " in chunk %" PRId64, chunk);
    snprintf(crash->reason, sizeof crash->reason, "SIG%s%s", name ? name : "?", place);
    return true;
}

struct attempt_crash *crash_read(const char *path, size_t *count)
{
    struct attempt_crash *crashes = calloc(NOTES_MAX, sizeof *crashes);
    FILE *file = fopen(path, "re");

    *count = 0;
    while (file && crashes && *count < NOTES_MAX && read_note(file, &crashes[*count]))
        ++*count;
    if (file)
        fclose(file);
    unlink(path);
    return crashes;
}

/* -1 = not told. */
static long long read_count(const char *path, const char *format)
{
    FILE *file = fopen(path, "re");
    char line[128];
    long long count = -1;

    while (file && count < 0 && fgets(line, sizeof line, file))
        if (sscanf(line, format, &count) != 1)
            count = -1;
    if (file)
        fclose(file);
    return count;
}

bool crash_starved(const char *vmstat, const char *path)
{
    long long now = read_count(vmstat, "oom_kill %lld"), before = read_count(path, "%lld");
    int fd = now < 0 ? -1 : open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);

    if (fd >= 0) {
        dprintf(fd, "%lld\n", now);
        close(fd);
    }
    return before >= 0 && now > before;
}
