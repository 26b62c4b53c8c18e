/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * crowd.c - hundreds of workers in one thread, and a few people who look at the server meanwhile:
 * what a daemon that lends its chunks carries. Loopback only; ends by itself.
 *
 *   crowd --port N --workers N --seconds S [--work MS] [--token FILE] [--admin FILE] [--job ID]
 *         [--gone N] [--late N] [--twice N] [--broken N] [--seed N]
 *
 * A worker takes a chunk, runs it, and keeps it for about --work ms, with heartbeats and a
 * checkpoint now and then, before it gives it back. Of 1000 chunks so many --gone are never heard
 * of again; --late come back without a heartbeat when the lease has expired; --twice are given back
 * twice; --broken arrive damaged. It ends after --seconds or at SIGTERM; what workers have in hand
 * then is given back. People (with --admin and --job) ask for pages and submit jobs meanwhile.
 *
 * On stdout one JSON object: counts, and latencies in ms. Chunks are to be of less than 1 ms, for
 * the time that they take is in the latencies.
 */
#include "bcd.h"
#include "lease_json.h"
#include "queue.h"
#include "scene_json.h"
#include "support/wire.h"

#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

enum { BEATS = 6, NAP_US = 500000, PROBE_US = 50000, POST_US = 100000, DRAIN_US = 20000000 };

/* What is asked for, and how long each took. */
enum asked { TAKE, BEAT, RETURN, HEALTH, RECORD, LIST, PAGE, METRICS, SUBMIT, ASKED };
static const char *const asked_names[ASKED] = {"lease", "heartbeat", "return",  "healthz", "job",
                                               "list",  "page",      "metrics", "submit"};
struct times {
    float *ms;
    size_t count, room;
};

enum phase { NAPS, ASKS, WORKS, BEATS_NOW, RETURNS, ENDED };

/* A worker, or somebody who looks. */
struct party {
    struct wire wire; /* first: epoll gives it back */
    struct crowd *crowd;
    bool waiting; /* for an answer */
    enum asked asked;
    int64_t due_us;
    bool person;
    enum phase phase;
    struct lease_loan loan;
    struct blob tally, checkpoint;
    int64_t ends_us, beats;
    bool late, twice, broken;
};

struct crowd {
    long port, workers, seconds, work_ms, gone, late, twice, broken;
    const char *token, *admin, *job;
    uint64_t random;
    int epoll;
    int64_t begun_us, submitted;
    bool ending;
    struct party *parties;
    size_t count;
    struct times times[ASKED];
    long loans, taken, again, unwanted, refused, differed, stopped, unknown, lost, failed, vanished,
        broke, doubled, came_late, continued;
    double bytes_in, bytes_out;
};

static void die(const char *why)
{
    fprintf(stderr, "crowd: %s\n", why);
    exit(1);
}

/* 0..999, the same each time (xorshift). */
static long dice(struct crowd *crowd)
{
    crowd->random ^= crowd->random << 13;
    crowd->random ^= crowd->random >> 7;
    crowd->random ^= crowd->random << 17;
    return (long)(crowd->random % 1000);
}

static void note(struct times *times, double ms)
{
    if (times->count == times->room) {
        times->room = 2 * times->room + 1024;
        times->ms = realloc(times->ms, times->room * sizeof(*times->ms));
        if (!times->ms)
            die("no memory");
    }
    times->ms[times->count++] = (float)ms;
}

static void ask(struct party *party, enum asked asked, const char *method, const char *path,
                const char *body)
{
    const struct crowd *crowd = party->crowd;
    struct wire_request request = {.method = method,
                                   .path = path,
                                   .token = party->person ? crowd->admin : crowd->token,
                                   .body = body};
    party->asked = asked;
    party->waiting = true;
    if (!wire_ask(&party->wire, &request))
        die("no connection");
}

/* ----------------------------------------------------------------- workers */

static struct blob save_checkpoint(const struct bcd_run *run)
{
    struct blob blob = {.size = bcd_run_checkpoint_size(run)};
    blob.bytes = malloc(blob.size);
    if (!blob.bytes)
        die("no memory");
    bcd_run_save(run, blob.bytes);
    return blob;
}

/* The chunk, as bcd worker would run it. */
static void run(struct party *party)
{
    struct lease_loan *loan = &party->loan;
    struct bcd_scene *scene = NULL;
    struct bcd_run *made = NULL;
    struct bcd_errors errors = {0};
    unsigned char hash[JOB_HASH_SIZE];
    if (scene_json_parse(loan->scene, strlen(loan->scene), &scene, &errors) != BCD_OK ||
        !queue_hash(scene, hash) || memcmp(hash, loan->hash, sizeof(hash)) != 0 ||
        bcd_run_create(&made, scene, loan->chunk, NULL) != BCD_OK)
        die("what was lent cannot be run");
    if (loan->checkpoint.size > 0) {
        if (bcd_run_restore(made, loan->checkpoint.bytes, loan->checkpoint.size, NULL) != BCD_OK)
            die("a checkpoint that was lent is none of this chunk");
        party->crowd->continued++;
    }
    int64_t left = bcd_run_ticks_total(made) - bcd_run_ticks_done(made);
    bcd_run_advance(made, left / 2, NULL);
    party->checkpoint = save_checkpoint(made);
    bcd_run_advance(made, left - left / 2, NULL);
    party->tally.size = bcd_tally_size(bcd_run_tally(made));
    party->tally.bytes = malloc(party->tally.size);
    if (!party->tally.bytes)
        die("no memory");
    bcd_tally_save(bcd_run_tally(made), party->tally.bytes);
    bcd_run_free(made);
    bcd_scene_free(scene);
}

static void say(struct party *party, bool ended)
{
    const struct crowd *crowd = party->crowd;
    struct lease_word word = {
        .chunk = party->loan.chunk, .ticks_total = 100, .core_seconds = 0.001};
    char path[64];
    snprintf(word.job, sizeof(word.job), "%s", party->loan.job);
    snprintf(path, sizeof(path), "/v1/leases/%s/%s", party->loan.id,
             ended ? "return" : "heartbeat");
    if (ended) {
        word.bytes = party->tally;
        if (party->broken)
            ((unsigned char *)word.bytes.bytes)[word.bytes.size / 2] ^= 1;
    } else {
        int64_t left_us = party->ends_us - wire_now_us();
        word.ticks_done = 100 - 100 * left_us / (1000 * crowd->work_ms + 1) / 2;
        word.ticks_done = word.ticks_done < 0 ? 0 : word.ticks_done > 99 ? 99 : word.ticks_done;
        if (party->beats++ % 2 == 1)
            word.bytes = party->checkpoint;
    }
    char *body = lease_json_word(&word, ended);
    if (!body)
        die("no memory");
    party->crowd->bytes_in += (double)strlen(body);
    ask(party, ended ? RETURN : BEAT, "POST", path, body);
    free(body);
}

static void drop(struct party *party)
{
    lease_loan_fini(&party->loan);
    blob_fini(&party->tally);
    blob_fini(&party->checkpoint);
    party->late = party->twice = party->broken = false;
    party->beats = 0;
    party->phase = NAPS;
    party->due_us = wire_now_us();
}

static void take(struct party *party, const struct wire_answer *answer)
{
    struct crowd *crowd = party->crowd;
    struct bcd_errors errors = {0};
    int64_t now = wire_now_us(), work_us = 1000 * crowd->work_ms;
    if (!lease_json_read_loan(answer->body, answer->size, &party->loan, &errors))
        die("what was lent cannot be read");
    party->phase = NAPS;
    party->due_us = now + NAP_US;
    if (!party->loan.id[0])
        return;
    crowd->loans++;
    run(party);
    party->phase = WORKS;
    party->ends_us = now + work_us / 2 + work_us * dice(crowd) / 1000;
    party->due_us = now + 1000 * party->loan.lease_ms / BEATS;
    long fate = dice(crowd);
    if (fate < crowd->gone) {
        crowd->vanished++;
        drop(party);
        return;
    }
    fate -= crowd->gone;
    party->late = fate >= 0 && fate < crowd->late;
    party->twice = fate >= crowd->late && fate < crowd->late + crowd->twice;
    party->broken = party->loan.attempt == 1 && /* what fails twice has failed */
                    fate >= crowd->late + crowd->twice &&
                    fate < crowd->late + crowd->twice + crowd->broken;
    if (party->late)
        party->due_us = party->ends_us = now + 1500 * party->loan.lease_ms;
    else if (party->ends_us < party->due_us)
        party->due_us = party->ends_us;
}

static bool says(const struct wire_answer *answer, const char *word)
{
    return strstr(answer->body, word) != NULL;
}

static void beaten(struct party *party, const struct wire_answer *answer)
{
    struct crowd *crowd = party->crowd;
    int64_t next = wire_now_us() + 1000 * party->loan.lease_ms / BEATS;
    party->phase = WORKS;
    party->due_us = next < party->ends_us ? next : party->ends_us;
    if (says(answer, "\"stop\"")) {
        crowd->stopped++;
        drop(party);
    } else if (says(answer, "\"unknown\"")) {
        crowd->unknown++;
    }
}

static void returned(struct party *party, const struct wire_answer *answer)
{
    struct crowd *crowd = party->crowd;
    if (answer->status == 409)
        *(says(answer, "other bits") ? &crowd->differed : &crowd->refused) += 1;
    else if (says(answer, "\"taken\""))
        crowd->taken++;
    else if (says(answer, "\"again\""))
        crowd->again++;
    else
        crowd->unwanted++;
    crowd->came_late += party->late;
    crowd->broke += party->broken;
    if (party->twice) {
        party->twice = false;
        crowd->doubled++;
        say(party, true);
    } else {
        drop(party);
    }
}

/* ------------------------------------------------------------------ people */

static void look(struct party *party)
{
    struct crowd *crowd = party->crowd;
    char path[96], body[256];
    switch (party->asked) {
    case RECORD:
        snprintf(path, sizeof(path), "/v1/jobs/%s", crowd->job);
        ask(party, RECORD, "GET", path, NULL);
        break;
    case SUBMIT:
        snprintf(body, sizeof(body),
                 "{\"particles\":2,\"length\":10,\"time\":1,\"time_step\":0.1,\"seed\":%lld,"
                 "\"label\":\"crowd\",\"observables\":{\"energy\":{}}}",
                 1000000 + (long long)(crowd->random % 1000000) * 1000 + ++crowd->submitted);
        ask(party, SUBMIT, "POST", "/v1/jobs", body);
        break;
    default:
        ask(party, party->asked, "GET",
            party->asked == HEALTH ? "/healthz"
            : party->asked == LIST ? "/v1/jobs?limit=50"
            : party->asked == PAGE ? "/"
                                   : "/metrics",
            NULL);
    }
}

/* -------------------------------------------------------------------- loop */

static volatile sig_atomic_t told;

static void tell(int number)
{
    (void)number;
    told = 1;
}

static void act(struct party *party)
{
    struct crowd *crowd = party->crowd;
    if (party->person) {
        if (crowd->ending)
            party->phase = ENDED;
        else
            look(party);
    } else if (party->phase == WORKS) {
        bool ended = party->due_us >= party->ends_us || (crowd->ending && !party->late);
        party->phase = ended ? RETURNS : BEATS_NOW;
        say(party, ended);
    } else if (crowd->ending) {
        party->phase = ENDED;
    } else {
        char name[LEASE_WORKER_SIZE];
        snprintf(name, sizeof(name), "crowd:%td", party - crowd->parties);
        char *body = lease_json_request(name);
        party->phase = ASKS;
        ask(party, TAKE, "POST", "/v1/leases", body);
        free(body);
    }
}

static void hear(struct party *party, const struct wire_answer *answer)
{
    struct crowd *crowd = party->crowd;
    note(&crowd->times[party->asked], (double)party->wire.took_us / 1000);
    party->waiting = false;
    crowd->bytes_out += (double)answer->size;
    if (answer->status >= 300 && answer->status != 409) {
        if (crowd->failed++ == 0)
            fprintf(stderr, "crowd: %s: %d %.300s\n", asked_names[party->asked], answer->status,
                    answer->body);
        if (party->person)
            party->due_us = wire_now_us() + PROBE_US;
        else
            drop(party);
    } else if (party->person) {
        party->due_us = wire_now_us() + (party->asked == SUBMIT ? POST_US : PROBE_US);
    } else if (party->phase == ASKS) {
        take(party, answer);
    } else if (party->phase == BEATS_NOW) {
        beaten(party, answer);
    } else {
        returned(party, answer);
    }
}

/* Whatever is due; how long nothing will be. Everybody is looked at: they are some hundreds. */
static int act_all(struct crowd *crowd, size_t *open)
{
    int64_t now = wire_now_us(), next = now + 100000;
    *open = 0;
    for (size_t i = 0; i < crowd->count; i++) {
        struct party *party = &crowd->parties[i];
        if (!party->waiting && party->phase != ENDED &&
            (party->due_us <= now || (crowd->ending && !party->late)))
            act(party);
        if (!party->waiting && party->phase != ENDED && party->due_us < next)
            next = party->due_us;
        *open += party->phase != ENDED;
    }
    now = wire_now_us();
    return next > now ? (int)((next - now) / 1000) + 1 : 0;
}

static void loop(struct crowd *crowd)
{
    struct epoll_event events[256];
    size_t open = crowd->count;
    while (open > 0) {
        int wait_ms = act_all(crowd, &open);
        int count = epoll_wait(crowd->epoll, events, 256, wait_ms);
        for (int i = 0; i < count; i++) {
            struct party *party = events[i].data.ptr;
            struct wire_answer answer;
            if (!party->waiting)
                continue;
            enum wire_state state = wire_go(&party->wire, &answer);
            if (state == WIRE_DONE)
                hear(party, &answer);
            if (state == WIRE_LOST) {
                crowd->lost++;
                party->waiting = false;
                drop(party);
            }
        }
        int64_t now = wire_now_us();
        crowd->ending = crowd->ending || told || now - crowd->begun_us > 1000000 * crowd->seconds;
        if (now - crowd->begun_us > 1000000 * crowd->seconds + DRAIN_US)
            die("not everybody had an answer in the end");
    }
}

/* ------------------------------------------------------------------ report */

static int compare(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double quantile(const struct times *times, double q)
{
    return (double)times->ms[(size_t)(q * (double)(times->count - 1) + 0.5)];
}

static void report(struct crowd *crowd, double seconds)
{
    printf("{\"workers\":%ld,\"seconds\":%.3f,\"loans\":%ld,\"taken\":%ld,\"again\":%ld,"
           "\"unwanted\":%ld,\"refused\":%ld,\"differed\":%ld,\"stopped\":%ld,\"unknown\":%ld,"
           "\"lost\":%ld,\"failed\":%ld,\"gone\":%ld,\"late\":%ld,\"doubled\":%ld,\"broken\":%ld,"
           "\"continued\":%ld,\"returns_per_second\":%.1f,\"bytes_sent\":%.0f,"
           "\"bytes_received\":%.0f,\"ms\":{",
           crowd->workers, seconds, crowd->loans, crowd->taken, crowd->again, crowd->unwanted,
           crowd->refused, crowd->differed, crowd->stopped, crowd->unknown, crowd->lost,
           crowd->failed, crowd->vanished, crowd->came_late, crowd->doubled, crowd->broke,
           crowd->continued, (double)crowd->taken / seconds, crowd->bytes_in, crowd->bytes_out);
    for (int i = 0, any = 0; i < ASKED; i++) {
        struct times *times = &crowd->times[i];
        if (times->count == 0)
            continue;
        qsort(times->ms, times->count, sizeof(*times->ms), compare);
        printf("%s\"%s\":{\"count\":%zu,\"median\":%.3f,\"p95\":%.3f,\"p99\":%.3f,\"max\":%.3f}",
               any++ ? "," : "", asked_names[i], times->count, quantile(times, 0.5),
               quantile(times, 0.95), quantile(times, 0.99), quantile(times, 1));
        free(times->ms);
    }
    printf("}}\n");
}

/* ------------------------------------------------------------------- start */

static char *read_token(const char *path)
{
    static char lines[2][256];
    static int used;
    FILE *file = fopen(path, "r");
    char *line = lines[used++ % 2];
    if (!file || !fgets(line, 256, file))
        die("a token cannot be read");
    fclose(file);
    line[strcspn(line, "\n")] = '\0';
    return line;
}

static void options(struct crowd *crowd, int argc, char **argv)
{
    static const struct option known[] = {{"port", 1, 0, 'p'},
                                          {"workers", 1, 0, 'n'},
                                          {"seconds", 1, 0, 's'},
                                          {"work", 1, 0, 'w'},
                                          {"gone", 1, 0, 'g'},
                                          {"late", 1, 0, 'l'},
                                          {"twice", 1, 0, '2'},
                                          {"broken", 1, 0, 'b'},
                                          {"seed", 1, 0, 'r'},
                                          {"token", 1, 0, 't'},
                                          {"admin", 1, 0, 'a'},
                                          {"job", 1, 0, 'j'},
                                          {0}};
    long seed = 1, *const numbers[256] = {
                       ['p'] = &crowd->port,    ['n'] = &crowd->workers, ['s'] = &crowd->seconds,
                       ['w'] = &crowd->work_ms, ['g'] = &crowd->gone,    ['l'] = &crowd->late,
                       ['2'] = &crowd->twice,   ['b'] = &crowd->broken,  ['r'] = &seed};
    int found;
    while ((found = getopt_long(argc, argv, "", known, NULL)) != -1) {
        if (found == '?')
            die("an option that it does not have");
        if (numbers[found])
            *numbers[found] = strtol(optarg, NULL, 10);
        else if (found == 'j')
            crowd->job = optarg;
        else
            *(found == 't' ? &crowd->token : &crowd->admin) = read_token(optarg);
    }
    crowd->random = 0x9e3779b97f4a7c15u * (uint64_t)(seed + 1);
    if (crowd->port < 1 || crowd->port > 65535 || crowd->workers < 1 || crowd->workers > 2000 ||
        crowd->seconds < 1 || crowd->seconds > 600 || crowd->work_ms < 0)
        die("--port, --workers and --seconds are needed, and within reason");
}

int main(int argc, char **argv)
{
    struct crowd crowd = {0};
    options(&crowd, argc, argv);
    signal(SIGTERM, tell);
    crowd.count = (size_t)crowd.workers + (crowd.job ? SUBMIT - HEALTH + 1 : 0);
    crowd.parties = calloc(crowd.count, sizeof(*crowd.parties));
    crowd.epoll = epoll_create1(EPOLL_CLOEXEC);
    if (!crowd.parties || crowd.epoll < 0)
        die("no memory");
    crowd.begun_us = wire_now_us();
    for (size_t i = 0; i < crowd.count; i++) {
        struct party *party = &crowd.parties[i];
        party->crowd = &crowd;
        party->person = i >= (size_t)crowd.workers;
        if (party->person)
            party->asked = (enum asked)(HEALTH + (int)(i - (size_t)crowd.workers));
        else /* they do not all come at once */
            party->due_us = crowd.begun_us + 1000 * (int64_t)i;
        wire_init(&party->wire, crowd.epoll, (uint16_t)crowd.port, party);
    }
    loop(&crowd);
    report(&crowd, (double)(wire_now_us() - crowd.begun_us) * 1e-6);
    for (size_t i = 0; i < crowd.count; i++)
        wire_fini(&crowd.parties[i].wire);
    free(crowd.parties);
    close(crowd.epoll);
    return 0;
}
