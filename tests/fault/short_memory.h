/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * short_memory.h - allocations that fail on purpose: the linker gives malloc and its like in our
 * own code to short_memory.c (Makefile: --wrap), JSON and SQL libraries are told to use it.
 */
#ifndef SHORT_MEMORY_H
#define SHORT_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

/* Before anything else in the process. */
void short_memory_init(void);

/* From now on the n-th allocation fails, of all threads together; `on`: and all that follow. */
void short_memory_begin(long n, bool on);
/* True if one did fail; none does any more. */
bool short_memory_end(void);

/* Blocks of our own code and the JSON library that are not freed. */
long short_memory_blocks(void);

#endif
