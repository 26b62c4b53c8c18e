/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "lease_bench.h"

#include "support/experiment.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

void lease_bench_start(struct lease_bench *bench, int64_t lease_ms)
{
    *bench = (struct lease_bench){.leases = leases_create(lease_ms)};
    bench->scene =
        experiment_scene("{'particles':3,'length':9,'diameter':1,'time':500,'time_step':0.01,"
                         "'realizations':64,'observables':{'energy':{},'msd':{}}}");
    assert_true(bcd_scene_chunks(bench->scene) >= 2);
    for (int i = 0; i < 2; i++) {
        struct lease_terms terms = {.core_seconds_max = 7.5, .bytes_max = 1e9};
        bench->task[i] = (struct task){.id = "jtest",
                                       .scene = bench->scene,
                                       .chunk = i,
                                       .cancelled = &bench->cancelled,
                                       .ticks_done = &bench->done[i],
                                       .ticks_total = &bench->total[i]};
        bench->lease[i] = lease_offer(bench->leases, &bench->task[i], &terms);
        assert_non_null(bench->lease[i]);
    }
}

void lease_bench_stop(struct lease_bench *bench)
{
    for (int i = 0; i < 2; i++)
        if (bench->lease[i])
            lease_end(bench->lease[i]);
    leases_free(bench->leases);
    bcd_scene_free(bench->scene);
}

struct blob lease_bench_tally(const struct bcd_scene *scene, int64_t chunk)
{
    struct bcd_run *run = NULL;
    struct blob blob = {0};
    assert_int_equal(bcd_run_create(&run, scene, chunk, NULL), BCD_OK);
    assert_int_equal(bcd_run_advance(run, bcd_run_ticks_total(run), NULL), BCD_OK);
    blob.size = bcd_tally_size(bcd_run_tally(run));
    blob.bytes = malloc(blob.size);
    bcd_tally_save(bcd_run_tally(run), blob.bytes);
    bcd_run_free(run);
    return blob;
}
