/* SPDX-License-Identifier: GPL-3.0-or-later
 * report_stability_plot.c - the verdicts as a table of signs: nothing is said by colour alone. */
#include "plot_words.h"
#include "report_stability.h"

#include <math.h>
#include <stdio.h>

enum { LEFT = 270, TOP = 150, COLUMN = 62, ROW = 24, MARGIN = 16, BELOW = 76, SIZE = 13 };

static const struct look {
    const char *fill, *sign;
} looks[STABILITY_VERDICTS] = {
    [STABILITY_RIGHT] = {"#cfe8d8", "\u25cf"},  [STABILITY_BIASED] = {"#fbe7b8", "\u25d0"},
    [STABILITY_RAN] = {"#e4e9ee", "\u25cb"},    [STABILITY_REFUSED] = {"#f4f4f4", "\u2013"},
    [STABILITY_MELTED] = {"#f3b4b4", "\u2715"}, [STABILITY_ACCEPTED] = {"#f3b4b4", "\u2715"},
    [STABILITY_NAN] = {"#f3b4b4", "\u2715"},    [STABILITY_DISORDER] = {"#f3b4b4", "\u2715"},
    [STABILITY_LATE] = {"#f3b4b4", "\u2715"},   [STABILITY_BROKEN] = {"#f3b4b4", "\u2715"},
};

/* Columns are the methods of the first extreme: each has the same. */
static size_t count_columns(const struct stability *report)
{
    size_t columns = 0;
    while (columns < report->count && report->entry[columns].extreme == report->entry[0].extreme)
        columns++;
    return columns;
}

static void add_cell(struct text *svg, double x, double y, const struct stability_entry *entry)
{
    const struct stability_result *result = &entry->result;
    const struct look *look = &looks[result->verdict];
    char words[32] = "";
    bool told = result->verdict == STABILITY_BIASED || stability_failed(result->verdict);
    if (told && isfinite(result->off))
        snprintf(words, sizeof words, " %.1g", result->off);
    text_add(svg,
             "<g><rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"%s\" "
             "stroke=\"#ffffff\"/>",
             (int)x, (int)y, COLUMN, ROW, look->fill);
    text_add(svg, "<title>");
    text_add_xml(svg, entry->extreme->name);
    text_add(svg, ", %s: %s", entry->method, stability_verdict_name(result->verdict));
    if (result->words[0]) {
        text_add(svg, ": ");
        text_add_xml(svg, result->words);
    }
    text_add(svg,
             "</title><text x=\"%d\" y=\"%d\" font-size=\"%d\" text-anchor=\"middle\" "
             "fill=\"" PLOT_INK "\">%s%s</text></g>\n",
             (int)x + COLUMN / 2, (int)y + ROW - 8, SIZE - 1, look->sign, words);
}

static void add_heads(struct text *svg, const struct stability *report, size_t columns)
{
    for (size_t c = 0; c < columns; c++)
        text_add(svg,
                 "<text transform=\"translate(%d %d) rotate(-45)\" font-size=\"%d\" "
                 "fill=\"" PLOT_INK "\">%s</text>\n",
                 LEFT + COLUMN * (int)c + COLUMN / 2, TOP - 6, SIZE, report->entry[c].method);
}

char *stability_print_svg(const struct stability *report)
{
    struct text svg = {0};
    size_t columns = count_columns(report);
    size_t rows = columns ? (report->count + columns - 1) / columns : 0;
    int width = LEFT + COLUMN * (int)columns + 70, height = TOP + ROW * (int)rows + BELOW;
    text_add(&svg,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
             "height=\"%d\" role=\"img\" font-family=\"sans-serif\">\n"
             "<title>Every method at the extremes</title>\n"
             "<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n",
             width, height, width, height, width, height);
    plot_line_print(&svg,
                    &(struct plot_line){MARGIN, 28, width - 2 * MARGIN, 18, PLOT_START,
                                        "font-weight=\"bold\" fill=\"" PLOT_INK "\""},
                    "Every method at the extremes");
    add_heads(&svg, report, columns);
    for (size_t i = 0; i < report->count; i++) {
        double x = LEFT + COLUMN * (double)(i % columns), y = TOP + ROW * (double)(i / columns);
        if (i % columns == 0)
            plot_line_print(&svg,
                            &(struct plot_line){LEFT - 10, y + ROW - 8, LEFT - 10 - MARGIN, SIZE,
                                                PLOT_END, "fill=\"" PLOT_INK "\""},
                            report->entry[i].extreme->name);
        add_cell(&svg, x, y, &report->entry[i]);
    }
    char words[200];
    snprintf(
        words, sizeof words,
        "\u25cf right within 3 standard errors  \u25d0 biased by as much  \u25cb ran, there is no "
        "telling  \u2013 refused with a reason  \u2715 failed: %zu of %zu",
        report->failed, report->count);
    plot_small_print(&svg, words, height - BELOW + 24, width);
    text_add(&svg, "</svg>\n");
    return text_take(&svg);
}
