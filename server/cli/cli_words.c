/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

static bool speaks_utf8(void)
{
    static const char *const names[] = {"LC_ALL", "LC_CTYPE", "LANG"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const char *value = getenv(names[i]);
        if (value && *value)
            return strcasestr(value, "utf-8") || strcasestr(value, "utf8");
    }
    return false;
}

struct cli_screen cli_screen(FILE *out)
{
    struct cli_screen screen = {.out = out, .width = 80, .height = 24};
    const char *no_colour = getenv("NO_COLOR"), *kind = getenv("TERM");
    struct winsize size;
    screen.terminal = isatty(fileno(out));
    screen.colour =
        screen.terminal && !(no_colour && *no_colour) && kind && *kind && strcmp(kind, "dumb") != 0;
    screen.utf8 = screen.terminal && speaks_utf8();
    if (screen.terminal && ioctl(fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
        screen.width = size.ws_col;
        screen.height = size.ws_row ? size.ws_row : 24;
    }
    return screen;
}

void cli_add_duration(struct text *text, double seconds, bool fine)
{
    static const struct {
        double seconds;
        const char *name;
    } units[] = {{86400, "d"}, {3600, "h"}, {60, "min"}, {1, "s"}};
    enum { UNITS = sizeof units / sizeof *units };
    if (!isfinite(seconds) || seconds > 1e11) {
        text_add(text, "?");
        return;
    }
    seconds = fmax(seconds, 0);
    if (fine && seconds < 9.95) {
        text_add(text, "%.2g s", seconds < 0.01 ? 0 : seconds);
        return;
    }
    seconds = floor(seconds + (fine ? 0.5 : 0));
    size_t u = 0;
    while (u + 1 < UNITS && seconds < units[u].seconds)
        u++;
    double whole = floor(seconds / units[u].seconds);
    text_add(text, "%.0f %s", whole, units[u].name);
    double rest = seconds - whole * units[u].seconds;
    if (fine && u + 1 < UNITS && rest >= units[u + 1].seconds)
        text_add(text, " %.0f %s", floor(rest / units[u + 1].seconds), units[u + 1].name);
}

void cli_add_bytes(struct text *text, double bytes)
{
    static const char *const units[] = {"B", "kB", "MB", "GB", "TB"};
    size_t u = 0;
    for (; bytes >= 999.5 && u + 1 < sizeof units / sizeof *units; u++)
        bytes /= 1000;
    text_add(text, "%.3g %s", bytes, units[u]);
}

void cli_add_number(struct text *text, double value)
{
    if (value == floor(value) && fabs(value) < 1e7)
        text_add(text, "%.0f", value);
    else
        text_add(text, "%.4g", value);
}

void cli_add_bar(struct text *text, double share, size_t width, bool utf8)
{
    double full = fmin(fmax(share, 0), 1) * (double)width;
    text_add(text, utf8 ? "" : "[");
    for (size_t i = 0; i < width; i++) {
        double part = full - (double)i; /* of this cell */
        if (!utf8)
            text_add(text, part >= 1 ? "#" : ".");
        else if (part >= 1)
            text_add(text, "\xE2\x96\x88"); /* full block */
        else if (part < 0.125)
            text_add(text, "\xE2\x96\x91"); /* light shade */
        else /* left blocks of one to seven eighths: U+258F down to U+2589 */
            text_add(text, "\xE2\x96%c", (char)(0x90 - (int)(part * 8)));
    }
    text_add(text, utf8 ? "" : "]");
}

int64_t cli_parse_time(const char *text)
{
    struct tm utc = {0};
    const char *rest = text ? strptime(text, "%Y-%m-%dT%H:%M:%S", &utc) : NULL;
    if (!rest)
        return 0;
    double fraction = *rest == '.' ? strtod(rest, NULL) : 0;
    return (int64_t)timegm(&utc) * 1000 + (int64_t)(fraction * 1000 + 0.5);
}

int64_t cli_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

const char *cli_state_colour(const struct cli_screen *screen, const char *state)
{
    static const struct {
        const char *state, *escape;
    } colours[] = {{"done", "\033[32m"},
                   {"running", "\033[36m"},
                   {"failed", "\033[31m"},
                   {"cancelled", "\033[33m"},
                   {"queued", "\033[2m"}};
    for (size_t i = 0; screen->colour && i < sizeof colours / sizeof *colours; i++)
        if (strcmp(state, colours[i].state) == 0)
            return colours[i].escape;
    return "";
}

const char *cli_colour_end(const struct cli_screen *screen)
{
    return screen->colour ? "\033[0m" : "";
}

size_t cli_text_width(const char *text)
{
    size_t width = 0;
    for (; *text; text++)
        width += ((unsigned char)*text & 0xC0) != 0x80;
    return width;
}
