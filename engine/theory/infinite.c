/* SPDX-License-Identifier: GPL-3.0-or-later
 * infinite.c - the infinite system at the ring's mean density (theory.h, transfer.h). */
#include <math.h>

#include "pairs.h"

static const size_t points[] = {15, 23, 35, 53, 79, 119, 179, 269, 405};

static enum bcd_status compute(struct theory_result **result, const struct model *model,
                               size_t level, struct bcd_error *error)
{
    size_t n = points[level];
    struct scratch scratch = {.watch = model->system.watch};
    struct transfer transfer;
    struct functionals functionals;
    struct profile profile;
    struct matrix rest;
    struct pairs pairs = {0};
    struct theory_result *fresh = NULL;
    enum bcd_status status = transfer_init(&transfer, model, &scratch, n, error);
    if (status) {
        goto cleanup;
    }
    /* K^(N-1) has become the projection on the leading eigenvectors. */
    matrix_init(&rest, &scratch, n);
    status = functionals_init(&functionals, model, &transfer.grid, &scratch);
    if (status || profile_init(&profile, model, &scratch, n) ||
        result_create(&fresh, &model->wanted)) {
        status = theory_fail(error, BCD_NO_MEMORY, "out of memory");
        goto cleanup;
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            rest.re[i * n + j] = transfer.right[i] * transfer.left[j];
        }
    }
    struct contribution all = {.transfer = &transfer,
                               .functionals = &functionals,
                               .rest = &rest,
                               .s = transfer.p,
                               .factor = 1};
    profile_add(&profile, &all, &scratch);
    status = profile_finish(fresh, &profile, model, &transfer.grid, &scratch);
    if (status) {
        status = theory_fail(error, status, "out of memory");
        goto cleanup;
    }
    status = pairs_init(&pairs, &transfer, &scratch, error);
    for (size_t j = 1; j <= pairs.terms && !status; j++) {
        pairs_add(&pairs, j, &all);
    }
    double norm = 0;
    for (size_t i = 0; i < n; i++) {
        norm += profile.density[i];
    }
    status = status ? status : pairs_finish(fresh, &pairs, norm, &scratch, error);
    if (status) {
        goto cleanup;
    }
    fresh->pressure = transfer.p * model->system.temperature;
    fresh->route = "infinite";
    *result = fresh;
    fresh = NULL;
cleanup:
    theory_result_free(fresh);
    scratch_free(&scratch);
    return status;
}

enum bcd_status theory_infinite(struct theory_result **result, const struct theory_system *system,
                                const struct theory_wanted *wanted, struct bcd_error *error)
{
    struct model model;
    enum bcd_status status = model_init(&model, system, wanted, error);
    if (status) {
        return status;
    }
    struct refinement how = {
        .compute = compute, .levels = sizeof points / sizeof *points, .what = "infinite system"};
    return refine(result, &model, wanted, &how, error);
}
