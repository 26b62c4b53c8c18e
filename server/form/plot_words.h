/* SPDX-License-Identifier: GPL-3.0-or-later
 * plot_words.h - words in a picture: lines of text that stay within the room they have. */
#ifndef PLOT_WORDS_H
#define PLOT_WORDS_H

#include "text.h"

#define PLOT_INK "#222222"
#define PLOT_PALE "#595959"

enum plot_anchor { PLOT_START, PLOT_MIDDLE, PLOT_END };

/* One line of text, made smaller when it is too long for `room` pixels, and cut with an ellipsis
 * when even that is not enough. `style` are further attributes. */
struct plot_line {
    double x, y, room;
    int size;
    enum plot_anchor anchor;
    const char *style;
};
void plot_line_print(struct text *svg, const struct plot_line *line, const char *string);

/* Small print from `y` downwards in a picture `width` wide, broken at spaces into at most three
 * lines 15 apart. Draws when svg is given; returns the number of lines. */
int plot_small_print(struct text *svg, const char *string, int y, int width);

/* Characters of a UTF-8 string. In a sans-serif font one is about 0.6 of its size wide. */
size_t plot_characters(const char *string);

/* One entry of a legend, the sample `mark` (plot_marks.h, 24 wide about y = 0) and its name, from x
 * on; returns where the next may begin. */
double plot_key_width(const char *string);
double plot_key_print(struct text *svg, double x, double y, const char *mark, const char *string);

#endif
