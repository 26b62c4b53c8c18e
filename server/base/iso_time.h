/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * iso_time.h - moments as people write them.
 */
#ifndef ISO_TIME_H
#define ISO_TIME_H

#include <stdbool.h>
#include <stdint.h>

/* Milliseconds since 1970 UTC from ISO 8601: "2026-11-26", "2026-11-26T12:30", with seconds and
 * fractions of them, with Z, +01:00 or nothing (UTC) behind the time; or from the milliseconds
 * themselves. False = it is none of these. */
bool iso_time_parse(const char *text, int64_t *ms);

#endif
