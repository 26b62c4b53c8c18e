/* SPDX-License-Identifier: GPL-3.0-or-later
 * Blobs are sealed with a checksum, which no fuzzer finds: what comes from it is the body, sealed
 * here. */
#include "fuzz.h"

#include "blob.h"
#include "bcd.h"
#include "plot_svg.h"
#include "scene_json.h"
#include "store_column.h"
#include "store_cursor.h"
#include "table_csv.h"
#include "table_json.h"
#include "text.h"

#include <math.h>
#include <string.h>

static const char job[] =
    "{\"particles\":3,\"length\":6,\"diameter\":0.5,\"time\":1,\"time_step\":0.01,"
    "\"realizations\":3,\"stability\":\"ignored\",\"initial\":\"uniform\","
    "\"potential\":{\"type\":\"cosine\",\"amplitude\":2},\"observables\":{\"energy\":{},"
    "\"msd\":{\"points\":4},\"cluster_sizes\":{},\"density\":{\"bins\":4},"
    "\"trajectory\":{\"every\":0.2}}}";

static struct bcd_scene *make_scene(void)
{
    struct bcd_scene *scene = NULL;
    struct bcd_errors errors = {0};
    enum bcd_status status = scene_json_parse(job, sizeof(job) - 1, &scene, &errors);
    if (status != BCD_OK)
        fprintf(stderr, "%s: %s\n", errors.items[0].field, errors.items[0].text);
    FUZZ_CHECK(status == BCD_OK);
    return scene;
}

/* As much of the body as there is, over that of a sound blob, with the right checksum. */
static void put_body(void *blob, size_t blob_size, const uint8_t *data, size_t size)
{
    uint32_t kind;
    uint64_t identity;
    memcpy(&kind, (char *)blob + 8, sizeof(kind));
    memcpy(&identity, (char *)blob + 16, sizeof(identity));
    size_t room = blob_size - BLOB_HEADER_SIZE;
    memcpy((char *)blob + BLOB_HEADER_SIZE, data, size < room ? size : room);
    blob_seal(blob, (enum blob_kind)kind, identity, blob_size);
}

/* A checkpoint is a run's memory, which only its checksum vouches for. Its bytes as they come are
 * what is to be refused; changed ones with a sound checksum never were a checkpoint. */
static void restore_checkpoint(const uint8_t *data, size_t size)
{
    struct bcd_scene *scene = make_scene();
    struct bcd_run *run = NULL;
    struct bcd_error error = {0};
    FUZZ_CHECK(bcd_run_create(&run, scene, 0, NULL) == BCD_OK);
    FUZZ_CHECK(bcd_run_advance(run, 7, NULL) == BCD_OK);
    int64_t done = bcd_run_ticks_done(run);
    size_t needed = bcd_run_checkpoint_size(run);
    char *blob = malloc(needed), *after = malloc(needed);
    FUZZ_CHECK(blob && after);
    bcd_run_save(run, blob);
    /* data: a place, and what to put there */
    size_t at = size > 1 ? ((size_t)data[0] << 8 | data[1]) % needed : 0;
    size_t count = size > 2 ? size - 2 : 0;
    count = count < needed - at ? count : needed - at;
    bool same = count == 0 || memcmp(blob + at, data + 2, count) == 0;
    if (count > 0)
        memcpy(blob + at, data + 2, count);
    enum bcd_status status = bcd_run_restore(run, blob, needed, &error);
    FUZZ_CHECK(status == (same ? BCD_OK : BCD_CORRUPT) && (same || error.text[0]));
    FUZZ_CHECK(bcd_run_restore(run, data, size, &error) == BCD_CORRUPT);
    /* Refused ones leave the run as it was. */
    FUZZ_CHECK(bcd_run_ticks_done(run) == done && bcd_run_advance(run, 5, NULL) == BCD_OK);
    bcd_run_save(run, after);
    FUZZ_CHECK(bcd_run_restore(run, after, needed, &error) == BCD_OK);
    free(after);
    free(blob);
    bcd_run_free(run);
    bcd_scene_free(scene);
}

static void show(const struct bcd_table *table)
{
    char *forms[] = {table_json_print(table), table_csv_print(table),
                     plot_svg_print(table, "title", NULL)};
    for (size_t i = 0; i < 3; i++)
        free(forms[i]);
}

/* A tally with any numbers, and the tables that come of it. */
static void restore_tally(const uint8_t *data, size_t size)
{
    struct bcd_scene *scene = make_scene();
    struct bcd_tally *tally = NULL;
    struct bcd_error error = {0};
    FUZZ_CHECK(bcd_tally_create(&tally, scene) == BCD_OK);
    FUZZ_CHECK(bcd_tally_restore(tally, data, size, &error) == BCD_CORRUPT);
    size_t needed = bcd_tally_size(tally);
    char *blob = malloc(needed);
    FUZZ_CHECK(blob);
    bcd_tally_save(tally, blob);
    put_body(blob, needed, data, size);
    if (bcd_tally_restore(tally, blob, needed, &error) == BCD_OK) {
        for (size_t i = 0; bcd_scene_part(scene, BCD_SLOT_OBSERVABLE, i); i++) {
            struct bcd_table *table = NULL;
            if (bcd_tally_table(tally, scene, NULL, i, &table) == BCD_OK)
                show(table);
            bcd_table_free(table);
        }
        bcd_tally_realizations(tally);
    }
    free(blob);
    bcd_tally_free(tally);
    bcd_scene_free(scene);
}

/* What is loaded can be shown, and saved again as it was. */
static void load_table(const uint8_t *data, size_t size)
{
    struct bcd_table *table = NULL;
    struct bcd_error error = {0};
    FUZZ_CHECK(bcd_table_load(&table, data, size, &error) == BCD_CORRUPT && !table);
    size_t needed = BLOB_HEADER_SIZE + size;
    char *blob = malloc(needed);
    FUZZ_CHECK(blob);
    memcpy(blob + BLOB_HEADER_SIZE, data, size);
    blob_seal(blob, BLOB_TABLE, 0, needed);
    enum bcd_status status = bcd_table_load(&table, blob, needed, &error);
    FUZZ_CHECK(status == BCD_OK || (status == BCD_CORRUPT && error.text[0]));
    if (status == BCD_OK) {
        show(table);
        size_t again = bcd_table_size(table);
        char *bytes = malloc(again);
        FUZZ_CHECK(bytes);
        bcd_table_save(table, bytes);
        struct bcd_table *same = NULL;
        FUZZ_CHECK(bcd_table_load(&same, bytes, again, &error) == BCD_OK);
        FUZZ_CHECK(same->rows == table->rows && same->columns == table->columns);
        bcd_table_free(same);
        free(bytes);
    }
    bcd_table_free(table);
    free(blob);
}

void fuzz_blob(const uint8_t *data, size_t size)
{
    if (size == 0)
        return;
    void (*const kinds[])(const uint8_t *, size_t) = {restore_checkpoint, restore_tally,
                                                      load_table};
    kinds[data[0] % 3](data + 1, size - 1);
}

/* ------------------------------------------------------------ what jobs are found by */

static int place(const void *context, const struct scalar *value)
{
    return scalar_compare(value, context, false);
}

/* One without any value is never kept, nor one with a number that is none, which has no place in an
 * order. */
static bool is_kept(const struct column *column)
{
    size_t i = 0;
    for (size_t k = 0; k < column->count; k++)
        if (column->entry[k].type == SCALAR_REAL && isnan(column->entry[k].real))
            return false;
    while (i < SEGMENT_JOBS && column->code[i] == COLUMN_NONE)
        i++;
    return i < SEGMENT_JOBS;
}

/* What is looked up is what is decoded, and the filter strikes out what it says. */
static void look_up(const struct column *column, const void *bytes, size_t size)
{
    const struct scalar seven = scalar_integer(7);
    for (int i = 0; i < 4; i++) {
        const struct column_filter filter = {place, &seven, .negate = i & 1, .none = i & 2};
        bool wanted[SEGMENT_JOBS];
        memset(wanted, true, sizeof(wanted));
        FUZZ_CHECK(column_narrow(bytes, size, &filter, wanted));
        for (size_t k = 0; k < SEGMENT_JOBS; k++) {
            struct scalar value = column_get(column, k), found;
            FUZZ_CHECK(column_value(bytes, size, k, &found) &&
                       scalar_compare(&value, &found, false) == 0);
            bool met = (place(&seven, &value) == 0) != filter.negate;
            FUZZ_CHECK(wanted[k] == (value.type == SCALAR_NONE ? filter.none : met));
        }
    }
}

static void read_column(const uint8_t *data, size_t size)
{
    static struct column column, again;
    struct scalar least, most, value, seven = scalar_integer(7);
    bool wanted[SEGMENT_JOBS];
    size_t encoded_size = 0;
    column_ends(data, size, &least, &most);
    column_value(data, size, SEGMENT_JOBS - 1, &value);
    for (int negate = 0; negate < 2; negate++) {
        memset(wanted, true, sizeof(wanted));
        column_narrow(data, size,
                      &(struct column_filter){.place = place, .context = &seven, .negate = negate},
                      wanted);
    }
    column_clear(&column);
    if (!column_decode(&column, data, size) || !is_kept(&column))
        return;
    void *encoded = column_encode(&column, &encoded_size);
    FUZZ_CHECK(encoded && column_decode(&again, encoded, encoded_size));
    for (size_t i = 0; i < SEGMENT_JOBS; i++) {
        struct scalar a = column_get(&column, i), b = column_get(&again, i);
        FUZZ_CHECK(scalar_compare(&a, &b, false) == 0); /* 5 and 5.0 are one */
    }
    look_up(&again, encoded, encoded_size);
    free(encoded);
}

/* "SORT\nCURSOR": one that is taken is printed as a cursor of the same place. */
static void read_cursor(const uint8_t *data, size_t size)
{
    char *text = fuzz_text(data, size), *cursor = strchr(text, '\n');
    struct place at = {0}, again = {0};
    if (cursor) {
        *cursor++ = '\0';
        if (cursor_parse(cursor, text, &at)) {
            char *printed = cursor_print(&at, text);
            FUZZ_CHECK(printed && cursor_parse(printed, text, &again));
            FUZZ_CHECK(at.seq == again.seq && at.value.type == again.value.type &&
                       scalar_compare(&at.value, &again.value, false) == 0);
            if (again.value.type == SCALAR_TEXT)
                free((char *)again.value.text);
            free(printed);
        }
        if (at.value.type == SCALAR_TEXT)
            free((char *)at.value.text);
    }
    free(text);
}

/* A place with a text or number of the fuzzer's is found again. */
static void write_cursor(const uint8_t *data, size_t size)
{
    char *text = fuzz_text(data, size);
    struct place at = {.value = scalar_parse(text), .seq = (int64_t)size}, again = {0};
    char *printed = cursor_print(&at, "-potential.type");
    FUZZ_CHECK(printed && cursor_parse(printed, "-potential.type", &again));
    FUZZ_CHECK(at.seq == again.seq && scalar_compare(&at.value, &again.value, false) == 0);
    struct place other = {0};
    FUZZ_CHECK(!cursor_parse(printed, "potential.type", &other));
    if (again.value.type == SCALAR_TEXT)
        free((char *)again.value.text);
    free(printed);
    free(text);
}

void fuzz_index(const uint8_t *data, size_t size)
{
    if (size == 0)
        return;
    void (*const kinds[])(const uint8_t *, size_t) = {read_column, read_cursor, write_cursor};
    kinds[data[0] % 3](data + 1, size - 1);
}
