/* SPDX-License-Identifier: GPL-3.0-or-later
 * store_find.c - see store_find.h and store_segment.h. */
#include "store_find.h"

#include "limits.h"
#include "store_path.h"
#include "store_places.h"
#include "store_segment.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One scalar that is looked at: of a condition, or what is sorted by. */
struct term {
    const char *path;
    struct test test;
    size_t same;             /* the first term with this path, */
    struct path_index index; /* which alone has this loaded */
    struct stmt members;     /* FIND_TAGGED, FIND_SWEPT: the jobs of a segment that it names */
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
    bool sealed;
    bool open;     /* any place */
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
    struct stmt states_row;
    struct column_reader reader;
    bool wanted[SEGMENT_JOBS];
};

static const struct path_index *index_of(const struct search *search, const struct term *term)
{
    return &search->term[term->same].index;
}

/* ----------------------------------------------------------------- segments */

/* Strikes out the jobs that are not members of what conditions name; false when none is left. */
static bool narrow_to_members(struct search *search, int64_t segment)
{
    bool left = true;

    for (size_t i = 0; i < search->conditions && left; i++) {
        struct stmt *row = &search->term[i].members;
        bool member[SEGMENT_JOBS] = {false};

        if (!row->handle)
            continue;
        stmt_again(row);
        stmt_bind_text(row, ":value", search->query->conditions[i].value);
        stmt_bind_integer(row, ":first", segment << SEGMENT_BITS);
        stmt_bind_integer(row, ":last", (segment << SEGMENT_BITS) + SEGMENT_JOBS - 1);
        while (stmt_step(row))
            member[stmt_integer(row, 0) % SEGMENT_JOBS] = true;
        for (size_t k = 0; k < SEGMENT_JOBS; k++)
            search->wanted[k] = search->wanted[k] & member[k];
        left = memchr(search->wanted, true, SEGMENT_JOBS) != NULL;
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
    unsigned wanted = search->query->states;
    bool chosen[SEGMENT_JOBS] = {false};

    for (size_t i = 0; i < SEGMENT_JOBS && !wanted; i++)
        chosen[i] = states[i] != '-';
    for (int s = 0; s < JOB_STATES; s++) {
        char letter = job_state_name((enum job_state)s)[0];

        for (size_t i = 0; i < SEGMENT_JOBS && wanted & 1U << s; i++)
            chosen[i] = chosen[i] | (states[i] == letter);
    }
    for (size_t i = 0; i < SEGMENT_JOBS; i++)
        search->wanted[i] = search->wanted[i] & chosen[i];
    return memchr(search->wanted, true, SEGMENT_JOBS) != NULL;
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

/* The list as it is, and a segment whose jobs might join it. */
struct list_ends {
    const struct places *places;
    int64_t segment;
};

/* Where a value stands that is sorted by: 0 = between the cursor and the end of the list, if the
 * right job of the segment has it. */
static int place_in_list(const void *context, const struct scalar *value)
{
    const struct list_ends *ends = context;
    const struct places *places = ends->places;
    struct place place = {.value = *value, .seq = ends->segment << SEGMENT_BITS};

    if (places->after && places_compare(places, &place, places->after) <= 0)
        return places->descending ? 1 : -1;
    place.seq += SEGMENT_JOBS - 1; /* the first among equals */
    return !places_behind(places, &place) ? 0 : places->descending ? -1 : 1;
}

/* What the jobs of a segment are sorted by. */
struct sorted_by {
    const struct column_kept *column; /* NULL = none has it, but for the news */
    const struct news *news;          /* these prevail */
    size_t count;
};

/* Strikes out jobs that would stand beyond the ends of the list; false when none is left. */
static bool narrow_to_list(struct search *search, int64_t segment, const struct sorted_by *by)
{
    const struct scalar nothing = {.type = SCALAR_NONE};
    const struct list_ends ends = {&search->places, segment};
    bool none = place_in_list(&ends, &nothing) == 0, before[SEGMENT_JOBS];
    const struct column_filter filter = {place_in_list, &ends, .none = none};

    memcpy(before, search->wanted, sizeof before);
    if (!by->column && !none)
        memset(search->wanted, false, sizeof search->wanted);
    else if (by->column &&
             !column_narrow(by->column->bytes, by->column->size, &filter, search->wanted))
        search->reader.row.status = store_fault(search->db, SQLITE_CORRUPT, "decode a column");
    for (size_t i = 0; i < by->count; i++) {
        size_t job = (size_t)by->news[i].job % SEGMENT_JOBS;

        search->wanted[job] = before[job] && place_in_list(&ends, &by->news[i].value) == 0;
    }
    return !search->reader.row.status && memchr(search->wanted, true, SEGMENT_JOBS);
}

/* Offers the jobs that are left. */
static enum store_status offer_sorted(struct search *search, int64_t segment,
                                      const struct sorted_by *by)
{
    size_t news = 0;

    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        const bool *next = memchr(search->wanted + i, true, SEGMENT_JOBS - i);
        struct place place = {.value.type = SCALAR_NONE};

        if (!next)
            break;
        i = (size_t)(next - search->wanted);
        place.seq = (segment << SEGMENT_BITS) + (int64_t)i;
        while (news < by->count && by->news[news].job < place.seq)
            news++;
        if (news < by->count && by->news[news].job == place.seq)
            place.value = by->news[news].value;
        else if (by->column && !column_value(by->column->bytes, by->column->size, i, &place.value))
            return store_fault(search->db, SQLITE_CORRUPT, "decode a column");
        if (!places_offer(&search->places, &place))
            return store_fault(search->db, SQLITE_NOMEM, "find jobs");
    }
    return STORE_OK;
}

/* The states of a sealed segment's jobs; NULL with row->status. */
static const char *read_states(struct search *search, int64_t segment)
{
    struct stmt *row = &search->states_row;
    const char *states = NULL;

    stmt_again(row);
    stmt_bind_integer(row, ":segment", segment);
    if (stmt_step(row) && sqlite3_column_bytes(row->handle, 0) == SEGMENT_JOBS)
        states = (const char *)sqlite3_column_text(row->handle, 0);
    if (!states && !row->status)
        row->status = store_fault(search->db, SQLITE_CORRUPT, "states of a segment");
    return states;
}

/* By what other tables and the states say; then those that are left may join the list. */
static enum store_status join(struct search *search, int64_t segment, const struct sorted_by *by)
{
    const char *states;

    if (!narrow_to_members(search, segment))
        return STORE_OK;
    states = read_states(search, segment);
    if (!states || !choose(search, states))
        return search->states_row.status;
    return by ? offer_sorted(search, segment, by) : offer_all(search, segment, NULL);
}

/* Columns are at hand more often than the rest: they come first. */
static enum store_status visit_sealed(struct search *search, int64_t segment)
{
    const struct path_index *index = index_of(search, &search->term[search->conditions]);
    struct sorted_by by = {0};
    enum store_status status;
    bool left = true;

    for (size_t i = 0; i < search->conditions && left; i++) {
        const struct term *term = &search->term[i];

        left = term->members.handle || path_index_narrow(index_of(search, term), &search->reader,
                                                         &term->test, segment, search->wanted);
    }
    if (search->reader.row.status || !left)
        return search->reader.row.status;
    if (!search->query->sort)
        return join(search, segment, NULL);
    by.column = path_index_column(index, &search->reader, segment);
    by.news = store_news_of(&index->news, segment, &by.count);
    status = narrow_to_list(search, segment, &by) ? join(search, segment, &by) : STORE_OK;
    column_cache_release(by.column);
    return search->reader.row.status ? search->reader.row.status : status;
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
        const struct news *news = store_news_of(&index_of(search, term)->news, segment, &count);

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
    if (zone->sealed && zone->excluded)
        return STORE_OK;
    for (size_t i = 0; i < SEGMENT_JOBS; i++)
        search->wanted[i] = true;
    if (zone->sealed)
        return visit_sealed(search, zone->segment);
    return narrow_to_members(search, zone->segment) ? visit_open(search, zone->segment) : STORE_OK;
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

    if (stmt_step(&row))
        search->zones = (size_t)(stmt_integer(&row, 0) + 1);
    return stmt_fini(&row);
}

/* All segments, and which of them are sealed. */
static enum store_status list_zones(struct search *search)
{
    bool oldest = search->query->ascending && !search->query->sort;
    struct stmt row = {.status = STORE_OK};
    size_t segment;

    search->zone = calloc(search->zones + 1, sizeof *search->zone);
    if (!search->zone)
        return store_fault(search->db, SQLITE_NOMEM, "find jobs");
    for (size_t i = 0; i < search->zones; i++) {
        int64_t first = (int64_t)i << SEGMENT_BITS;

        search->zone[i] = (struct zone){.segment = (int64_t)i};
        search->zone[i].best.seq = oldest ? first : first + SEGMENT_JOBS - 1;
    }
    row = stmt_init(search->db, "SELECT segment FROM job_segments INDEXED BY job_segments_sealed");
    while (stmt_step(&row))
        if ((segment = (size_t)stmt_integer(&row, 0)) < search->zones)
            search->zone[segment].sealed = true;
    return stmt_fini(&row);
}

/* The zone becomes at least as good as this value. */
static void improve(struct search *search, int64_t segment, const struct scalar *value)
{
    struct scalar *best = &search->zone[segment].best.value;

    if (scalar_compare(value, best, !search->query->ascending) < 0)
        *best = *value;
}

/* Ends of columns that are texts are not kept: such a zone is open. */
static void bound_zones(struct search *search)
{
    const struct path_index *index = index_of(search, &search->term[search->conditions]);

    for (size_t i = 0; i < search->zones; i++) {
        const struct path_ends *ends = index->ends ? &index->ends[i] : NULL;
        struct zone *zone = &search->zone[i];

        zone->open = !zone->sealed;
        if (!ends || !ends->there)
            continue;
        if (ends->least.type == SCALAR_NONE || ends->most.type == SCALAR_NONE)
            zone->open = true;
        else
            improve(search, (int64_t)i, search->query->ascending ? &ends->least : &ends->most);
    }
    for (size_t i = 0; i < index->news.count; i++) {
        const struct news *news = &index->news.items[i];

        if (news->job >> SEGMENT_BITS < (int64_t)search->zones)
            improve(search, news->job >> SEGMENT_BITS, &news->value);
    }
}

/* Excludes segments by the ends of the columns that conditions look at. */
static void exclude(struct search *search)
{
    for (size_t i = 0; i < search->conditions; i++) {
        const struct term *term = &search->term[i];

        for (size_t k = 0; k < search->zones && !term->members.handle; k++)
            if (!path_index_may(index_of(search, term), &term->test, k))
                search->zone[k].excluded = true;
    }
}

/* Goes through the segments from the most to the least promising, as long as they promise
 * anything. */
static enum store_status visit_all(struct search *search)
{
    bool by_seq = !search->query->sort;
    enum store_status status = list_zones(search);

    if (status == STORE_OK)
        exclude(search);
    if (status == STORE_OK && !by_seq)
        bound_zones(search);
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
        if (status == STORE_OK && *term->path && term->same == i)
            status = path_index_load(&term->index, search->db, term->path, search->zones);
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
        path_index_fini(&search->term[i].index);
    if (search->after.value.type == SCALAR_TEXT)
        free((char *)search->after.value.text);
    places_fini(&search->places);
    free(search->zone);
}

/* All statements in one transaction: they see the same moment. */
static enum store_status run(struct search *search, struct column_cache *cache)
{
    enum store_status status, end;

    search->states_row =
        stmt_init(search->db, "SELECT states FROM job_segments WHERE segment = :segment");
    search->reader = column_reader_init(search->db, cache);
    status = search->states_row.status ? search->states_row.status : search->reader.row.status;
    if (status == STORE_OK)
        status = count_segments(search);
    if (status == STORE_OK)
        status = add_terms(search);
    if (status == STORE_OK)
        status = visit_all(search);
    stmt_fini(&search->states_row);
    end = column_reader_fini(&search->reader);
    status = status ? status : end;
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
    search.places.after = query->cursor ? &search.after : NULL;
    if (sort && places_init(&search.places, query->limit + 1))
        status = query->cursor && !cursor_parse(query->cursor, sort, &search.after) ? STORE_CONFLICT
                                                                                    : STORE_OK;
    if (status == STORE_OK) {
        search.db = store_read_begin(store);
        status = store_exec(search.db, "BEGIN");
        if (status == STORE_OK)
            status = run(&search, store->columns);
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
    int64_t key = 0;
    sqlite3 *db = store_read_begin(store);
    enum store_status status = path_key(db, path, &key);

    store_read_end(store, db);
    *known = key > 0;
    return status;
}
