/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * store_pieces.h - checkpoints that are too large for the database: DIR/checkpoints/JOB.CHUNK. Each
 * piece has two places in the file. What is kept stands in one of them, the next checkpoint's
 * changed pieces go to the other; the row in the database, written when these are on disk, says
 * which count and holds the checkpoint's head, which vouches for all of them. So a cut at any
 * moment leaves the checkpoint before or the one after. See store.h for errors and memory.
 *
 * A backup of the database holds the row and not the file: the chunk is then run from its start.
 *
 * THREADS  One at a time per file: the worker's that has the chunk.
 */
#ifndef STORE_PIECES_H
#define STORE_PIECES_H

#include "store_results.h"

enum { PIECES_SIZE = 1 << 16, PIECES_HEAD_SIZE = 48 };

struct chunk_place {
    char id[JOB_ID_SIZE]; /* of the job */
    int64_t chunk;
};

struct pieces;

/* A file for checkpoints of `size` bytes, head included, in which nothing is kept so far; what
 * stood there before is gone. */
enum store_status pieces_create(struct pieces **pieces, struct store *store,
                                const struct chunk_place *place, size_t size);

/* The file that a checkpoint's row tells of, opened to go on with, and the whole checkpoint.
 * STORE_CONFLICT: the row is none of a file. STORE_NOT_FOUND: the file is gone, or cannot be read.
 * STORE_BROKEN: there is no memory for it. Nobody has looked whether the bytes are sound. */
enum store_status pieces_open(struct pieces **pieces, struct store *store,
                              const struct chunk_place *place, const struct blob *row,
                              struct blob *checkpoint);

/* Takes the next checkpoint: all of its pieces, then its head. `same`: the piece is what is kept
 * already. Then the system is told to write; it is not waited for. */
enum store_status pieces_put(struct pieces *pieces, size_t piece, const void *bytes, bool same);
void pieces_head(struct pieces *pieces, const void *head);

/* Something is kept; a whole checkpoint waits to be. */
bool pieces_any(const struct pieces *pieces);
bool pieces_waiting(const struct pieces *pieces);

/* Waits until what was put is on disk; from then on it is what is kept. */
enum store_status pieces_keep(struct pieces *pieces);

/* What was put since the last pieces_keep counts for nothing. */
void pieces_forget(struct pieces *pieces);

/* Closes the file; removed: nobody needs it any more. Accepts NULL. */
void pieces_close(struct pieces *pieces, bool removed);

/* At the start: files of which no row tells are removed. */
void pieces_tidy(struct store *store);

#endif
