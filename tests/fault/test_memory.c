/* SPDX-License-Identifier: GPL-3.0-or-later
 * The n-th allocation fails, for every n, alone or with all that follow: whatever was asked for
 * says that there is no memory, or does without and gives what it always does. Nothing is lost or
 * left. */
#include "short_memory.h"

#include "server/http_client.h"
#include "server/stage.h"

#include "limits.h"
#include "plot_svg.h"
#include "scene_json.h"
#include "sweep_json.h"
#include "table_csv.h"
#include "table_json.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { ALLOCATIONS_MAX = 200000, WAIT_MS = 5000 };

/* Something that needs memory. True = done, and the same as ever; false = said that there is none.
 */
typedef bool attempt(void *context);

enum { ON = 1, WARM = 2 }; /* all that follow fail, too; all that is made once is made before */

/* Tries with every allocation failing in turn, until none is left to fail. A statement of SQL that
 * failed is made anew: `warm` has all that is made once made each time, for what follows it. */
static void try_each(const char *what, attempt *attempted, void *context, int mode)
{
    bool on = mode & ON, warm = mode & WARM, failed = true;
    long blocks = short_memory_blocks(), refused = 0, n = 0;
    while (failed) {
        assert_true(++n < ALLOCATIONS_MAX);
        if (warm)
            assert_true(attempted(context));
        short_memory_begin(n, on);
        bool done = attempted(context);
        failed = short_memory_end();
        refused += !done;
        if (!done && !failed)
            fail_msg("%s: refused although allocation %ld does not fail", what, n);
        if (short_memory_blocks() != blocks)
            fail_msg("%s: allocation %ld failed, %ld blocks are left", what, n,
                     short_memory_blocks() - blocks);
    }
    print_message("# %s: %ld allocations, %ld of them needed\n", what, n - 1, refused);
    assert_true(n > 1 && refused > 0);
}

enum needs {
    PLAIN, /* nothing but memory */
    READS, /* JSON, too, whose library (2.14) fails an assertion where its lexer lacks memory twice
            */
    KEEPS, /* statements of SQL, too */
    KEEPS_AND_READS,
};

static void try_all(const char *what, attempt *attempted, void *context, enum needs needs)
{
    bool reads = needs == READS || needs == KEEPS_AND_READS;
    assert_true(attempted(context)); /* what is made once is made */
    try_each(what, attempted, context, 0);
    if (needs == KEEPS || needs == KEEPS_AND_READS)
        try_each(what, attempted, context, reads ? WARM : WARM | ON);
    else if (!reads)
        try_each(what, attempted, context, ON);
}

/* ----------------------------------------------------------------------- engine */

#define SMALL                                                                                      \
    "{\"particles\":4,\"length\":8,\"diameter\":0.5,\"time\":0.2,\"time_step\":0.01,"              \
    "\"realizations\":2,\"stability\":\"ignored\",\"label\":\"x\",\"tags\":[\"a\",\"b\"],"         \
    "\"potential\":{\"type\":\"expression\",\"energy\":\"2*cos(pi*x)\",\"period\":2},"             \
    "\"interaction\":{\"type\":\"table\",\"first\":0,\"last\":1,\"values\":[3,2,1,0]},"            \
    "\"observables\":{\"energy\":{},\"msd\":{\"points\":3,\"last\":0.1},\"density\":{\"bins\":4}," \
    "\"cluster_sizes\":{},\"trajectory\":{\"every\":0.1}}}"
#define EQUILIBRIUM                                                                                \
    "{\"particles\":3,\"length\":6,\"diameter\":0.5,\"time\":0.2,\"time_step\":0.01,"              \
    "\"initial\":\"equilibrium\",\"potential\":{\"type\":\"cosine\",\"amplitude\":2},"             \
    "\"observables\":{\"energy\":{},\"density\":{\"bins\":4}}}"

/* The encoding of a job that was parsed with memory enough. */
struct job {
    const char *text;
    unsigned char encoding[4096];
    size_t size;
};

static bool parse_job(void *context)
{
    struct job *job = context;
    struct bcd_scene *scene = NULL;
    struct ticket ticket = {.owner = "anna"};
    struct bcd_errors errors = {0};
    unsigned char encoding[sizeof(job->encoding)];
    enum bcd_status status =
        scene_json_parse_ticket(job->text, strlen(job->text), &scene, &ticket, &errors);
    if (status == BCD_OK) {
        size_t size = bcd_scene_encode(scene, encoding, sizeof(encoding));
        assert_in_range(size, 1, sizeof(encoding));
        if (job->size == 0)
            memcpy(job->encoding, encoding, job->size = size);
        assert_int_equal(size, job->size);
        assert_memory_equal(encoding, job->encoding, size);
    } else {
        if (status != BCD_NO_MEMORY)
            fail_msg("%s: %s", errors.items[0].field, errors.items[0].text);
        assert_null(scene);
    }
    ticket_fini(&ticket);
    bcd_scene_free(scene);
    return status == BCD_OK;
}

static void jobs_are_parsed(void **state)
{
    struct job small = {.text = SMALL}, equilibrium = {.text = EQUILIBRIUM};
    (void)state;
    try_all("a job", parse_job, &small, READS);
    try_all("its equilibrium", parse_job, &equilibrium, READS);
    struct bcd_scene *scene = NULL;
    assert_int_equal(scene_json_complete(JOB(""), strlen(JOB("")), NULL, &scene, NULL), BCD_OK);
    char *completed = scene_json_job(scene);
    struct job stored = {.text = completed};
    try_all("a completed one", parse_job, &stored, READS);
    free(completed);
    bcd_scene_free(scene);
}

/* Text that was printed with memory enough; NULL = not yet. */
static bool same_text(char **expected, char *text)
{
    bool printed = text != NULL;
    if (printed && !*expected)
        *expected = strdup(text);
    if (printed)
        assert_string_equal(text, *expected);
    free(text);
    return printed;
}

struct whole_run {
    struct bcd_scene *scene;
    char *json, *csv, *svg, *job;
};

static enum bcd_status run_chunks(const struct whole_run *run, struct bcd_tally *tally)
{
    enum bcd_status status = BCD_OK;
    for (int64_t i = 0; status == BCD_OK && i < bcd_scene_chunks(run->scene); i++) {
        struct bcd_run *chunk = NULL;
        status = bcd_run_create(&chunk, run->scene, i, NULL);
        if (status == BCD_OK)
            status = bcd_run_advance(chunk, bcd_run_ticks_total(chunk), NULL);
        if (status == BCD_OK)
            bcd_tally_merge(tally, bcd_run_tally(chunk));
        bcd_run_free(chunk);
    }
    return status;
}

/* One table there and back, in all its forms. */
static bool show(struct whole_run *run, const struct bcd_table *table)
{
    struct bcd_table *loaded = NULL;
    size_t size = bcd_table_size(table);
    void *bytes = malloc(size);
    bool sound = bytes != NULL;
    if (sound) {
        bcd_table_save(table, bytes);
        enum bcd_status status = bcd_table_load(&loaded, bytes, size, NULL);
        assert_true(status == BCD_OK || status == BCD_NO_MEMORY);
        sound = status == BCD_OK;
    }
    sound = sound && same_text(&run->json, table_json_print(loaded));
    sound = sound && same_text(&run->csv, table_csv_print(loaded));
    sound = sound && same_text(&run->svg, plot_svg_print(loaded, "title", "small print"));
    bcd_table_free(loaded);
    free(bytes);
    return sound;
}

static bool run_job(void *context)
{
    struct whole_run *run = context;
    struct bcd_tally *tally = NULL;
    struct bcd_theory *theory = NULL;
    struct bcd_table *table = NULL;
    enum bcd_status status = bcd_tally_create(&tally, run->scene);
    if (status == BCD_OK)
        status = run_chunks(run, tally);
    if (status == BCD_OK)
        status = bcd_theory_create(&theory, run->scene, BCD_THEORY_RING, NULL, NULL);
    if (status == BCD_OK)
        status = bcd_tally_table(tally, run->scene, theory, 1, &table);
    assert_true(status == BCD_OK || status == BCD_NO_MEMORY);
    bool sound = status == BCD_OK && show(run, table);
    sound = sound && same_text(&run->job, scene_json_job(run->scene));
    bcd_table_free(table);
    bcd_theory_free(theory);
    bcd_tally_free(tally);
    return sound;
}

static void jobs_are_run(void **state)
{
    static const char *const texts[] = {SMALL, EQUILIBRIUM};
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        struct whole_run run = {0};
        struct bcd_errors errors = {0};
        assert_int_equal(scene_json_parse(texts[i], strlen(texts[i]), &run.scene, &errors), BCD_OK);
        try_all("a run", run_job, &run, PLAIN);
        bcd_scene_free(run.scene);
        free(run.json);
        free(run.csv);
        free(run.svg);
        free(run.job);
    }
}

/* ----------------------------------------------------------------------- sweeps */

/* FNV-1a over the encodings of all points: none may be another job for want of memory. */
static uint64_t add_encoding(uint64_t hash, const struct bcd_scene *scene)
{
    unsigned char bytes[4096];
    size_t size = bcd_scene_encode(scene, bytes, sizeof(bytes));
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ bytes[i]) * UINT64_C(0x100000001b3);
    return hash;
}

static bool walk_sweep(struct sweep *sweep, uint64_t *expected)
{
    uint64_t hash = 1;
    struct bcd_scene_cache *cache = NULL;
    struct sweep_walk *walk = sweep_walk_create(sweep, 0, sweep_points(sweep));
    size_t point, seen = 0;
    bool sound = walk && bcd_scene_cache_create(&cache) == BCD_OK;
    while (sound && sweep_walk_next(walk, &point)) {
        struct bcd_scene *scene = NULL;
        struct bcd_errors errors = {0};
        struct text text = {0};
        enum bcd_status status = sweep_walk_scene(walk, cache, &scene, &errors);
        assert_true(status == BCD_OK || status == BCD_NO_MEMORY);
        sweep_walk_add_place(walk, &text);
        sweep_walk_add_values(walk, &text);
        char *taken = text_take(&text);
        sound = status == BCD_OK && taken;
        hash = sound ? add_encoding(hash, scene) : 0;
        free(taken);
        bcd_scene_free(scene);
        seen++;
    }
    assert_true(!sound || seen == 8);
    if (sound && *expected == 0)
        *expected = hash;
    assert_true(!sound || hash == *expected);
    bcd_scene_cache_free(cache);
    sweep_walk_free(walk);
    return sound;
}

static bool parse_sweep(void *context)
{
    static const char text[] =
        "{\"base\":" EQUILIBRIUM ",\"axes\":{\"/diameter\":[0.25,0.5],\"/seed\":{\"first\":1,"
        "\"count\":2},\"/potential\":[null,{\"type\":\"cosine\",\"amplitude\":1}]}}";
    static const char more[] = "{\"axes\":{\"/diameter\":[0.3]}}";
    struct sweep *sweep = NULL, *again = NULL;
    struct ticket ticket = {.owner = "anna"};
    struct bcd_errors errors = {0};
    enum bcd_status status = sweep_json_parse(text, sizeof(text) - 1, &sweep, &ticket, &errors);
    if (status != BCD_OK && status != BCD_NO_MEMORY)
        fail_msg("%s: %s", errors.items[0].field, errors.items[0].text);
    assert_true((status == BCD_OK) == (sweep != NULL));
    bool sound = status == BCD_OK && walk_sweep(sweep, context);
    char *base = sound ? sweep_json_base(sweep) : NULL,
         *axes = base ? sweep_json_axes(sweep) : NULL;
    char *zip = axes ? sweep_json_zip(sweep) : NULL;
    if (zip)
        again = sweep_json_restore(base, axes, zip);
    sound = again != NULL;
    if (sound) {
        status = sweep_json_extend(again, more, sizeof(more) - 1, &errors);
        assert_true(status == BCD_OK || status == BCD_NO_MEMORY);
        sound = status == BCD_OK;
        assert_true(!sound || sweep_points_new(again) == 4);
    }
    free(base);
    free(axes);
    free(zip);
    sweep_free(again);
    sweep_free(sweep);
    ticket_fini(&ticket);
    return sound;
}

static void sweeps_are_read(void **state)
{
    uint64_t expected = 0;
    (void)state;
    try_all("a sweep", parse_sweep, &expected, READS);
}

/* ---------------------------------------------------------------------- requests */

struct asked {
    struct stage *stage;
    const char *method, *path, *body;
    int status;
    char *answer; /* to the first; NULL = it may change */
};

/* The whole of a stream, up to where it waits; false = it failed. */
static bool drain(struct stream *stream)
{
    char piece[4096];
    ssize_t got = 0;
    for (int i = 0; i < 1000 && (got = stream->read(stream->state, piece, sizeof(piece))) > 0; i++)
        continue;
    return got == STREAM_END || got == STREAM_LATER;
}

static bool request(void *context)
{
    struct asked *asked = context;
    struct desk *desk = &asked->stage->desk;
    int status = ask(desk, asked->method, asked->path, asked->body);
    struct reply *reply = &desk->reply;
    bool done = status == asked->status && (!reply->stream.read || drain(&reply->stream));
    if (status != asked->status && status != 503 && status != 500)
        fail_msg("%s %s: %d %s", asked->method, asked->path, status, reply->body);
    if (done && asked->answer && strcmp(reply->body, asked->answer) != 0) {
        size_t at = 0;
        while (reply->body[at] == asked->answer[at])
            at++;
        fail_msg("%s: \"%.80s\" in the place of \"%.80s\"", asked->path, reply->body + at,
                 asked->answer + at);
    }
    reply_fini(reply);
    *reply = (struct reply){0};
    return done;
}

static void requests_are_answered(void **state)
{
    static struct stage stage;
    static const struct {
        const char *method, *path, *body;
        int status;
        bool fixed, reads;
    } rows[] = {
        {"GET", "/v1/jobs/jdone", NULL, 200, true, false},
        {"GET", "/v1/jobs/jdone/results", NULL, 200, true, false},
        {"GET", "/v1/jobs/jdone/results/energy.csv", NULL, 200, true, false},
        {"GET", "/v1/jobs/jdone/results/energy.svg", NULL, 200, true, true},
        {"GET", "/v1/jobs", NULL, 200, true, false},
        {"POST", "/v1/estimate", SMALL, 200, false, true},
        {"POST", "/v1/jobs", JOB(""), 200, false, true}, /* it stands already */
        {"GET", "/v1/sweeps/sdone", NULL, 200, true, true},
        {"GET", "/v1/sweeps/sdone/results/energy", NULL, 200, false, true},
        {"GET", "/v1/sweeps/sdone/results/energy.npz", NULL, 200, false, true},
        {"GET", "/v1/me", NULL, 200, false, false},
        {"GET", "/v1/audit", NULL, 200, false, false},
        {"GET", "/v1/jobs/jnothing", NULL, 404, true, false},
        {"POST", "/v1/jobs", "{\"particles\":-1}", 422, true, true},
        {"DELETE", "/v1/sweeps/sdone", NULL, 200, false, true},
    };
    (void)state;
    stage_open(&stage);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        char *path = stage_with_ids(&stage, rows[i].path);
        struct asked asked = {&stage, rows[i].method, path, rows[i].body, rows[i].status, NULL};
        assert_int_equal(ask(&stage.desk, asked.method, path, asked.body), asked.status);
        if (rows[i].fixed)
            asked.answer = strdup(stage.desk.reply.body);
        reply_fini(&stage.desk.reply);
        stage.desk.reply = (struct reply){0};
        try_all(rows[i].path, request, &asked, rows[i].reads ? KEEPS_AND_READS : KEEPS);
        free(asked.answer);
        free(path);
    }
    stage_close(&stage);
}

/* A submission that failed is no job, or it is one: the next one finds out, and it is told once. */
static void submissions_are_whole(void **state)
{
    static struct stage stage;
    long n = 0;
    int seed = 100, status;
    (void)state;
    stage_open(&stage);
    do {
        char body[512];
        assert_true(++n < ALLOCATIONS_MAX);
        snprintf(body, sizeof(body), JOB(",\"seed\":%d"), ++seed);
        short_memory_begin(n, false);
        status = ask(&stage.desk, "POST", "/v1/jobs", body);
        if (!short_memory_end())
            break;
        if (status != 202 && status != 503 && status != 500)
            fail_msg("allocation %ld: %d %s", n, status, stage.desk.reply.body);
        int again = ask(&stage.desk, "POST", "/v1/jobs", body);
        assert_true(again == 200 || (again == 202 && status != 202));
    } while (true);
    assert_int_equal(status, 202);
    reply_fini(&stage.desk.reply);
    stage.desk.reply = (struct reply){0};
    stage_close(&stage);
    print_message("# a submission: %ld allocations\n", n - 1);
}

/* -------------------------------------------------------------------------- http */

static void greet(void *context, const struct request *request, struct reply *reply)
{
    (void)context;
    reply_text_take(reply, "text/plain", strdup(request->body_size > 3 ? "long" : "short"));
}

/* Answered as ever, with 503, or not at all: the connection is closed then. */
static void connections_are_served(void **state)
{
    static const char post[] =
        "POST /x?a=1&b=2 HTTP/1.1\r\n" CLIENT_HOST "Content-Length: 5\r\n\r\nhello";
    static char answer[CLIENT_ANSWER_SIZE];
    const struct http_options options = {.host = "127.0.0.1", .handler = greet};
    char reason[256];
    long n = 0;
    bool failed = true;
    (void)state;
    struct http *http = http_start(&options, reason, sizeof(reason));
    assert_non_null(http);
    while (failed) {
        assert_true(++n < 1000);
        short_memory_begin(n, false);
        int fd = client_dial(http);
        client_say(fd, post, sizeof(post) - 1);
        bool closed = client_listen(fd, answer, WAIT_MS);
        failed = short_memory_end();
        close(fd);
        assert_true(closed || strstr(answer, "long") || strstr(answer, "HTTP/1.1 503"));
        assert_true(failed || strstr(answer, "long"));
    }
    http_stop(http);
    print_message("# a connection: %ld allocations\n", n - 1);
    assert_true(n > 5);
}

int main(void)
{
    short_memory_init();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jobs_are_parsed),       cmocka_unit_test(jobs_are_run),
        cmocka_unit_test(sweeps_are_read),       cmocka_unit_test(requests_are_answered),
        cmocka_unit_test(submissions_are_whole), cmocka_unit_test(connections_are_served),
    };
    return cmocka_run_group_tests_name("memory", tests, NULL, NULL);
}
