/* SPDX-License-Identifier: GPL-3.0-or-later
 * plant.c - see plant.h. */
#include "plant.h"

#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct plant plant_start(struct bench *bench, size_t workers)
{
    const struct job_limits usual = job_limits_usual();

    return plant_start_within(bench, workers, &usual);
}

struct plant plant_start_within(struct bench *bench, size_t workers,
                                const struct job_limits *limits)
{
    struct plant plant = {.bench = bench};

    assert_int_equal(queue_create(&plant.queue, bench->store), STORE_OK);
    queue_set_limits(plant.queue, limits);
    assert_int_equal(queue_recover(plant.queue), STORE_OK);
    plant.workers = workers_start(workers, plant.queue, bench->store);
    assert_non_null(plant.workers);
    return plant;
}

void plant_stop(struct plant *plant)
{
    workers_stop(plant->workers);
    queue_free(plant->queue);
    *plant = (struct plant){.bench = plant->bench};
}

/* Until a worker has taken the job up: before, only the store knows of it. */
void plant_wait_start(struct plant *plant, const char *id)
{
    for (int waited = 0; waited < 60000 && queue_progress(plant->queue, id) < 0.0 &&
                         bench_state(plant->bench->store, id) != JOB_DONE;
         waited++)
        job_bench_nap(1);
}

void plant_wait_progress(struct plant *plant, const char *id, double wanted)
{
    double progress = 0.0;

    plant_wait_start(plant, id);
    for (int waited = 0; waited < 60000 && progress >= 0.0 && progress < wanted; waited++) {
        progress = queue_progress(plant->queue, id);
        job_bench_nap(1);
    }
    assert_true(progress < 0.0 || progress >= wanted);
}

void plant_assert_same_bytes(struct store *store, const char *id, struct bcd_scene *scene)
{
    struct experiment direct = experiment_run(scene, 777);
    char **names;
    size_t count, part = 0;

    assert_int_equal(store_results_names(store, id, &names, &count), STORE_OK);
    for (; bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, part); part++) {
        struct bcd_table *table = NULL;
        struct blob stored;
        void *bytes;

        assert_true(part < count);
        assert_int_equal(bcd_tally_table(direct.tally, scene, direct.theory, part, &table), BCD_OK);
        assert_string_equal(names[part], table->name);
        assert_int_equal(store_results_get(store, id, names[part], &stored), STORE_OK);
        assert_int_equal(stored.size, bcd_table_size(table));
        bytes = malloc(stored.size);
        assert_non_null(bytes);
        bcd_table_save(table, bytes);
        assert_memory_equal(stored.bytes, bytes, stored.size);
        free(bytes);
        free(names[part]);
        blob_fini(&stored);
        bcd_table_free(table);
    }
    assert_int_equal(part, 3);
    assert_int_equal(count, part);
    free(names);
    experiment_end(&direct);
}
