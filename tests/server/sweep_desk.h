/* SPDX-License-Identifier: GPL-3.0-or-later
 * sweep_desk.h - a desk (desk.h) where sweeps are submitted and cancelled. */
#ifndef SWEEP_DESK_H
#define SWEEP_DESK_H

#include "desk.h"

/* POST /v1/sweeps; a sweep's id is remembered. Both give the status. */
int sweep_submit(struct desk *f, const char *body);
/* About the sweep whose id was taken last. */
int ask_sweep(struct desk *f, const char *method, const char *rest, const char *body);

/* One number that a statement answers with. */
int64_t ask_sql(struct desk *f, const char *sql);

/* Everything that is counted is what there is: triggers rest while sweeps come in and go. */
void assert_counted(struct desk *f);

#endif
