/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_words.h - numbers, times and states as people read them, and what a terminal can show.
 */
#ifndef CLI_WORDS_H
#define CLI_WORDS_H

#include "text.h"

#include <stdint.h>
#include <stdio.h>

/* Where a command prints. */
struct cli_screen {
    FILE *out;
    bool terminal, colour, utf8; /* no colours with NO_COLOR or TERM=dumb */
    size_t width, height;        /* 80 and 24 when it is no terminal */
};
struct cli_screen cli_screen(FILE *out);

/* "12 s", "3 min", "5 h", "2 d"; two units with `fine`: "3 min 12 s". */
void cli_add_duration(struct text *text, double seconds, bool fine);

/* "1.23 MB". */
void cli_add_bytes(struct text *text, double bytes);

/* 12345, 0.125, 1.23e+08: four digits, whole numbers below 10^7 with all of theirs. */
void cli_add_number(struct text *text, double value);

/* "[#####.....]", or with blocks; share 0..1. */
void cli_add_bar(struct text *text, double share, size_t width, bool utf8);

/* Milliseconds since 1970 of "2026-01-31T12:00:00.123Z"; 0 = it is none. */
int64_t cli_parse_time(const char *text);
int64_t cli_now_ms(void);

/* Escape sequence that begins the colour of a state, "" without colours; and the one that ends it.
 */
const char *cli_state_colour(const struct cli_screen *screen, const char *state);
const char *cli_colour_end(const struct cli_screen *screen);

/* Columns that the text takes: characters, not bytes. */
size_t cli_text_width(const char *text);

#endif
