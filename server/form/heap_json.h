/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * heap_json.h - the JSON library's memory. Where its lexer has none it goes on with what it has: a
 * long key or number is cut short, a text that is sound becomes a fault of syntax. So whoever reads
 * a text counts the allocations that failed meanwhile.
 *
 * THREADS  heap_json_init: before there are others. What fails in one thread makes another one's
 * text unread as well.
 */
#ifndef HEAP_JSON_H
#define HEAP_JSON_H

/* Seeds the library's hash, too: keys from outside must not collide at will. */
void heap_json_init(void);

/* Allocations of the library that failed, since heap_json_init. */
unsigned long heap_json_failures(void);

#endif
