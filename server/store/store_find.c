/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_find.c - see store_find.h and store_segment.h. */
#include "store_find.h"

#include "limits.h"
#include "store_condition.h"
#include "store_news.h"
#include "store_places.h"
#include "store_segment.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One scalar that is looked at: of a condition, or what is sorted by. */
struct term {
    const char *path;
    int64_t key; /* 0 = no sealed job has it */
    struct test test;
    size_t same; /* the first term with this path */
    struct news_list news;
    struct stmt members; /* FIND_TAGGED, FIND_SWEPT: the jobs of a segment that it names */
};

/* Relations that another table answers. */
static const char *const members_sql[FIND_RELATIONS] = {
    [FIND_TAGGED] = "SELECT job FROM job_tags"
                    " WHERE tag = :value AND job BETWEEN :first AND :last",
    [FIND_SWEPT] = "SELECT job FROM sweep_points INDEXED BY sweep_points_of"
                   " WHERE sweep = (SELECT seq FROM sweeps WHERE id = :value)"
                   " AND job BETWEEN :first AND :last",
};

static bool has_members(const struct find_condition *condition)
{
    return members_sql[condition->relation] != NULL;
}

/* A segment and the best place that a job in it can have. */
struct zone {
    int64_t segment;
    bool open;     /* unsealed: any place */
    bool excluded; /* if it is sealed: by a condition and the ends of its column */
    struct place best;
};

struct search {
    sqlite3 *db;
    const struct find_query *query;
    struct term term[LIMIT_FILTERS_MAX + 1];
    size_t terms, conditions; /* the sort's term, if any, comes last */
    struct place after;       /* the cursor */
    struct zone *zone;
    size_t zones;
    struct places places;
    struct stmt states_row, column_row;
    struct column *column; /* of the term in turn */
    bool wanted[SEGMENT_JOBS];
};

/* -------------------------------------------------------------------- terms */

static enum store_status find_key(sqlite3 *db, struct term *term)
{
    struct stmt row = stmt_init(db, "SELECT id FROM job_keys WHERE path = :path");

    stmt_bind_text(&row, ":path", term->path);
    if (stmt_step(&row))
        term->key = stmt_integer(&row, 0);
    return stmt_fini(&row);
}

/* The column of a sealed segment in search->column_row; false = there is none. */
static bool step_column(struct search *search, const struct term *term, int64_t segment)
{
    struct stmt *row = &search->column_row;

    stmt_again(row);
    stmt_bind_integer(row, ":id", term->key << 32 | segment);
    return stmt_step(row);
}

/* The column of a sealed segment, with its news, in search->column. Texts are valid until the next
 * call. */
static void load_column(struct search *search, const struct term *term, int64_t segment)
{
    struct stmt *row = &search->column_row;
    size_t count = 0;
    const struct news *news = store_news_of(&term->news, segment, &count);

    column_clear(search->column);
    if (term->key > 0 && step_column(search, term, segment) &&
        !column_decode(search->column, sqlite3_column_blob(row->handle, 2),
                       (size_t)sqlite3_column_bytes(row->handle, 2)))
        row->status = store_fault(search->db, SQLITE_CORRUPT, "decode a column");
    for (size_t i = 0; i < count; i++)
        column_put(search->column, (size_t)news[i].job % SEGMENT_JOBS, &news[i].value);
}

/* ----------------------------------------------------------------- segments */

/* Strikes out the jobs that are not members of what conditions name; false when none is left. */
static bool narrow_to_members(struct search *search, int64_t segment)
{
    bool left = true;

    for (size_t i = 0; i < SEGMENT_JOBS; i++)
        search->wanted[i] = true;
    for (size_t i = 0; i < search->conditions && left; i++) {
        struct stmt *row = &search->term[i].members;
        bool member[SEGMENT_JOBS] = {false};

        if (!row->handle)
            continue;
        stmt_again(row);
        stmt_bind_text(row, ":value", search->query->conditions[i].value);
        stmt_bind_integer(row, ":first", segment << SEGMENT_BITS);
        stmt_bind_integer(row, ":last", (segment << SEGMENT_BITS) + SEGMENT_JOBS - 1);
        for (left = false; stmt_step(row); left = true)
            member[stmt_integer(row, 0) % SEGMENT_JOBS] = true;
        for (size_t k = 0; k < SEGMENT_JOBS; k++)
            search->wanted[k] = search->wanted[k] && member[k];
    }
    return left;
}

/* Strikes out the jobs that a condition refuses; false when none is left. */
static bool narrow(struct search *search, const struct test *test, const struct column *column)
{
    const struct scalar none = {.type = SCALAR_NONE};
    bool accepted[COLUMN_NONE + 1];
    int left = 0;

    for (size_t i = 0; i < column->count; i++)
        accepted[i] = test_accepts(test, &column->entry[i]);
    accepted[COLUMN_NONE] = test_accepts(test, &none);
    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        search->wanted[i] = search->wanted[i] && accepted[column->code[i]];
        left += search->wanted[i];
    }
    return left > 0;
}

/* Strikes out jobs that are not there, or in no state wanted; false when none is left. */
static bool choose(struct search *search, const char *states)
{
    bool accepted[256] = {false};
    int left = 0;

    for (int s = 0; s < JOB_STATES; s++)
        accepted[(unsigned char)job_state_name((enum job_state)s)[0]] =
            !search->query->states || search->query->states & 1U << s;
    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        search->wanted[i] = search->wanted[i] && accepted[(unsigned char)states[i]];
        left += search->wanted[i];
    }
    return left > 0;
}

/* Which values of a column stand behind the end of the list already, whichever job has them. */
static void rule_out(const struct search *search, int64_t segment, const struct column *column,
                     bool behind[COLUMN_NONE + 1])
{
    struct place best = {.seq = (segment << SEGMENT_BITS) + SEGMENT_JOBS - 1};

    behind[COLUMN_NONE] = places_behind(&search->places, &best);
    for (size_t i = 0; i < column->count; i++) {
        best.value = column->entry[i];
        behind[i] = places_behind(&search->places, &best);
    }
}

/* Offers the jobs that are left, with their values of what is sorted by (NULL = seq alone). */
static enum store_status offer_all(struct search *search, int64_t segment,
                                   const struct column *column)
{
    bool behind[COLUMN_NONE + 1];

    if (column)
        rule_out(search, segment, column, behind);
    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        struct place place = {.seq = (segment << SEGMENT_BITS) + (int64_t)i};

        if (!search->wanted[i] || (column && behind[column->code[i]]))
            continue;
        if (column)
            place.value = column_get(column, i);
        if (!places_offer(&search->places, &place))
            return store_fault(search->db, SQLITE_NOMEM, "find jobs");
    }
    return STORE_OK;
}

static int place(const void *test, const struct scalar *value)
{
    return test_place(test, value);
}

/* The same in a sealed segment; the news prevail. */
static bool narrow_sealed(struct search *search, const struct term *term, int64_t segment)
{
    const struct test *test = &term->test;
    struct column_filter filter = {place, test, test->relation == FIND_OTHER};
    struct stmt *row = &search->column_row;
    bool before[SEGMENT_JOBS], any = term->key > 0 && step_column(search, term, segment);
    size_t count = 0;
    const struct news *news = store_news_of(&term->news, segment, &count);
    memcpy(before, search->wanted, sizeof before);
    if (any) {
        struct scalar least = store_news_scalar(row->handle, 0),
                      most = store_news_scalar(row->handle, 1);

        any = test_may_accept(test, &least, &most);
    }
    if (!any && !filter.negate)
        memset(search->wanted, false, sizeof search->wanted);
    else if (any &&
             !column_narrow(sqlite3_column_blob(row->handle, 2),
                            (size_t)sqlite3_column_bytes(row->handle, 2), &filter, search->wanted))
        row->status = store_fault(search->db, SQLITE_CORRUPT, "decode a column");
    for (size_t i = 0; i < count; i++) {
        size_t job = (size_t)news[i].job % SEGMENT_JOBS;

        search->wanted[job] = before[job] && test_accepts(test, &news[i].value);
    }
    return memchr(search->wanted, true, SEGMENT_JOBS) != NULL;
}

static enum store_status visit_sealed(struct search *search, int64_t segment)
{
    bool left = true;

    for (size_t i = 0; i < search->conditions && left; i++)
        left = search->term[i].members.handle || narrow_sealed(search, &search->term[i], segment);
    if (left && search->query->sort)
        load_column(search, &search->term[search->conditions], segment);
    if (search->column_row.status || !left)
        return search->column_row.status;
    return offer_all(search, segment, search->query->sort ? search->column : NULL);
}

/* Looks at the jobs themselves; values of finished ones are in the news. */
static enum store_status visit_open(struct search *search, int64_t segment)
{
    struct gathered gathered = {.closed = true};
    struct column *sorted_by = NULL;
    char states[SEGMENT_JOBS];
    enum store_status status = STORE_OK;
    bool left;

    for (size_t i = 0; i < search->terms && status == STORE_OK; i++)
        if (!gathered_add(&gathered, search->term[i].same == i ? search->term[i].path : ""))
            status = store_fault(search->db, SQLITE_NOMEM, "find jobs");
    if (status == STORE_OK)
        status = store_segment_gather(search->db, segment, &gathered, states);
    left = status == STORE_OK && choose(search, states);
    for (size_t i = 0; i < search->terms && left; i++) {
        const struct term *term = &search->term[i];
        size_t count;
        const struct news *news = store_news_of(&term->news, segment, &count);

        sorted_by = gathered.key[term->same].column;
        for (size_t k = 0; k < count && term->same == i; k++)
            column_put(sorted_by, (size_t)news[k].job % SEGMENT_JOBS, &news[k].value);
        left = i >= search->conditions || term->members.handle ||
               narrow(search, &term->test, sorted_by);
    }
    if (left)
        status = offer_all(search, segment, search->query->sort ? sorted_by : NULL);
    gathered_fini(&gathered);
    return status;
}

static enum store_status visit(struct search *search, const struct zone *zone)
{
    struct stmt *row = &search->states_row;
    int64_t segment = zone->segment;
    const char *states = NULL;
    bool sealed;

    stmt_again(row);
    stmt_bind_integer(row, ":segment", segment);
    sealed = stmt_step(row);
    if (row->status || (sealed && zone->excluded) || !narrow_to_members(search, segment))
        return row->status;
    if (!sealed)
        return visit_open(search, segment);
    if (sqlite3_column_bytes(row->handle, 0) == SEGMENT_JOBS)
        states = (const char *)sqlite3_column_text(row->handle, 0);
    if (!states)
        return store_fault(search->db, SQLITE_CORRUPT, "states of a segment");
    return choose(search, states) ? visit_sealed(search, segment) : STORE_OK;
}

/* -------------------------------------------------------------------- zones */

static int compare_zones(const void *a, const void *b, void *context)
{
    const struct zone *x = a, *y = b;

    return x->open != y->open ? y->open - x->open : places_compare(context, &x->best, &y->best);
}

static enum store_status count_segments(struct search *search)
{
    struct stmt row = stmt_init(search->db, "SELECT coalesce(max(seq), -1) >> 10 FROM jobs");
    enum store_status status;

    if (stmt_step(&row))
        search->zones = (size_t)(stmt_integer(&row, 0) + 1);
    status = stmt_fini(&row);
    if (status == STORE_OK)
        search->zone = calloc(search->zones + 1, sizeof *search->zone);
    if (status == STORE_OK && !search->zone)
        status = store_fault(search->db, SQLITE_NOMEM, "find jobs");
    return status;
}

/* The zone becomes at least as good as this value. */
static void improve(struct search *search, int64_t segment, const struct scalar *value)
{
    struct scalar *best = &search->zone[segment].best.value;

    if (scalar_compare(value, best, !search->query->ascending) < 0)
        *best = *value;
}

#define COLUMNS_OF_KEY                                                                             \
    "SELECT id & 0xffffffff, least, most FROM job_columns"                                         \
    " WHERE id BETWEEN :key << 32 AND (:key << 32) + 0xffffffff"

/* Ends of columns that are texts are not kept: such a zone is open. */
static enum store_status bound_zones(struct search *search)
{
    const struct term *term = &search->term[search->conditions];
    struct stmt row = stmt_init(search->db, "SELECT segment FROM job_segments");
    enum store_status status;
    size_t segment;

    for (size_t i = 0; i < search->zones; i++)
        search->zone[i].open = true;
    while (stmt_step(&row))
        if ((segment = (size_t)stmt_integer(&row, 0)) < search->zones)
            search->zone[segment].open = false;
    status = stmt_fini(&row);
    if (status)
        return status;
    row = stmt_init(search->db, COLUMNS_OF_KEY);
    stmt_bind_integer(&row, ":key", term->key);
    while (stmt_step(&row)) {
        struct scalar end = store_news_scalar(row.handle, search->query->ascending ? 1 : 2);

        segment = (size_t)stmt_integer(&row, 0);
        if (segment < search->zones && end.type == SCALAR_NONE)
            search->zone[segment].open = true;
        else if (segment < search->zones)
            improve(search, (int64_t)segment, &end);
    }
    for (size_t i = 0; i < term->news.count; i++) {
        const struct news *news = &term->news.items[i];

        if (news->job >> SEGMENT_BITS < (int64_t)search->zones)
            improve(search, news->job >> SEGMENT_BITS, &news->value);
    }
    return stmt_fini(&row);
}

/* Excludes segments by one condition: all that have no column, or one whose ends say that it cannot
 * have an accepted value, and no news. One pass over the ends of all costs less than looking them
 * up one by one. */
static enum store_status exclude(struct search *search, const struct term *term)
{
    struct stmt row = stmt_init(search->db, COLUMNS_OF_KEY);
    bool *may = calloc(search->zones + 1, sizeof *may);

    if (!may)
        row.status = store_fault(search->db, SQLITE_NOMEM, "find jobs");
    stmt_bind_integer(&row, ":key", term->key);
    while (stmt_step(&row)) {
        struct scalar least = store_news_scalar(row.handle, 1);
        struct scalar most = store_news_scalar(row.handle, 2);
        size_t segment = (size_t)stmt_integer(&row, 0);

        if (segment < search->zones)
            may[segment] = test_may_accept(&term->test, &least, &most);
    }
    for (size_t i = 0; may && i < term->news.count; i++)
        if (term->news.items[i].job >> SEGMENT_BITS < (int64_t)search->zones)
            may[term->news.items[i].job >> SEGMENT_BITS] = true;
    for (size_t i = 0; may && i < search->zones; i++)
        search->zone[i].excluded = search->zone[i].excluded || !may[i];
    free(may);
    return stmt_fini(&row);
}

static enum store_status exclude_all(struct search *search)
{
    enum store_status status = STORE_OK;

    for (size_t i = 0; i < search->conditions && status == STORE_OK; i++) {
        const struct term *term = &search->term[i];

        if (!term->members.handle && term->test.relation != FIND_OTHER)
            status = exclude(search, term);
    }
    return status;
}

/* Goes through the segments from the most to the least promising, as long as they promise
 * anything. */
static enum store_status visit_all(struct search *search)
{
    bool by_seq = !search->query->sort, oldest = by_seq && search->query->ascending;
    enum store_status status = count_segments(search);

    for (size_t i = 0; i < search->zones && status == STORE_OK; i++) {
        int64_t first = (int64_t)i << SEGMENT_BITS;

        search->zone[i] = (struct zone){.segment = (int64_t)i};
        search->zone[i].best.seq = oldest ? first : first + SEGMENT_JOBS - 1;
    }
    if (status == STORE_OK)
        status = exclude_all(search);
    if (status == STORE_OK && !by_seq)
        status = bound_zones(search);
    if (status == STORE_OK)
        qsort_r(search->zone, search->zones, sizeof search->zone[0], compare_zones,
                &search->places);
    for (size_t i = 0; i < search->zones && status == STORE_OK; i++) {
        const struct zone *zone = &search->zone[i];
        struct place worst = {.seq = zone->best.seq ^ (SEGMENT_JOBS - 1)};

        if (!zone->open && places_behind(&search->places, &zone->best))
            break;
        if (by_seq && search->query->cursor &&
            places_compare(&search->places, &worst, &search->after) <= 0)
            continue;
        status = visit(search, zone);
    }
    return status;
}

/* --------------------------------------------------------------------- page */

/* "diameter+": what a cursor belongs to. */
static char *print_sort(const struct find_query *query)
{
    char *sort = NULL;

    return asprintf(&sort, "%s%c", query->sort ? query->sort : "", query->ascending ? '+' : '-') < 0
               ? NULL
               : sort;
}

static enum store_status add_terms(struct search *search)
{
    const struct find_query *query = search->query;
    enum store_status status = STORE_OK;

    search->conditions = query->condition_count;
    search->terms = query->condition_count + (query->sort != NULL);
    for (size_t i = 0; i < search->terms && status == STORE_OK; i++) {
        struct term *term = &search->term[i];

        term->path = i < search->conditions ? query->conditions[i].path : query->sort;
        if (i < search->conditions && has_members(&query->conditions[i])) {
            term->path = "";
            term->members = stmt_init(search->db, members_sql[query->conditions[i].relation]);
            status = term->members.status;
        } else if (i < search->conditions) {
            term->test = test_make(&query->conditions[i]);
        }
        while (strcmp(search->term[term->same].path, term->path) != 0)
            term->same++;
        if (status == STORE_OK && *term->path)
            status = find_key(search->db, term);
        if (status == STORE_OK && term->key)
            status = store_news_load(search->db, term->key, &term->news);
    }
    return status;
}

static enum store_status make_page(struct search *search, const char *sort, struct find_page *page)
{
    const struct places *places = &search->places;
    size_t shown = places->found == places->room ? places->found - 1 : places->found;
    struct find_page made = {.records = calloc(shown + 1, sizeof *made.records)};
    int64_t *seqs = calloc(shown + 1, sizeof *seqs);
    enum store_status status = STORE_OK;

    places_sort(&search->places);
    if (shown < places->found)
        made.next = cursor_print(&places->heap[shown - 1], sort);
    if (!made.records || !seqs || (shown < places->found && !made.next))
        status = store_fault(search->db, SQLITE_NOMEM, "find jobs");
    for (size_t i = 0; i < shown && status == STORE_OK; i++)
        seqs[i] = places->heap[i].seq;
    if (status == STORE_OK)
        status = store_jobs_read(search->db, seqs, shown, made.records);
    if (status == STORE_OK)
        made.count = shown;
    free(seqs);
    if (status)
        find_page_fini(&made);
    else
        *page = made;
    return status;
}

static void search_fini(struct search *search)
{
    for (size_t i = 0; i < search->terms; i++)
        store_news_free(&search->term[i].news);
    if (search->after.value.type == SCALAR_TEXT)
        free((char *)search->after.value.text);
    places_fini(&search->places);
    free(search->zone);
    free(search->column);
}

/* All statements in one transaction: they see the same moment. */
static enum store_status run(struct search *search)
{
    enum store_status status;

    search->states_row =
        stmt_init(search->db, "SELECT states FROM job_segments WHERE segment = :segment");
    search->column_row =
        stmt_init(search->db, "SELECT least, most, bytes FROM job_columns WHERE id = :id");
    status = search->states_row.status ? search->states_row.status : search->column_row.status;
    if (status == STORE_OK)
        status = add_terms(search);
    if (status == STORE_OK)
        status = visit_all(search);
    stmt_fini(&search->states_row);
    stmt_fini(&search->column_row);
    for (size_t i = 0; i < search->terms; i++) {
        enum store_status members = stmt_fini(&search->term[i].members);

        status = status ? status : members;
    }
    return status;
}

enum store_status store_find(struct store *store, const struct find_query *query,
                             struct find_page *page)
{
    struct search search = {.query = query,
                            .places = {.descending = !query->ascending,
                                       .oldest_first = query->ascending && !query->sort}};
    char *sort = print_sort(query);
    enum store_status status = STORE_BROKEN;

    assert(query->condition_count <= LIMIT_FILTERS_MAX && query->limit > 0);
    search.column = malloc(sizeof *search.column);
    search.places.after = query->cursor ? &search.after : NULL;
    if (sort && search.column && places_init(&search.places, query->limit + 1))
        status = query->cursor && !cursor_parse(query->cursor, sort, &search.after) ? STORE_CONFLICT
                                                                                    : STORE_OK;
    if (status == STORE_OK) {
        search.db = store_read_begin(store);
        status = store_exec(search.db, "BEGIN");
        if (status == STORE_OK)
            status = run(&search);
        if (status == STORE_OK)
            status = make_page(&search, sort, page);
        if (!sqlite3_get_autocommit(search.db))
            store_exec(search.db, "ROLLBACK"); /* it only read */
        store_read_end(store, search.db);
    }
    search_fini(&search);
    free(sort);
    return status;
}

void find_page_fini(struct find_page *page)
{
    for (size_t i = 0; i < page->count; i++)
        job_record_fini(&page->records[i]);
    free(page->records);
    free(page->next);
    *page = (struct find_page){0};
}

enum store_status store_find_known(struct store *store, const char *path, bool *known)
{
    struct term term = {.path = path};
    sqlite3 *db = store_read_begin(store);
    enum store_status status = find_key(db, &term);

    store_read_end(store, db);
    *known = term.key > 0;
    return status;
}
