/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * crash.h - whose fault it was. When a thread that works at a job meets a fatal signal (a fault of
 * memory or arithmetic, abort), the job's id goes to a file before the process ends; the next start
 * reads it. A kill -9, a power cut and another thread's fault leave no such note.
 *
 * THREADS  A thread enters and leaves for itself, and notes what it is at. The note lies on the
 *          thread's alternate signal stack, where the signal's handler finds it: a worker whose own
 *          stack is spent can still tell.
 */
#ifndef CRASH_H
#define CRASH_H

#include "store_attempts.h"

struct crash_stack;

/* From here on fatal signals of the process are noted, then do what they always did. Only those
 * that have no handler yet: sanitizers have their own. */
void crash_watch(void);

/* This thread will note what it is at, in the file `path`; takes the fatal signals whatever else
 * it has blocked. NULL = no memory: then nothing is noted. */
struct crash_stack *crash_enter(const char *path);
/* Accepts NULL. In the same thread. */
void crash_leave(struct crash_stack *stack);

/* This thread works at that chunk of that job (negative: at no certain one) until it notes
 * something else; NULL = at none. Without crash_enter nothing happens. */
void crash_note(const char *job, int64_t chunk);

/* What was noted in the file, which is removed; *count = 0 when there is none. Malloc'ed. Notes
 * are removed before they are used: lost ones do less harm than ones that count twice. */
struct attempt_crash *crash_read(const char *path, size_t *count);

/* Whether the kernel has killed processes for want of memory since this was asked last: `vmstat` is
 * its file (CRASH_VMSTAT), `path` where the count is kept. After a reboot nobody knows: false. */
#define CRASH_VMSTAT "/proc/vmstat"
bool crash_starved(const char *vmstat, const char *path);

#endif
