/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * cli_worker.c - bcd worker: runs chunks of a server's jobs on this machine; see cli.h. What is run
 * is what the server would have run, to the same bits.
 *
 * One thread: between two slices of the run the clock is looked at, and every few seconds the
 * server told how far it is. A signal that ends programs sends the chunk back with its checkpoint.
 */
#include "limits.h"
#include "queue.h"
#include "scene_json.h"
#include "worker_link.h"

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
    struct link *link;
    struct lease_loan loan;
    struct bcd_scene *scene;
    struct bcd_run *run;
    struct bcd_watch watch; /* over all that the engine does for it */
    struct bcd_error error;
    double began_cpu_s;
    int64_t beat_ms, beats; /* when the last was sent; how many */
    int unknown;
    bool unwanted; /* said the server */
    bool ended;    /* and given back */
};

/* What became of it. */
enum fate {
    FATE_ENDED,
    FATE_LET_GO,   /* by a signal, or for want of memory: others may go on with it */
    FATE_UNWANTED, /* cancelled, or somebody else's */
    FATE_FAILED,   /* and so has the job */
    FATE_STRANGE,  /* this program is none for it: others may be */
};

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

/* -------------------------------------------------------------- heartbeats */

static struct lease_word word_of(const struct lent *lent)
{
    struct lease_word word = {.chunk = lent->loan.chunk,
                              .ticks_done = lent->run ? bcd_run_ticks_done(lent->run) : 0,
                              .ticks_total = lent->run ? bcd_run_ticks_total(lent->run) : 0,
                              .core_seconds = cpu_s() - lent->began_cpu_s};
    snprintf(word.job, sizeof word.job, "%s", lent->loan.job);
    return word;
}

/* Of a run that was not stopped in the middle of something. */
static struct blob checkpoint_of(const struct lent *lent)
{
    struct blob blob = {.size = bcd_run_checkpoint_size(lent->run)};
    if (blob.size <= LIMIT_LEASE_BYTES_MAX && lent->watch.end == BCD_WATCH_GOES_ON)
        blob.bytes = malloc(blob.size + 1);
    if (blob.bytes)
        bcd_run_save(lent->run, blob.bytes);
    else
        blob.size = 0;
    return blob;
}

/* Tells how far it is, if that is due; with a checkpoint, between two slices. A server that is away
 * for a while, or has just started, is no reason to stop. */
static void beat(struct lent *lent, bool between)
{
    if (now_ms(CLOCK_MONOTONIC) - lent->beat_ms < lent->loan.lease_ms / BEATS)
        return;
    struct lease_word word = word_of(lent);
    if (lent->beats++ % CHECKPOINT_BEATS == 1 && between)
        word.bytes = checkpoint_of(lent);
    enum link_status status = link_tell(lent->link, &lent->loan, &word, false);
    blob_fini(&word.bytes);
    lent->beat_ms = now_ms(CLOCK_MONOTONIC);
    if (status == LINK_UNKNOWN)
        lent->unknown++;
    else if (status == LINK_OK)
        lent->unknown = 0;
    lent->unwanted = status == LINK_STOP || lent->unknown >= UNKNOWN_MAX;
}

static bool over_time(const struct lent *lent)
{
    double most = lent->loan.core_seconds_max;
    return most > 0 && cpu_s() - lent->began_cpu_s > most;
}

/* The engine's question, in the middle of something. */
static bool ask_stop(void *context)
{
    struct lent *lent = context;
    beat(lent, false);
    return lent->unwanted || !link_wait(lent->link, 0) || over_time(lent);
}

/* --------------------------------------------------------------- one chunk */

/* What the engine says, and why it stopped if it was told to. */
static enum fate fate_of(struct lent *lent, enum bcd_status status)
{
    if (lent->unwanted)
        return FATE_UNWANTED;
    if (status == BCD_NO_MEMORY || !link_wait(lent->link, 0))
        return FATE_LET_GO;
    if (!lent->error.code)
        lent->error.code = status;
    if (over_time(lent))
        snprintf(lent->error.text, sizeof lent->error.text,
                 "this part of it has used more than %.3g core seconds (LIMIT_OVERRUN_FACTOR, "
                 "LIMIT_OVERRUN_SECONDS)",
                 lent->loan.core_seconds_max);
    return FATE_FAILED;
}

/* What the server took must be the same job here. */
static enum fate read_scene(struct lent *lent)
{
    const struct lease_loan *loan = &lent->loan;
    struct bcd_errors errors = {0};
    unsigned char hash[JOB_HASH_SIZE];
    enum bcd_status status =
        scene_json_complete(loan->scene, strlen(loan->scene), NULL, &lent->scene, &errors);
    if (status == BCD_NO_MEMORY || (status == BCD_OK && !queue_hash(lent->scene, hash)))
        return FATE_LET_GO;
    if (status != BCD_OK || memcmp(hash, loan->hash, sizeof hash) != 0 ||
        loan->chunk >= bcd_scene_chunks(lent->scene))
        return FATE_STRANGE;
    errors = (struct bcd_errors){0};
    status = bcd_scene_prepare(lent->scene, &lent->watch, &errors);
    if (status == BCD_OK)
        return FATE_ENDED;
    if (errors.count > 0)
        lent->error = errors.items[0];
    return fate_of(lent, status);
}

/* The run, where it was left if it was left anywhere. A beginning that does not fit is left out:
 * the bits are the same. */
static enum bcd_status create_run(struct lent *lent)
{
    const struct lease_loan *loan = &lent->loan;
    struct bcd_tally *tally = NULL;
    enum bcd_status status =
        bcd_run_create_watched(&lent->run, lent->scene, loan->chunk, &lent->watch, &lent->error);
    if (status == BCD_OK && loan->checkpoint.size > 0 &&
        bcd_run_restore(lent->run, loan->checkpoint.bytes, loan->checkpoint.size, NULL) != BCD_OK) {
        bcd_run_free(lent->run);
        lent->run = NULL;
        status = bcd_run_create_watched(&lent->run, lent->scene, loan->chunk, &lent->watch,
                                        &lent->error);
    } else if (status == BCD_OK && loan->checkpoint.size == 0 && loan->begun.size > 0) {
        status = bcd_tally_create(&tally, lent->scene);
        if (status == BCD_OK &&
            bcd_tally_restore(tally, loan->begun.bytes, loan->begun.size, NULL) == BCD_OK)
            bcd_run_continue(lent->run, tally, NULL);
        bcd_tally_free(tally);
    }
    return status;
}

static enum fate advance(struct lent *lent)
{
    int64_t slice = 1, total = bcd_run_ticks_total(lent->run);
    while (bcd_run_ticks_done(lent->run) < total) {
        int64_t before = now_ms(CLOCK_MONOTONIC);
        enum bcd_status status = bcd_run_advance(lent->run, slice, &lent->error);
        if (status != BCD_OK)
            return fate_of(lent, status);
        int64_t took = now_ms(CLOCK_MONOTONIC) - before;
        slice = took < LIMIT_SLICE_MS / 2   ? slice * SLICE_GROWTH_MAX
                : took > LIMIT_SLICE_MS * 2 ? slice / 2 + 1
                                            : slice;
        if (slice > total)
            slice = total;
        beat(lent, true);
        if (lent->unwanted || !link_wait(lent->link, 0) || over_time(lent))
            return fate_of(lent, BCD_STOPPED);
    }
    return FATE_ENDED;
}

/* A result must arrive, whatever happens on the way; one that nobody waits for is no fault. */
static int give_back(struct lent *lent)
{
    const struct bcd_tally *tally = bcd_run_tally(lent->run);
    struct lease_word word = word_of(lent);
    word.bytes.size = bcd_tally_size(tally);
    word.bytes.bytes = malloc(word.bytes.size + 1);
    if (!word.bytes.bytes)
        return CLI_FAILED;
    bcd_tally_save(tally, word.bytes.bytes);
    enum link_status status = link_return(lent->link, &lent->loan, &word);
    blob_fini(&word.bytes);
    return status == LINK_OK || status == LINK_NOTHING ? CLI_OK
                                                       : link_fault(lent->link, lent->loan.job);
}

/* The last word about a chunk that is not ended here. */
static void let_go(struct lent *lent, enum fate fate)
{
    struct lease_word word = word_of(lent);
    struct text words = {0};
    word.let_go = fate != FATE_FAILED;
    if (fate == FATE_FAILED) {
        text_add(&words, "%s%s%s", bcd_status_text(lent->error.code),
                 lent->error.text[0] ? ": " : "", lent->error.text);
        word.failed = text_take(&words);
    }
    if (lent->run && fate == FATE_LET_GO)
        word.bytes = checkpoint_of(lent);
    link_tell(lent->link, &lent->loan, &word, true); /* else it is given up in time */
    lease_word_fini(&word);
}

static int run_chunk(struct lent *lent)
{
    int result = CLI_OK;
    lent->began_cpu_s = cpu_s();
    lent->beat_ms = now_ms(CLOCK_MONOTONIC);
    lent->watch = (struct bcd_watch){
        .should_stop = ask_stop, .context = lent, .bytes_max = lent->loan.bytes_max};
    enum fate fate = read_scene(lent);
    if (fate == FATE_ENDED) {
        enum bcd_status status = create_run(lent);
        fate = status == BCD_OK ? advance(lent) : fate_of(lent, status);
    }
    lent->ended = fate == FATE_ENDED;
    if (fate == FATE_ENDED)
        result = give_back(lent);
    else if (fate != FATE_UNWANTED)
        let_go(lent, fate);
    if (fate == FATE_STRANGE)
        fprintf(stderr, "bcd worker: this program would run another job than the server's\n");
    if (fate == FATE_STRANGE || (fate == FATE_LET_GO && link_wait(lent->link, 0)))
        result = CLI_FAILED; /* not told to end: there is no memory */
    bcd_run_free(lent->run);
    bcd_scene_free(lent->scene);
    return result;
}

/* --------------------------------------------------------------- the loop */

/* CLI_OK: a chunk was run (one more of `chunks`, if to its end), or *idle. `patient`: a server that
 * is not there counts as one that has nothing to do. */
static int turn(struct link *link, const char *name, bool patient, bool *idle, int64_t *chunks)
{
    struct lent lent = {.link = link};
    int result = CLI_OK;
    enum link_status status = link_take(link, name, &lent.loan);
    *idle = status != LINK_OK;
    if (status == LINK_OK)
        result = run_chunk(&lent);
    else if (status == LINK_REFUSED || (status == LINK_AWAY && !patient))
        result = link_fault(link, NULL);
    *chunks += lent.ended;
    lease_loan_fini(&lent.loan);
    return result;
}

static int worker(const struct cli_line *line)
{
    char host[40] = "", name[LEASE_WORKER_SIZE];
    const char *idle_text = cli_value(line, "idle"), *given = cli_value(line, "name");
    struct link *link = NULL;
    int64_t idle_s = INT64_MAX / 1000, chunks = 0;
    if (idle_text && !cli_parse_integer(idle_text, 0, 1000000, &idle_s))
        return cli_wrong(line->command, "--idle is 0 to 1000000 seconds, not \"%s\"", idle_text);
    if (given && strlen(given) >= sizeof name)
        return cli_wrong(line->command, "--name is too long: \"%s\"", given);
    gethostname(host, sizeof host - 1);
    snprintf(name, sizeof name, "%s:%ld", host, (long)getpid());
    int status = link_open(line, cli_value(line, "share"), &link);
    int64_t busy_ms = now_ms(CLOCK_MONOTONIC), nap_ms = IDLE_NAP_MS_MIN;
    bool goes_on = status == CLI_OK;
    while (goes_on) {
        bool idle = false;
        int64_t now = now_ms(CLOCK_MONOTONIC);
        status = turn(link, given ? given : name, now - busy_ms < AWAY_MS_MAX, &idle, &chunks);
        now = now_ms(CLOCK_MONOTONIC);
        if (!idle)
            busy_ms = now;
        nap_ms = !idle ? IDLE_NAP_MS_MIN : nap_ms < IDLE_NAP_MS_MAX ? 2 * nap_ms : nap_ms;
        goes_on = status == CLI_OK && now - busy_ms <= 1000 * idle_s &&
                  link_wait(link, idle ? nap_ms : 0);
    }
    /* Ended by a signal it has done what it was for. */
    if (link)
        printf("%" PRId64 " chunk%s run\n", chunks, chunks == 1 ? "" : "s");
    link_free(link);
    return status;
}

static const struct cli_option options[] = {
    {.name = "share",
     .value = "DIR",
     .doc = "the daemon's --share DIR, where it cannot be reached"},
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
