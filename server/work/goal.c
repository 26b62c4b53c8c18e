/* SPDX-License-Identifier: GPL-3.0-or-later
 * goal.c - see goal.h. */
#include "goal.h"

#include "log.h"
#include "queue.h"

#include <stdlib.h>
#include <string.h>

/* Realizations in a tally's bytes; negative when they are no tally of this scene. */
static int64_t realizations_in(const struct bcd_scene *scene, const struct blob *blob)
{
    struct bcd_tally *tally = NULL;
    int64_t count = -1;

    if (!blob->bytes)
        return 0;
    if (bcd_tally_create(&tally, scene) == BCD_OK &&
        bcd_tally_restore(tally, blob->bytes, blob->size, NULL) == BCD_OK)
        count = bcd_tally_realizations(tally);
    bcd_tally_free(tally);
    return count;
}

bool goal_sound(const struct bcd_scene *scene, const struct family_sample *sample)
{
    int64_t whole = bcd_scene_realizations(scene, sample->chunks);

    return sample->chunks <= bcd_scene_chunks(scene) &&
           realizations_in(scene, &sample->whole) == whole &&
           realizations_in(scene, &sample->rest) == sample->realizations - whole;
}

/* Replaces the base by a larger sample, if there is one that helps and is sound. */
static enum store_status take_over(struct store *store, const struct sample_query *query,
                                   const struct bcd_scene *scene, struct family_sample *base)
{
    for (;;) {
        struct family_sample found = {0};
        enum store_status status = store_samples_find(store, query, &found);

        if (status)
            return status == STORE_NOT_FOUND ? STORE_OK : status;
        if (goal_sound(scene, &found)) {
            log_write(LOG_LEVEL_INFO, "sample_taken_over",
                      LOG_FIELDS(log_text("job", query->id), log_text("from", found.job),
                                 log_integer("realizations", found.realizations)));
            status = store_samples_adopt(store, query->id, found.seq);
            if (status == STORE_NOT_FOUND) { /* dropped meanwhile */
                family_sample_fini(&found);
                continue;
            }
            family_sample_fini(base);
            *base = found;
            return status;
        }
        log_write(LOG_LEVEL_WARNING, "sample_dropped",
                  LOG_FIELDS(log_text("job", query->id), log_text("from", found.job),
                             log_integer("realizations", found.realizations)));
        status = store_samples_drop(store, found.seq);
        family_sample_fini(&found);
        if (status)
            return status;
    }
}

/* Which chunks stand: put away by the job itself, or in its base. */
static enum store_status mark_done(struct store *store, const char *id,
                                   const struct bcd_scene *scene, const struct family_sample *base,
                                   struct goal *goal)
{
    int64_t chunks = bcd_scene_chunks(scene);
    bool *done = calloc((size_t)chunks + 1, sizeof *done);
    enum store_status status = done ? store_results_chunks(store, id, done, chunks) : STORE_BROKEN;

    for (int64_t i = 0; status == STORE_OK && i < goal->chunks; i++) {
        goal->done[i] = done[i] || bcd_scene_realizations(scene, i + 1) <= base->realizations;
        goal->chunks_done += goal->done[i];
    }
    free(done);
    return status;
}

enum store_status goal_read(struct store *store, const char *id, const struct bcd_scene *scene,
                            int64_t least, struct goal *goal)
{
    struct goal read = {.chunks = bcd_scene_goal(scene, least - 1)};
    unsigned char family[JOB_HASH_SIZE];
    struct family_sample base = {0};
    enum store_status status = store_samples_base(store, id, &base);

    if (status == STORE_NOT_FOUND)
        status = STORE_OK;
    read.done = calloc((size_t)bcd_scene_chunks(scene) + 1, 1);
    if (status == STORE_OK && (!read.done || !queue_family(scene, family)))
        status = STORE_BROKEN;
    /* What it stands on was taken over on the way to a goal at least as far: all before were not
     * enough. */
    while (status == STORE_OK && bcd_scene_realizations(scene, read.chunks) < base.realizations)
        read.chunks = bcd_scene_goal(scene, read.chunks);
    if (status == STORE_OK && bcd_scene_realizations(scene, bcd_scene_chunks(scene)) > 1) {
        const struct sample_query query = {
            .id = id,
            .family = family,
            .above = base.realizations,
            .most = bcd_scene_realizations(scene, read.chunks),
        };

        status = take_over(store, &query, scene, &base);
    }
    if (status == STORE_OK)
        status = mark_done(store, id, scene, &base, &read);
    family_sample_fini(&base);
    if (status) {
        free(read.done);
        return status;
    }
    *goal = read;
    return STORE_OK;
}
