/* SPDX-License-Identifier: GPL-3.0-or-later
 * json_lines.h - JSON for people and for diff. */
#ifndef JSON_LINES_H
#define JSON_LINES_H

/* Compact JSON in lines: indented by two, short objects and lists on one line, a newline at the
 * end. Takes `json` over; malloc'ed. NULL = out of memory, or given NULL. */
char *json_lines_take(char *json);

#endif
