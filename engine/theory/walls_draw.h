/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * walls_draw.h - exact configurations between walls: the chain from the left wall (line.h) read
 * backwards. The last rod's place is drawn from w A of the last rod; given rod i + 1 at y', rod i's
 * from w_i A_i(y) f(y' - y), 0 <= y <= y', and so on. Nothing is rejected, but for the shape of a
 * pair energy. All chains are computed once: a draw takes about a microsecond a rod. */
#ifndef THEORY_WALLS_DRAW_H
#define THEORY_WALLS_DRAW_H

#include "line.h"
#include "sampler.h"

struct walls_draw {
    const struct model *model;
    struct line_tables tables;
    double *weight; /* [rods][nodes] w_i A_i */
    double *sum;    /* [rods][panels + 1] its integral up to each panel */
    double most;    /* of f, for a pair energy */
    struct scratch scratch;
};

/* To be ended with _fini also on failure. BCD_INVALID when there are too many rods for its memory,
 * or the theory does not reach its tolerance. */
enum bcd_status walls_draw_init(struct walls_draw *draw, const struct model *model,
                                struct bcd_error *error);
void walls_draw_fini(struct walls_draw *draw);

/* y[0 .. N-1] within [0, ell], rising. */
enum bcd_status walls_draw(const struct walls_draw *draw, double *y,
                           const struct theory_uniforms *uniforms, struct bcd_error *error);

#endif
