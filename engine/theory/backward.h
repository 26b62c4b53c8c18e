/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * backward.h - exact configurations by the recursion rod by rod, sampled backwards.
 *
 * Rod 0 is drawn from the ring's own density. From there the chain E_j (chain.h) is computed up to
 * N gaps; then, with the end of the last gap at ell, the place of the last rod is drawn from
 * E_{N-1}(g') w f(ell - g'), and so on down to the first. Nothing is rejected, but every draw
 * computes the chain anew: N panels of [0, ell], which is little for dense and for small rings,
 * where the method of sampler.h has its difficulties. */
#ifndef THEORY_BACKWARD_H
#define THEORY_BACKWARD_H

#include "chain.h"
#include "ramp.h"
#include "sampler.h"
#include "tools.h"

struct backward {
    const struct model *model;
    size_t points;       /* per period; panels go with it */
    struct ramp density; /* integral of the ring's density */
    struct chain tables; /* what all chains share */
    struct measure bump; /* quadrature over all of the bump */
    struct scratch scratch;
};

/* To be ended with _fini also on failure. BCD_INVALID when a draw would cost too much, or the
 * ring's density is not known. */
enum bcd_status backward_init(struct backward *backward, const struct model *model,
                              struct bcd_error *error);

void backward_fini(struct backward *backward);

/* y[0] = 0; the other rods relative to it. *first = place of rod 0 within its period. When the
 * watch of the uniforms has ended it, y is no configuration. */
enum bcd_status backward_draw(const struct backward *backward, double *y, double *first,
                              const struct theory_uniforms *uniforms);

#endif
