/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * goal.h - what of a job is to be run next, from what the store holds: up to which chunk, and which
 * of them stand already - finished by itself, or taken over from a job that differs from it in
 * realizations or target alone.
 *
 * THREADS  Any thread; what a job stands on changes only here, while no chunk of it is in motion.
 */
#ifndef GOAL_H
#define GOAL_H

#include "bcd.h"
#include "store_samples.h"

struct goal {
    int64_t chunks, chunks_done; /* up to the goal; of these, done */
    unsigned char *done;         /* [bcd_scene_chunks], 1 = done (malloc'ed) */
};

/* The job's first goal of at least `least` chunks; takes over the largest sample that helps there.
 * One that is damaged is dropped. */
enum store_status goal_read(struct store *store, const char *id, const struct bcd_scene *scene,
                            int64_t least, struct goal *goal);

/* Are the tallies of this sample what it says? */
bool goal_sound(const struct bcd_scene *scene, const struct family_sample *sample);

#endif
