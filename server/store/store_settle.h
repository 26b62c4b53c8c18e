/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_settle.h - what a large transaction puts off until its answer is on the way: the index that
 * jobs are found by, and moving the log into the database. See store.h for threads and errors.
 */
#ifndef STORE_SETTLE_H
#define STORE_SETTLE_H

#include "store.h"

#include <stdbool.h>

/* A large transaction is in progress, or about to begin: who wants to write waits for seconds. */
bool store_busy(struct store *store);

/* Does what was put off, in steps that let others write in between. False = there was nothing. What
 * fails is done at the next start, or by the next that settles. */
bool store_settle(struct store *store);

#endif
