/* SPDX-License-Identifier: GPL-3.0-or-later
 * temp_dir.h - a directory of a test's own, under $TMPDIR or /tmp. */
#ifndef TEMP_DIR_H
#define TEMP_DIR_H

enum { TEMP_DIR_SIZE = 256 };

/* Makes one; aborts when it cannot. */
void temp_dir_make(char path[TEMP_DIR_SIZE]);

/* Removes it, the plain files in it, and a store's directory of checkpoints. */
void temp_dir_remove(const char *path);

#endif
