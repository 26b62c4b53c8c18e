/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_worker.c - bcd worker: runs chunks of a server's jobs on this machine; see cli.h. What is run
 * is what the server would have run, to the same bits.
 *
 * One thread: between two slices of the run the clock is looked at, and every few seconds the
 * server told how far it is. A signal that ends programs sends the chunk back with its checkpoint.
 */
#include "cli_server.h"
#include "lease_json.h"
#include "limits.h"
#include "queue.h"
#include "scene_json.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
    IDLE_NAP_MS_MIN = 500, /* twice as long each time, */
    IDLE_NAP_MS_MAX = 4000,
    AWAY_MS_MAX = 60000,  /* a server that is not there may be starting */
    BEATS = 6,            /* heartbeats in the time that a lease holds */
    CHECKPOINT_BEATS = 2, /* every so many a checkpoint goes along */
    UNKNOWN_MAX = 4,      /* a server that has just started may not know us yet */
    SLICE_GROWTH_MAX = 4
};

/* A chunk in work. */
struct lent {
    const struct cli_line *line;
    struct client *client;
    struct lease_loan loan;
    struct bcd_scene *scene;
    struct bcd_run *run;
    struct bcd_error error;
    double began_cpu_s;
    int64_t beat_ms, beats; /* when the last was sent; how many */
    int unknown;
};

/* What became of it. */
enum fate { FATE_ENDED, FATE_LET_GO, FATE_STOPPED, FATE_FAILED };

static int64_t now_ms(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static double cpu_s(void)
{
    return (double)now_ms(CLOCK_PROCESS_CPUTIME_ID) / 1000;
}

/* ------------------------------------------------------------------ asking */

/* POST; CLI_OK and its answer, or the status without words. */
static enum client_status post(struct client *client, const char *path, char *body,
                               struct client_answer *answer)
{
    const struct client_request request = {
        .method = "POST", .path = path, .body = body, .body_size = body ? strlen(body) : 0};
    enum client_status status = body ? client_ask(client, &request, answer) : CLIENT_UNREACHABLE;
    free(body);
    return status;
}

static enum client_status tell(const struct lent *lent, struct client *client,
                               const struct lease_word *word, bool ended,
                               struct client_answer *answer)
{
    struct text path = {0};
    text_add(&path, "/v1/leases/%s/%s", lent->loan.id, ended ? "return" : "heartbeat");
    char *to = text_take(&path);
    enum client_status status =
        to ? post(client, to, lease_json_word(word, ended), answer) : CLIENT_UNREACHABLE;
    free(to);
    return status;
}

static struct lease_word word_of(const struct lent *lent)
{
    struct lease_word word = {.chunk = lent->loan.chunk,
                              .ticks_done = lent->run ? bcd_run_ticks_done(lent->run) : 0,
                              .ticks_total = lent->run ? bcd_run_ticks_total(lent->run) : 0,
                              .core_seconds = cpu_s() - lent->began_cpu_s};
    snprintf(word.job, sizeof word.job, "%s", lent->loan.job);
    return word;
}

static struct blob checkpoint_of(const struct lent *lent)
{
    struct blob blob = {.size = bcd_run_checkpoint_size(lent->run)};
    if (blob.size <= LIMIT_LEASE_BYTES_MAX)
        blob.bytes = malloc(blob.size + 1);
    if (blob.bytes)
        bcd_run_save(lent->run, blob.bytes);
    else
        blob.size = 0;
    return blob;
}

/* ------------------------------------------------------------- one chunk */

/* The scene and the run, where it was left if it was left anywhere. A beginning that does not fit
 * is left out: the bits are the same. */
static enum bcd_status prepare(struct lent *lent)
{
    const struct lease_loan *loan = &lent->loan;
    struct bcd_errors errors = {0};
    struct bcd_tally *tally = NULL;
    unsigned char hash[JOB_HASH_SIZE];
    enum bcd_status status =
        scene_json_parse(loan->scene, strlen(loan->scene), &lent->scene, &errors);
    if (status == BCD_INVALID)
        lent->error = errors.items[0];
    if (status != BCD_OK)
        return status;
    if (!queue_hash(lent->scene, hash))
        return BCD_NO_MEMORY;
    if (memcmp(hash, loan->hash, sizeof hash) != 0 ||
        loan->chunk >= bcd_scene_chunks(lent->scene)) {
        snprintf(lent->error.text, sizeof lent->error.text,
                 "this program would run another job than the server's");
        return BCD_INTERNAL;
    }
    status = bcd_run_create(&lent->run, lent->scene, loan->chunk, &lent->error);
    if (status == BCD_OK && loan->checkpoint.size > 0 &&
        bcd_run_restore(lent->run, loan->checkpoint.bytes, loan->checkpoint.size, NULL) != BCD_OK) {
        bcd_run_free(lent->run);
        lent->run = NULL;
        status = bcd_run_create(&lent->run, lent->scene, loan->chunk, &lent->error);
    } else if (status == BCD_OK && loan->checkpoint.size == 0 && loan->begun.size > 0) {
        status = bcd_tally_create(&tally, lent->scene);
        if (status == BCD_OK &&
            bcd_tally_restore(tally, loan->begun.bytes, loan->begun.size, NULL) == BCD_OK)
            bcd_run_continue(lent->run, tally, NULL);
        bcd_tally_free(tally);
    }
    return status;
}

/* Tells how far it is; false = there is no use in going on. A server that is away for a while, or
 * has just started, is no reason to stop. */
static bool beat(struct lent *lent)
{
    struct lease_word word = word_of(lent);
    struct client_answer answer = {0};
    if (lent->beats++ % CHECKPOINT_BEATS == 1)
        word.bytes = checkpoint_of(lent);
    enum client_status status = tell(lent, lent->client, &word, false, &answer);
    blob_fini(&word.bytes);
    lent->beat_ms = now_ms(CLOCK_MONOTONIC);
    if (status != CLIENT_OK)
        return true;
    struct answer *said = answer_json_load(answer.body, answer.size);
    const char *what = answer_json_text(said, "answer");
    bool unknown = !what || strcmp(what, "unknown") == 0;
    bool stop = what && strcmp(what, "stop") == 0;
    lent->unknown = unknown ? lent->unknown + 1 : 0;
    answer_json_free(said);
    client_answer_fini(&answer);
    return !stop && lent->unknown < UNKNOWN_MAX;
}

static enum fate advance(struct lent *lent)
{
    int64_t slice = 1, total = bcd_run_ticks_total(lent->run);
    lent->beat_ms = now_ms(CLOCK_MONOTONIC);
    while (bcd_run_ticks_done(lent->run) < total) {
        int64_t before = now_ms(CLOCK_MONOTONIC);
        if (!client_wait(lent->client, 0))
            return FATE_LET_GO;
        if (bcd_run_advance(lent->run, slice, &lent->error) != BCD_OK)
            return FATE_FAILED;
        int64_t took = now_ms(CLOCK_MONOTONIC) - before;
        slice = took < LIMIT_SLICE_MS / 2   ? slice * SLICE_GROWTH_MAX
                : took > LIMIT_SLICE_MS * 2 ? slice / 2 + 1
                                            : slice;
        if (slice > total)
            slice = total;
        if (now_ms(CLOCK_MONOTONIC) - lent->beat_ms >= lent->loan.lease_ms / BEATS && !beat(lent))
            return FATE_STOPPED;
    }
    return FATE_ENDED;
}

/* A result must arrive, whatever happens on the way; one that nobody waits for is no fault. */
static int give_back(struct lent *lent)
{
    const struct bcd_tally *tally = bcd_run_tally(lent->run);
    struct lease_word word = word_of(lent);
    struct client_answer answer = {0};
    struct client *second = NULL;
    int result = CLI_OK;
    word.bytes.size = bcd_tally_size(tally);
    word.bytes.bytes = malloc(word.bytes.size + 1);
    if (word.bytes.bytes)
        bcd_tally_save(tally, word.bytes.bytes);
    else
        word.bytes.size = 0;
    enum client_status status = tell(lent, lent->client, &word, true, &answer);
    if (status == CLIENT_SIGNAL && cli_server_open(lent->line, &second) == CLI_OK)
        status = tell(lent, second, &word, true, &answer); /* it was to end, not to lose its work */
    client_free(second);
    blob_fini(&word.bytes);
    if (status == CLIENT_OK && answer.status == 409)
        fprintf(stderr, "bcd worker: %.*s\n", (int)answer.size, answer.body);
    else if (status != CLIENT_OK || answer.status != 200)
        result = cli_server_fault(lent->line, lent->client, lent->loan.job, status, &answer);
    client_answer_fini(&answer);
    return result;
}

/* The last word about a chunk that is not ended here, by a client that the signal has not ended. */
static void let_go(struct lent *lent, const char *failed)
{
    struct lease_word word = word_of(lent);
    struct client_answer answer = {0};
    struct client *client = NULL;
    if (cli_server_open(lent->line, &client) != CLI_OK)
        return;
    word.let_go = !failed;
    word.failed = failed ? strdup(failed) : NULL;
    if (lent->run && !failed)
        word.bytes = checkpoint_of(lent);
    client_patience(client, 5000);
    if (tell(lent, client, &word, false, &answer) == CLIENT_OK)
        client_answer_fini(&answer);
    lease_word_fini(&word);
    client_free(client);
}

static int run_chunk(struct lent *lent)
{
    int result = CLI_OK;
    lent->began_cpu_s = cpu_s();
    enum bcd_status status = prepare(lent);
    enum fate fate = status == BCD_OK          ? advance(lent)
                     : status == BCD_NO_MEMORY ? FATE_LET_GO
                                               : FATE_FAILED;
    if (fate == FATE_ENDED)
        result = give_back(lent);
    else if (fate == FATE_LET_GO)
        let_go(lent, NULL);
    else if (fate == FATE_FAILED)
        let_go(lent, lent->error.text[0] ? lent->error.text : "the run failed");
    bcd_run_free(lent->run);
    bcd_scene_free(lent->scene);
    return status == BCD_NO_MEMORY ? CLI_FAILED : result;
}

/* --------------------------------------------------------------- the loop */

/* CLI_OK: a chunk was run, or *idle. `patient`: a server that is not there counts as one that has
 * nothing to do. */
static int turn(const struct cli_line *line, struct client *client, const char *name, bool *idle,
                bool patient)
{
    struct lent lent = {.line = line, .client = client};
    struct client_answer answer = {0};
    struct bcd_errors errors = {0};
    int result = CLI_OK;
    enum client_status status = post(client, "/v1/leases", lease_json_request(name), &answer);
    if (status != CLIENT_OK || answer.status != 200) {
        if (status != CLIENT_SIGNAL && !(status == CLIENT_UNREACHABLE && patient))
            result = cli_server_fault(line, client, NULL, status, &answer);
    } else if (!lease_json_read_loan(answer.body, answer.size, &lent.loan, &errors)) {
        fprintf(stderr, "bcd worker: what the server lends cannot be read\n");
        result = CLI_FAILED;
    }
    client_answer_fini(&answer);
    *idle = !lent.loan.id[0];
    if (!*idle && result == CLI_OK)
        result = run_chunk(&lent);
    lease_loan_fini(&lent.loan);
    return result;
}

static int worker(const struct cli_line *line)
{
    char host[40] = "", name[LEASE_WORKER_SIZE];
    const char *idle_text = cli_value(line, "idle"), *given = cli_value(line, "name");
    struct client *client = NULL;
    int64_t idle_s = INT64_MAX / 1000, chunks = 0;
    if (idle_text && !cli_parse_integer(idle_text, 0, 1000000, &idle_s))
        return cli_wrong(line->command, "--idle is 0 to 1000000 seconds, not \"%s\"", idle_text);
    if (given && strlen(given) >= sizeof name)
        return cli_wrong(line->command, "--name is too long: \"%s\"", given);
    gethostname(host, sizeof host - 1);
    snprintf(name, sizeof name, "%s:%ld", host, (long)getpid());
    int status = cli_server_open(line, &client);
    int64_t busy_ms = now_ms(CLOCK_MONOTONIC), nap_ms = IDLE_NAP_MS_MIN;
    bool goes_on = status == CLI_OK;
    while (goes_on) {
        bool idle = false;
        int64_t now = now_ms(CLOCK_MONOTONIC);
        status = turn(line, client, given ? given : name, &idle, now - busy_ms < AWAY_MS_MAX);
        now = now_ms(CLOCK_MONOTONIC);
        if (!idle)
            busy_ms = now;
        chunks += !idle && status == CLI_OK;
        nap_ms = !idle ? IDLE_NAP_MS_MIN : nap_ms < IDLE_NAP_MS_MAX ? 2 * nap_ms : nap_ms;
        goes_on = status == CLI_OK && now - busy_ms <= 1000 * idle_s &&
                  client_wait(client, idle ? nap_ms : 0);
    }
    /* Ended by a signal it has done what it was for. */
    if (client)
        printf("%" PRId64 " chunk%s run\n", chunks, chunks == 1 ? "" : "s");
    client_free(client);
    return status;
}

static const struct cli_option options[] = {
    {.name = "idle", .value = "SECONDS", .doc = "ends when there was nothing to do for so long"},
    {.name = "name", .value = "NAME", .doc = "what the server's log calls it (default: HOST:PID)"},
    {0},
};

const struct cli_command cli_worker_command = {
    .name = "worker",
    .operands = "",
    .doc = "runs chunks of a server's jobs on this machine",
    .text = "One at a time, on one core: start as many as there are. The server must have been\n"
            "started with --backend workers or slurm, and the token be one of role worker. The\n"
            "results are the server's own, bit for bit. Ctrl-C or SIGTERM sends the chunk back\n"
            "with a checkpoint, and another worker goes on there.",
    .options = options,
    .server = true,
    .function = worker,
};
