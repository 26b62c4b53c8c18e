/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "watch_items.h"
#include "cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BAR_MIN = 8, BAR_MAX = 40, WORDS_WIDTH = 34, STATE_WIDTH = 9 };

static void begin_pace(struct watch_item *item);
static void read_job(struct watch_item *item, const struct answer *record);
static void read_sweep(struct watch_item *item, const struct answer *record);
static void add_words(struct text *text, const struct watch_item *item);
static double seconds_left(const struct watch_item *item);
static void draw_item(const struct cli_screen *screen, const struct watch_item *item,
                      size_t id_width);

void watch_item_fini(struct watch_item *item)
{
    free(item->error);
    item->error = NULL;
}

void watch_item_read(struct watch_item *item, const struct answer *record)
{
    item->asked_ms = cli_now_ms();
    item->stale = false;
    if (item->sweep)
        read_sweep(item, record);
    else
        read_job(item, record);
    begin_pace(item);
}

void watch_item_progress(struct watch_item *item, double progress)
{
    if (item->ended || !(progress >= item->progress && progress <= 1))
        return;
    begin_pace(item);
    item->progress = progress;
    snprintf(item->state, sizeof item->state, "running");
}

/* The pace is taken from when it was first seen, or from when it begins to move. */
static void begin_pace(struct watch_item *item)
{
    if (item->first_ms != 0 && item->progress > 0)
        return;
    item->first_ms = cli_now_ms();
    item->first_progress = item->progress;
}

static void read_job(struct watch_item *item, const struct answer *record)
{
    const char *state = answer_json_text(record, "state");
    const char *error = answer_json_text(record, "error");
    snprintf(item->state, sizeof item->state, "%s", state ? state : "?");
    item->progress = answer_json_number(record, "progress", 0);
    item->started_ms = cli_parse_time(answer_json_text(record, "started_at"));
    item->finished_ms = cli_parse_time(answer_json_text(record, "finished_at"));
    item->good = strcmp(item->state, "done") == 0;
    item->ended =
        item->good || strcmp(item->state, "failed") == 0 || strcmp(item->state, "cancelled") == 0;
    if (error && !item->error)
        item->error = strdup(error);
}

static void read_sweep(struct watch_item *item, const struct answer *record)
{
    double queued = answer_json_number(record, "states.queued", 0);
    double running = answer_json_number(record, "states.running", 0);
    item->jobs = answer_json_number(record, "jobs", 0);
    item->jobs_done = answer_json_number(record, "states.done", 0);
    item->jobs_failed = answer_json_number(record, "states.failed", 0);
    item->jobs_cancelled = answer_json_number(record, "states.cancelled", 0);
    double ended = item->jobs_done + item->jobs_failed + item->jobs_cancelled;
    item->progress =
        answer_json_number(record, "progress", item->jobs > 0 ? ended / item->jobs : 0);
    item->ended = queued + running == 0;
    item->good = item->ended && item->jobs_failed + item->jobs_cancelled == 0;
    if (item->ended && item->finished_ms == 0)
        item->finished_ms = cli_now_ms();
    if (item->started_ms == 0)
        item->started_ms = cli_parse_time(answer_json_text(record, "submitted_at"));
    snprintf(item->state, sizeof item->state, "%s",
             item->good              ? "done"
             : !item->ended          ? running + ended > 0 ? "running" : "queued"
             : item->jobs_failed > 0 ? "failed"
                                     : "cancelled");
}

/* ---------------------------------------------------------------- plain lines */

void watch_item_say(struct watch_item *item)
{
    int tenths = (int)(10 * item->progress);
    if (strcmp(item->state, item->said_state) == 0 && tenths == item->said_tenths)
        return;
    snprintf(item->said_state, sizeof item->said_state, "%s", item->state);
    item->said_tenths = tenths;
    struct text text = {0};
    text_add(&text, "%s %s", item->id, item->state);
    if (!item->ended)
        text_add(&text, " %.0f %%", floor(100 * item->progress));
    text_add(&text, " ");
    add_words(&text, item);
    char *line = text_take(&text);
    if (line)
        line[strlen(line) - (line[strlen(line) - 1] == ' ')] = '\0';
    cli_put_clean(stdout, line ? line : item->id);
    putchar('\n');
    fflush(stdout);
    free(line);
}

/* What stands behind the bar. */
static void add_words(struct text *text, const struct watch_item *item)
{
    const char *comma = "";
    if (item->sweep) {
        text_add(text, "%.0f/%.0f jobs", item->jobs_done, item->jobs);
        if (item->jobs_failed > 0)
            text_add(text, ", %.0f failed", item->jobs_failed);
        if (item->jobs_cancelled > 0)
            text_add(text, ", %.0f cancelled", item->jobs_cancelled);
        comma = ", ";
    }
    double left = seconds_left(item);
    if (item->error) {
        text_add(text, "%s%s", comma, item->error);
    } else if (item->ended && item->good && item->started_ms && item->finished_ms) {
        text_add(text, "%sin ", comma);
        cli_add_duration(text, (double)(item->finished_ms - item->started_ms) / 1000, true);
    } else if (!item->ended && isfinite(left) && left >= 0.5) {
        text_add(text, "%s", comma);
        cli_add_duration(text, left, true);
        text_add(text, " left");
    }
}

/* By the pace since it was first seen; INFINITY while there is none. */
static double seconds_left(const struct watch_item *item)
{
    double done = item->progress - item->first_progress;
    double seconds = (double)(cli_now_ms() - item->first_ms) / 1000;
    if (item->first_ms == 0 || done < 0.002 || seconds < 1)
        return INFINITY;
    return seconds * (1 - item->progress) / done;
}

/* ------------------------------------------------------------------ a terminal */

/* Running ones are of most interest, then those that will. */
enum { RUNNING, WAITING, ENDED, CLASSES };

static int class_of(const struct watch_item *item)
{
    return item->ended ? ENDED : strcmp(item->state, "running") == 0 ? RUNNING : WAITING;
}

/* Draws `room` of them, in their order if that is all; counts the others. */
static void draw_some(const struct cli_screen *screen, const struct watch_item *items, size_t count,
                      size_t room, size_t rest[CLASSES])
{
    size_t id_width = 0, shown = 0;
    bool all = room >= count;
    for (size_t i = 0; i < count; i++)
        id_width = strlen(items[i].id) > id_width ? strlen(items[i].id) : id_width;
    for (int class = 0; class < (all ? 1 : CLASSES); class ++)
        for (size_t i = 0; i < count; i++) {
            if (!all && class_of(&items[i]) != class)
                continue;
            if (shown++ < room)
                draw_item(screen, &items[i], id_width);
            else
                rest[class]++;
        }
}

void watch_items_draw(const struct cli_screen *screen, const struct watch_item *items, size_t count,
                      const char *remark, size_t *lines)
{
    size_t room = screen->height > 4 ? screen->height - 3 : 1, rest[CLASSES] = {0};
    size_t shown = count <= room ? count : room - 1;
    if (*lines > 0)
        fprintf(screen->out, "\033[%zuA", *lines);
    draw_some(screen, items, count, shown, rest);
    if (shown < count)
        fprintf(screen->out, "\r\033[Kand %zu more: %zu running, %zu queued, %zu ended\n",
                count - shown, rest[RUNNING], rest[WAITING], rest[ENDED]);
    fprintf(screen->out, "\r\033[J%s", remark ? remark : "");
    *lines = shown + (shown < count);
    fflush(screen->out);
}

static void draw_item(const struct cli_screen *screen, const struct watch_item *item,
                      size_t id_width)
{
    struct text bar = {0}, words = {0};
    size_t used = id_width + STATE_WIDTH + 4 + 9, width = screen->width;
    size_t room = width > used + WORDS_WIDTH ? width - used - WORDS_WIDTH : BAR_MIN;
    room = room < BAR_MIN ? BAR_MIN : room > BAR_MAX ? BAR_MAX : room;
    cli_add_bar(&bar, item->progress, room, screen->utf8);
    add_words(&words, item);
    char *shown = text_take(&bar), *behind = text_take(&words);
    fprintf(screen->out, "\r\033[K%-*s  %s%-*s%s  %s %5.1f %%  ", (int)id_width, item->id,
            cli_state_colour(screen, item->state), STATE_WIDTH, item->state, cli_colour_end(screen),
            shown ? shown : "", 100 * item->progress);
    size_t taken = used + room + (screen->utf8 ? 0 : 2);
    if (behind && taken + cli_text_width(behind) >= width) /* a line that wraps spoils the next */
        behind[width > taken + 1 ? width - taken - 1 : 0] = '\0';
    cli_put_clean(screen->out, behind ? behind : "");
    fputc('\n', screen->out);
    free(shown);
    free(behind);
}
