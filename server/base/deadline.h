/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * deadline.h - conditions that are waited for until then, whatever is done to the machine's date.
 */
#ifndef DEADLINE_H
#define DEADLINE_H

#include <pthread.h>
#include <stdint.h>
#include <time.h>

/* A condition whose time is that of CLOCK_MONOTONIC; to be destroyed as usual. */
void deadline_condition(pthread_cond_t *condition);

/* From now on so many ms, for pthread_cond_timedwait on such a condition. */
struct timespec deadline_in_ms(int64_t ms);

#endif
