/* SPDX-License-Identifier: GPL-3.0-or-later
 * caption.h - a job in one line, for the small print under a picture. */
#ifndef CAPTION_H
#define CAPTION_H

#include "bcd.h"

/* "particles 50, length 100, diameter 0.5, cosine potential, amplitude 6": what is required and
 * what differs from its default, from the engine's rows. Malloc'ed, NULL = out of memory. */
char *caption_print(const struct bcd_scene *scene);

#endif
