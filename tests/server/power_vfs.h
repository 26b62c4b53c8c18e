/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * power_vfs.h - a file system for SQLite that fails when a test wants it to: the k-th call answers
 * with an error, or the power is cut there. It stands on the usual one and remembers of every file
 * what was synced, and what was written since: a power cut keeps the former, and of the latter
 * drops, keeps or tears (at sectors of 512 bytes) each write as a seeded die says. Files deleted
 * since the directory was synced may come back.
 *
 * THREADS  One test, one thread.
 */
#ifndef POWER_VFS_H
#define POWER_VFS_H

#include <stdbool.h>
#include <stdint.h>

enum power_fault {
    POWER_NONE,
    POWER_CUT,     /* at the k-th call that changes something: from then on nothing works */
    POWER_EIO,     /* the k-th call of any kind fails once */
    POWER_EIO_ON,  /* and all that follow, until the fault is taken away */
    POWER_FULL_ON, /* from the k-th call that needs room on, there is none */
};

/* Makes it the file system of all databases opened from here on. Once. */
void power_vfs_register(void);

/* What comes; calls are counted from here. k >= 1. */
void power_vfs_arm(enum power_fault fault, int64_t k);
/* Whether it came. */
bool power_vfs_met(void);

/* After a cut, when all databases are closed: what is on disk is in the files again, and the power
 * is back. */
void power_vfs_restore(uint64_t seed);

/* All files known are forgotten: another directory comes. */
void power_vfs_forget(void);

/* Of how many open files the right to write to a write-ahead log, or to checkpoint it, was taken
 * since power_vfs_forget. */
int power_vfs_writers(void);

#endif
