/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * poison.c - LD_PRELOAD for daemons under test: jobs that crash their worker. A thread, not the
 * first, that asks for POISON_BYTES or more of aligned memory (a run of very many rods does, no
 * other) gets it, and 100 ms later (others are in the middle of something then) meets
 *   POISON=segv   a write to nowhere,   abort   abort(),   stack   the end of its stack,
 *   kill          SIGKILL for the whole process, as from somebody who ends what takes much memory.
 * Anything else: nothing happens.
 */
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { POISON_BYTES = 4 << 20 };

void *aligned_alloc(size_t alignment, size_t size);

/* Deeper and deeper; the compiler cannot know that it is itself that it calls. */
static int sink(int depth)
{
    int (*volatile deeper)(int) = sink;
    volatile char room[4096];

    room[0] = (char)depth;
    return depth < 0 ? 0 : deeper(depth + 1) + room[0];
}

static void act(const char *how)
{
    volatile int *volatile nowhere = NULL;

    nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
    if (strcmp(how, "segv") == 0)
        *nowhere = 1;
    else if (strcmp(how, "abort") == 0)
        abort();
    else if (strcmp(how, "stack") == 0)
        _exit(sink(1));
    else if (strcmp(how, "kill") == 0)
        kill(getpid(), SIGKILL);
}

__attribute__((visibility("default"))) void *aligned_alloc(size_t alignment, size_t size)
{
    const char *how = getenv("POISON");
    void *bytes = NULL;

    if (posix_memalign(&bytes, alignment, size) != 0)
        return NULL;
    if (how && size >= POISON_BYTES && gettid() != getpid())
        act(how);
    return bytes;
}
