/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "plot_words.h"
#include "plot_marks.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SMALL_LINES_MAX = 3, SMALL_SIZE = 11, KEY_SIZE = 13 };

size_t plot_characters(const char *string)
{
    size_t n = 0;
    for (const char *c = string; *c; c++)
        n += ((unsigned char)*c & 0xC0) != 0x80;
    return n;
}

/* Adds at most `most` characters of the string; the rest becomes an ellipsis. */
static void add_cut(struct text *svg, const char *string, size_t most)
{
    char shown[1024];
    size_t size = 0, n = 0;
    bool cut = plot_characters(string) > most;
    for (const char *c = string; *c && size + 8 < sizeof shown; c++) {
        n += ((unsigned char)*c & 0xC0) != 0x80;
        if (cut && n >= most)
            break;
        shown[size++] = *c;
    }
    shown[size] = '\0';
    text_add_xml(svg, shown);
    if (cut)
        text_add(svg, "\xE2\x80\xA6");
}

void plot_line_print(struct text *svg, const struct plot_line *line, const char *string)
{
    static const char *const anchors[] = {"start", "middle", "end"};
    double size = line->size, width = 0.6 * (double)plot_characters(string);
    if (width * size > line->room)
        size = fmax(floor(line->room / width), 0.7 * size);
    text_add(svg, "<text x=\"");
    plot_add_pixel(svg, line->x);
    text_add(svg, "\" y=\"");
    plot_add_pixel(svg, line->y);
    text_add(svg, "\" font-size=\"");
    plot_add_pixel(svg, size);
    text_add(svg, "\" text-anchor=\"%s\" %s>", anchors[line->anchor], line->style);
    add_cut(svg, string, (size_t)(line->room / (0.6 * size)));
    text_add(svg, "</text>\n");
}

int plot_small_print(struct text *svg, const char *string, int y, int width)
{
    size_t most = (size_t)((width - 32) / (0.54 * SMALL_SIZE));
    int lines = 0;
    while (*string && lines < SMALL_LINES_MAX) {
        char piece[1024];
        size_t n = 0, size = 0, end = 0;
        for (; string[size] && size + 1 < sizeof piece; size++) {
            n += ((unsigned char)string[size] & 0xC0) != 0x80;
            if (n > most)
                break;
            if (string[size] == ' ')
                end = size;
        }
        bool last = lines + 1 == SMALL_LINES_MAX;
        if (string[size] == '\0' || end == 0)
            end = size;
        snprintf(piece, sizeof piece, "%.*s%s", (int)end, string,
                 last && string[end] ? "\xE2\x80\xA6" : "");
        if (svg)
            plot_line_print(svg,
                            &(struct plot_line){16, y + 15 * lines, 2 * width, SMALL_SIZE,
                                                PLOT_START, "fill=\"" PLOT_PALE "\""},
                            piece);
        string += end + strspn(string + end, " ");
        lines++;
    }
    return lines;
}

double plot_key_width(const char *string)
{
    return 30 + 0.6 * KEY_SIZE * (double)plot_characters(string) + 22;
}

double plot_key_print(struct text *svg, double x, double y, const char *mark, const char *string)
{
    text_add(svg, "<g transform=\"translate(");
    plot_add_pixel(svg, x);
    text_add(svg, " ");
    plot_add_pixel(svg, y);
    text_add(svg, ")\">%s</g>\n", mark);
    plot_line_print(
        svg,
        &(struct plot_line){x + 30, y + 4.5, 300, KEY_SIZE, PLOT_START, "fill=\"" PLOT_INK "\""},
        string);
    return x + plot_key_width(string);
}
