/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_watch.c - bcd watch; see cli_watch.h.
 *
 * A stream of events tells when there is news of whom; the record is then asked for. Where there is
 * no stream, or none any more, records are asked for now and then. */
#include "cli_watch.h"
#include "event_lines.h"
#include "watch_items.h"

#include <stdlib.h>
#include <string.h>

enum {
    DRAW_MS = 150,
    NEWS_MS = 300,   /* a record is asked for no more often than this */
    SWEEP_MS = 700,  /* nor a sweep's, whose jobs all bring news */
    POLL_MS = 500,   /* without a stream */
    QUIET_MS = 5000, /* with one */
    REOPEN_MS = 1000,
    WATCH_PATIENCE_MS = 60000,
};

struct watch {
    const struct cli_line *line;
    struct client *client;
    struct watch_item *items;
    size_t count;
    struct cli_screen screen;
    bool bars, json, quiet, lost;
    size_t drawn; /* lines */
    int64_t drawn_ms;
    struct event_lines events;
    struct client_request stream;
    char path[96];
    bool no_stream;    /* this server has none */
    int64_t stream_ms; /* when it was last opened */
};

static int follow(struct watch *watch);
static int refresh(struct watch *watch, struct watch_item *item);
static void show(struct watch *watch, bool now);
static int judge(struct watch *watch, int status);

static int watch(const struct cli_line *line)
{
    struct client *client = NULL;
    int status = cli_server_open(line, &client);
    if (status == CLI_OK)
        status = cli_watch(line, client, line->operand, line->operands);
    client_free(client);
    return status;
}

/* ------------------------------------------------------------------- events */

/* News of a job: its progress if that is all, else its record is asked for. News of nobody
 * ("lost") concerns all. */
static void take_event(void *context, const char *name, const char *data)
{
    struct watch *watch = context;
    if (strcmp(name, "counts") == 0)
        return;
    struct answer *event = answer_json_load(data, strlen(data));
    const char *id = answer_json_text(event, "id"), *state = answer_json_text(event, "state");
    double progress = answer_json_number(event, "progress", -1);
    bool moved = progress >= 0 && state && strcmp(state, "running") == 0;
    for (size_t i = 0; i < watch->count; i++) {
        struct watch_item *item = &watch->items[i];
        bool meant = !id || strcmp(id, item->id) == 0;
        if (meant && moved && !item->sweep)
            watch_item_progress(item, progress);
        else if (meant || item->sweep)
            item->stale = true;
    }
    answer_json_free(event);
}

static bool take_bytes(void *context, const char *bytes, size_t size)
{
    struct watch *watch = context;
    return event_lines_add(&watch->events, bytes, size);
}

/* One job's or one sweep's own, else everybody's. */
static void choose_stream(struct watch *watch)
{
    const char *id = watch->items[0].id;
    if (watch->count == 1 && watch->items[0].sweep)
        snprintf(watch->path, sizeof watch->path, "/v1/events?sweep=%s", id);
    else if (watch->count == 1)
        snprintf(watch->path, sizeof watch->path, "/v1/jobs/%s/events", id);
    else
        snprintf(watch->path, sizeof watch->path, "/v1/events");
    watch->events = (struct event_lines){.take = take_event, .context = watch};
    watch->stream = (struct client_request){
        .method = "GET", .path = watch->path, .events = true, .take = take_bytes, .context = watch};
}

/* Opens the stream, again if it has ended; gives up on servers that have none. */
static void keep_stream(struct watch *watch)
{
    int64_t now = cli_now_ms();
    if (watch->no_stream || client_stream_open(watch->client) || now - watch->stream_ms < REOPEN_MS)
        return;
    int status = client_stream_status(watch->client);
    watch->no_stream = status != 0 && status != 200 && status != 503;
    if (watch->no_stream)
        return;
    event_lines_fini(&watch->events);
    watch->stream_ms = now;
    client_stream_begin(watch->client, &watch->stream);
    for (size_t i = 0; i < watch->count && status != 0; i++)
        watch->items[i].stale = true; /* there may have been news meanwhile */
}

/* ---------------------------------------------------------------- following */

int cli_watch(const struct cli_line *line, struct client *client, char *const *ids, size_t count)
{
    struct watch watch = {.line = line, .client = client, .screen = cli_screen(stderr)};
    watch.json = cli_given(line, "json");
    watch.quiet = cli_given(line, "quiet");
    watch.bars = watch.screen.terminal && !watch.quiet && !watch.json;
    watch.items = calloc(count, sizeof *watch.items);
    if (!watch.items)
        return cli_print_take(NULL);
    int status = CLI_OK;
    for (size_t i = 0; i < count && status == CLI_OK; i++) {
        watch.items[watch.count] = (struct watch_item){.id = ids[i], .sweep = ids[i][0] == 's'};
        status = refresh(&watch, &watch.items[watch.count++]);
    }
    client_patience(client, WATCH_PATIENCE_MS);
    if (status == CLI_OK)
        status = follow(&watch);
    client_stream_end(client);
    status = judge(&watch, status);
    event_lines_fini(&watch.events);
    for (size_t i = 0; i < watch.count; i++)
        watch_item_fini(&watch.items[i]);
    free(watch.items);
    return status;
}

static bool due(const struct watch *watch, const struct watch_item *item)
{
    int64_t age = cli_now_ms() - item->asked_ms;
    bool open = client_stream_open(watch->client) && client_stream_status(watch->client) == 200;
    int64_t poll = open ? QUIET_MS : POLL_MS + (int64_t)watch->count * 10;
    return !item->ended &&
           (age >= poll || (item->stale && age >= (item->sweep ? SWEEP_MS : NEWS_MS)));
}

static int follow(struct watch *watch)
{
    size_t left = 1;
    choose_stream(watch);
    for (int status; left > 0;) {
        left = 0;
        keep_stream(watch);
        for (size_t i = 0; i < watch->count; i++) {
            if (due(watch, &watch->items[i]) &&
                (status = refresh(watch, &watch->items[i])) != CLI_OK)
                return status;
            left += !watch->items[i].ended;
        }
        show(watch, left == 0);
        if (left > 0 && !client_wait(watch->client, DRAW_MS))
            return CLI_SIGNAL + client_signal(watch->client);
    }
    return CLI_OK;
}

static void lost(void *context)
{
    struct watch *watch = context;
    if (!watch->lost && !watch->bars && !watch->quiet)
        fprintf(stderr, "bcd %s: the connection was lost, trying again\n",
                watch->line->command->name);
    watch->lost = true;
    show(watch, true);
}

/* Has the record of one of them. */
static int refresh(struct watch *watch, struct watch_item *item)
{
    struct client_answer raw = {0};
    char *path = cli_server_path(watch->line, item->id, "");
    const struct client_request request = {
        .method = "GET", .path = path, .lost = lost, .context = watch};
    int status =
        path ? cli_server_ask(watch->line, watch->client, item->id, &request, &raw) : CLI_USAGE;
    free(path);
    if (status != CLI_OK)
        return status;
    watch->lost = false;
    struct answer *record = answer_json_load(raw.body, raw.size);
    char before[sizeof item->state];
    memcpy(before, item->state, sizeof before);
    watch_item_read(item, record);
    if (watch->json && strcmp(before, item->state) != 0)
        status = cli_print_bytes(raw.body, raw.size);
    answer_json_free(record);
    client_answer_fini(&raw);
    return status;
}

static void show(struct watch *watch, bool now)
{
    int64_t ms = cli_now_ms();
    if (watch->bars && (now || ms - watch->drawn_ms >= DRAW_MS)) {
        watch->screen = cli_screen(stderr);
        watch_items_draw(&watch->screen, watch->items, watch->count,
                         watch->lost ? "the connection was lost, trying again" : NULL,
                         &watch->drawn);
        watch->drawn_ms = ms;
    }
    for (size_t i = 0; i < watch->count && !watch->bars && !watch->json && !watch->quiet; i++)
        watch_item_say(&watch->items[i]);
}

/* The exit status, and last words. */
static int judge(struct watch *watch, int status)
{
    bool good = true;
    for (size_t i = 0; i < watch->count; i++)
        good = good && watch->items[i].good;
    if (status > CLI_SIGNAL) {
        fprintf(stderr, "bcd %s: not followed any more; on the server all goes on\n",
                watch->line->command->name);
        return status;
    }
    if (status != CLI_OK)
        return status;
    for (size_t i = 0; i < watch->count && watch->quiet && !watch->json; i++)
        if (!watch->items[i].good)
            fprintf(stderr, "bcd %s: %s %s%s%s\n", watch->line->command->name, watch->items[i].id,
                    watch->items[i].state, watch->items[i].error ? ": " : "",
                    watch->items[i].error ? watch->items[i].error : "");
    return good ? CLI_OK : CLI_FAILED;
}

static const struct cli_option options[] = {
    {.name = "quiet", .letter = 'q', .doc = "nothing but the exit status, and what failed"},
    {0},
};

const struct cli_command cli_watch_command = {
    .name = "watch",
    .operands = "ID...",
    .least = 1,
    .most = SIZE_MAX,
    .doc = "follows jobs and sweeps to their end",
    .text = "Bars on a terminal, plain lines elsewhere; with --json the record whenever its state\n"
            "changes. A server that goes away is waited for, for a minute. Exit status 0: all are\n"
            "done.",
    .options = options,
    .server = true,
    .function = watch,
};
