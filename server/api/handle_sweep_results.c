/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * handle_sweep_results.c - one observable of all jobs of a sweep, streamed: points come from the
 * store page by page, each page a short read of its own, and go out as rows.
 *
 * THREADS  An export belongs to its stream: http.c calls its functions one at a time.
 */
#include "handle.h"
#include "limits.h"
#include "reply.h"
#include "store_sweeps.h"
#include "stream_rows.h"
#include "sweep_map.h"
#include "sweep_npz.h"
#include "sweep_plot.h"
#include "sweep_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PAGE_BYTES = 1 << 20, PAGE_POINTS_MAX = 256 };

enum format { FORMAT_JSON, FORMAT_LINES, FORMAT_CSV, FORMAT_NPZ, FORMAT_SVG };

struct export
{
    struct store *store;
    struct sweep *sweep;
    char id[JOB_ID_SIZE], observable[CALL_ARG_SIZE];
    int64_t seq;
    enum format format;
    struct sweep_point *page;
    size_t count, at;        /* points of the page; the one that comes next */
    size_t page_limit;       /* as many as fit into PAGE_BYTES, going by the page before */
    int64_t next;            /* first point of the next page */
    bool begun, last, ended; /* last: no page comes after this one */
    struct sweep_columns columns;
    struct sweep_npz *npz;
};

/* One of both. */
struct picture {
    struct sweep_plot *plot;
    struct sweep_map *map;
};

static bool add_points(struct export *export, const struct picture *picture,
                       struct bcd_errors *errors);
static struct export *open_export(const struct service *service, const struct call *call,
                                  enum format format, struct reply *reply);
static void begin(const struct service *service, const struct call *call, enum format format,
                  struct reply *reply);
static void end(void *export);
static bool next_row(void *export, struct text *text, bool *failed);
static bool turn_page(struct export *export);
static void add_point(struct export *export, struct text *text, const struct sweep_point *point,
                      const struct bcd_table *table);
static void add_head(struct export *export, struct text *text, const struct bcd_table *table);
static bool add_tail(struct export *export, struct text *text);

void handle_sweep_results_json(const struct service *service, const struct call *call,
                               struct reply *reply)
{
    begin(service, call, FORMAT_JSON, reply);
}

void handle_sweep_results_lines(const struct service *service, const struct call *call,
                                struct reply *reply)
{
    begin(service, call, FORMAT_LINES, reply);
}

void handle_sweep_results_csv(const struct service *service, const struct call *call,
                              struct reply *reply)
{
    begin(service, call, FORMAT_CSV, reply);
}

void handle_sweep_results_npz(const struct service *service, const struct call *call,
                              struct reply *reply)
{
    begin(service, call, FORMAT_NPZ, reply);
}

static void begin(const struct service *service, const struct call *call, enum format format,
                  struct reply *reply)
{
    static const char *const types[] = {
        [FORMAT_JSON] = "application/json",
        [FORMAT_LINES] = "application/x-ndjson",
        [FORMAT_CSV] = "text/csv; charset=utf-8; header=present",
        [FORMAT_NPZ] = "application/zip",
    };
    struct export *export = open_export(service, call, format, reply);
    if (!export)
        return;
    const struct stream stream =
        stream_rows_take(&(const struct rows){.next = next_row, .free = end, .state = export});
    reply_stream_take(reply, types[format], &stream);
}

/* A picture needs all points before its first byte: it is drawn aside (aside.h), page by page. With
 * ?y= it is a map, else a family of curves. */
void handle_sweep_results_svg(const struct service *service, const struct call *call,
                              struct reply *reply)
{
    struct bcd_errors errors = {0};
    struct picture picture = {NULL, NULL};
    const char *x = call_query(call, "x"), *y = call_query(call, "y");
    const char *scale = call_query(call, "scale");
    struct export *export = open_export(service, call, FORMAT_SVG, reply);
    if (!export)
        return;
    if (y && call_query(call, "curves"))
        bcd_errors_add(&errors, "curves", "are there without y: with it there is a map");
    else if (y)
        picture.map =
            sweep_map_create(export->sweep, x, y, scale && strcmp(scale, "log") == 0, &errors);
    else if (scale)
        bcd_errors_add(&errors, "scale", "is of the colours of a map: that is there with y");
    else
        picture.plot = sweep_plot_create(export->sweep, x, call_query(call, "curves"), &errors);
    bool drawable = picture.map || picture.plot;
    bool failed = drawable && !add_points(export, &picture, &errors);
    if (errors.count > 0)
        reply_faults(reply, PROBLEM_QUERY, &errors, NULL);
    else if (failed)
        reply_store(reply, STORE_BROKEN, "results of the sweep");
    else
        reply_text_take(reply, "image/svg+xml",
                        picture.map    ? sweep_map_print(picture.map, export->observable)
                        : picture.plot ? sweep_plot_print(picture.plot, export->observable)
                                       : NULL);
    sweep_plot_free(picture.plot);
    sweep_map_free(picture.map);
    end(export);
}

/* All points into the one that is there. What is not in the picture is not even decoded. False: the
 * store, or a result, is broken. */
static bool add_points(struct export *export, const struct picture *picture,
                       struct bcd_errors *errors)
{
    while (!(export->last && export->at == export->count)) {
        struct bcd_table *table = NULL;
        if (export->at == export->count) {
            if (!turn_page(export))
                return false;
            continue;
        }
        const struct sweep_point *point = &export->page[export->at++];
        bool wanted = picture->map ? sweep_map_wants(picture->map, point)
                                   : sweep_plot_wants(picture->plot, point);
        if (!wanted || !point->table)
            continue;
        if (bcd_table_load(&table, point->table, point->table_size, NULL) != BCD_OK)
            return false;
        if (picture->plot)
            sweep_plot_add(picture->plot, point, table);
        else if (!sweep_map_add(picture->map, point, table) && errors->count == 0)
            bcd_errors_add(errors, "y", "%s is a list in each job: a map is of single numbers",
                           export->observable);
        bcd_table_free(table);
        if (errors->count > 0)
            return true;
    }
    return true;
}

/* NULL with the reply filled. */
static struct export *open_export(const struct service *service, const struct call *call,
                                  enum format format, struct reply *reply)
{
    struct sweep_record record = {0};
    enum store_status status = store_sweeps_get(service->store, call->arg[0], &record);
    if (status != STORE_OK) {
        reply_store(reply, status, "such sweep");
        return NULL;
    }
    struct export *export = calloc(1, sizeof(*export));
    bool sound = export != NULL;
    if (sound) {
        *export = (struct export){
            .store = service->store, .seq = record.seq, .format = format, .page_limit = 1};
        memcpy(export->id, record.id, sizeof(export->id));
        memcpy(export->observable, call->arg[1], sizeof(export->observable));
        export->sweep = sweep_json_restore(record.base, record.axes, record.zip);
        sound = export->sweep != NULL;
    }
    if (sound && format == FORMAT_NPZ) {
        export->npz = sweep_npz_create(export->sweep, (size_t)record.points);
        sound = export->npz != NULL;
    }
    sweep_record_fini(&record);
    if (!sound) {
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
    } else if (!sweep_measures(export->sweep, call->arg[1])) {
        reply_problem(reply, PROBLEM_NOT_FOUND, "no job of this sweep measures %s", call->arg[1]);
    } else {
        return export;
    }
    end(export);
    return NULL;
}

static void end(void *state)
{
    struct export *export = state;
    if (!export)
        return;
    sweep_points_free(export->page, export->count);
    sweep_npz_free(export->npz);
    sweep_free(export->sweep);
    free(export);
}

/* One point a call. */
static bool next_row(void *state, struct text *text, bool *failed)
{
    struct export *export = state;
    if (export->ended)
        return false;
    if (export->at == export->count && !export->last && !turn_page(export)) {
        *failed = true;
        return false;
    }
    if (export->at == export->count)
        return add_tail(export, text);
    const struct sweep_point *point = &export->page[export->at++];
    struct bcd_table *table = NULL;
    if (point->table && bcd_table_load(&table, point->table, point->table_size, NULL) != BCD_OK) {
        *failed = true;
        return false;
    }
    add_point(export, text, point, table);
    bcd_table_free(table);
    return true;
}

static bool turn_page(struct export *export)
{
    size_t bytes = 1, limit = export->page_limit;
    sweep_points_free(export->page, export->count);
    export->page = NULL;
    export->count = export->at = 0;
    if (store_sweeps_points(export->store, export->seq, export->next, export->observable, limit,
                            &export->page, &export->count) != STORE_OK)
        return false;
    for (size_t i = 0; i < export->count; i++)
        bytes += export->page[i].table_size;
    export->last = export->count < limit;
    export->next += (int64_t) export->count;
    /* Grows slowly: the next tables may be larger. */
    size_t fit = PAGE_BYTES * (export->count + 1) / bytes;
    export->page_limit = fit > 4 * limit ? 4 * limit : fit < 1 ? 1 : fit;
    export->page_limit =
        export->page_limit > PAGE_POINTS_MAX ? PAGE_POINTS_MAX : export->page_limit;
    return true;
}

static void add_point(struct export *export, struct text *text, const struct sweep_point *point,
                      const struct bcd_table *table)
{
    if (export->format == FORMAT_NPZ) {
        sweep_npz_add(export->npz, text, point, table);
        return;
    }
    if (export->format == FORMAT_CSV && !table)
        return; /* nothing to be shown in numbers */
    bool first = !export->begun;
    if (first)
        add_head(export, text, table);
    if (export->format == FORMAT_CSV) {
        sweep_rows_add_csv(text, export->sweep, &export->columns, point, table);
        return;
    }
    text_add(text, export->format == FORMAT_JSON && !first ? ",\n" : "");
    sweep_rows_add_json(text, export->sweep, point, table);
    text_add(text, export->format == FORMAT_LINES ? "\n" : "");
}

static void add_head(struct export *export, struct text *text, const struct bcd_table *table)
{
    export->begun = true;
    if (export->format == FORMAT_CSV)
        sweep_rows_add_head(text, export->sweep, &export->columns, table);
    if (export->format != FORMAT_JSON)
        return;
    text_add(text, "{\"sweep\":\"%s\",\"observable\":\"%s\",\"axes\":[", export->id,
             export->observable);
    for (size_t a = 0; sweep_axis(export->sweep, a); a++) {
        text_add(text, a ? "," : "");
        text_add_json_string(text, sweep_axis(export->sweep, a));
    }
    text_add(text, "],\"rows\":[\n");
}

/* After the last point; true: there is a pass more. */
static bool add_tail(struct export *export, struct text *text)
{
    if (export->format == FORMAT_NPZ) {
        sweep_npz_end_pass(export->npz, text);
        export->ended = sweep_npz_ended(export->npz);
        export->next = 0;
        export->last = false;
        return true;
    }
    if (!export->begun)
        add_head(export, text, NULL);
    text_add(text, export->format == FORMAT_JSON ? "\n],\"next\":null}\n" : "");
    export->ended = true;
    return true;
}
