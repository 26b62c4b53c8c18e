/* SPDX-License-Identifier: GPL-3.0-or-later
 * stage.h - a desk (desk.h) with something on it: a job that is done, one that waits, a sweep. */
#ifndef STAGE_H
#define STAGE_H

#include "desk.h"

struct stage {
    struct desk desk;
    struct feed *feed;
    char done[JOB_ID_SIZE], sweep[JOB_ID_SIZE];
};

/* Fail the test, or end the process outside of one, when they cannot. */
void stage_open(struct stage *stage);
void stage_close(struct stage *stage);

/* The text with "jdone" and "sdone" replaced by the ids of this stage, which are drawn. malloc'ed.
 */
char *stage_with_ids(const struct stage *stage, const char *text);

#endif
