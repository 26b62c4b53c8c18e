/* SPDX-License-Identifier: GPL-3.0-or-later
 * share.c - see share.h. */
#include "share.h"

#include "limits.h"
#include "log.h"
#include "share_dir.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* A file in offers/ or taken/. */
struct entry {
    char name[SPOOL_NAME_SIZE];
    struct lease_word word; /* job, chunk and id; nothing else */
    bool taken;             /* by a worker */
    bool seen;              /* this time round */
};

struct share {
    struct share_dir *dir;
    struct leases *leases;
    int64_t lease_ms, started_ms;
    struct entry *entries;
    size_t count, room;
    bool troubled; /* the directory could not be written to, which was told */
    bool stuck;    /* something could not be put out of the way, likewise */
    pthread_t thread;
    pthread_mutex_t mutex; /* guards `stopping` */
    pthread_cond_t changed;
    bool stopping;
};

static int64_t now_ms(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* Whatever was lent before the last start: workers of then may be known only in a while. */
static bool is_young(const struct share *share)
{
    return now_ms() - share->started_ms < share->lease_ms;
}

/* --------------------------------------------------------------------- entries */

static struct entry *find_name(struct share *share, const char *name)
{
    for (size_t i = 0; i < share->count; i++)
        if (strcmp(share->entries[i].name, name) == 0)
            return &share->entries[i];
    return NULL;
}

static struct entry *find_lease(struct share *share, const char *id)
{
    for (size_t i = 0; i < share->count; i++)
        if (strcmp(share->entries[i].word.id, id) == 0)
            return &share->entries[i];
    return NULL;
}

static struct entry *add(struct share *share, const char *name)
{
    struct entry made = {.seen = true};

    if (!share_name_read(name, &made.word))
        return NULL;
    snprintf(made.name, sizeof made.name, "%s", name);
    if (share->count == share->room) {
        size_t room = share->room > 0 ? 2 * share->room : 64;
        struct entry *more = realloc(share->entries, room * sizeof *more);

        if (!more)
            return NULL;
        share->entries = more;
        share->room = room;
    }
    share->entries[share->count] = made;
    return &share->entries[share->count++];
}

/* Away with it; the worker that has it will see. */
static void drop(struct share *share, struct entry *entry)
{
    spool_remove(share_dir_at(share->dir, SHARE_OFFERS), entry->name);
    spool_remove(share_dir_at(share->dir, SHARE_TAKEN), entry->name);
    *entry = share->entries[--share->count];
}

/* ------------------------------------------------------------- what workers say */

/* Something that is no word: kept, but out of the way. A directory with something in it may have to
 * stay where it is, which is told once and not at every look. */
static void refuse(struct share *share, enum share_place place, const char *name,
                   const char *reason)
{
    bool moved = spool_move(share_dir_at(share->dir, place), name,
                            share_dir_at(share->dir, SHARE_REFUSED), name);

    if (!moved)
        spool_remove(share_dir_at(share->dir, place), name);
    if (moved || !share->stuck)
        log_write(LOG_LEVEL_WARNING, "share_refused",
                  LOG_FIELDS(log_text("file", name), log_text("reason", reason)));
    share->stuck |= !moved;
}

/* What the worker with that lease wrote to a file. */
static bool read_word(struct share *share, enum share_place place, const char *name,
                      const char *lease, struct lease_word *word)
{
    struct bcd_errors errors = {0};
    size_t size = 0;
    char *text = spool_read(share_dir_at(share->dir, place), name, SHARE_FILE_BYTES_MAX, &size);
    const char *reason = NULL;

    *word = (struct lease_word){0};
    if (!text)
        reason = errno == EFBIG ? "too large" : strerror(errno);
    else if (!lease_json_read_word(text, size, place == SHARE_RETURNS, word, &errors))
        reason = errors.count > 0 ? errors.items[0].text : "no memory";
    else if (strlen(lease) >= sizeof word->id)
        reason = "no lease has such a name";
    else
        snprintf(word->id, sizeof word->id, "%s", lease);
    free(text);
    if (!reason)
        return true;
    refuse(share, place, name, reason);
    lease_word_fini(word);
    return false;
}

/* A tally. Of one that nobody knows yet we may hear more when the daemon has come up. */
static void take_return(struct share *share, const char *name)
{
    struct lease_word word;
    struct entry *entry;
    enum lease_answer answer;

    if (!read_word(share, SHARE_RETURNS, name, name, &word))
        return;
    answer = leases_return(share->leases, &word);
    lease_word_fini(&word);
    if (answer == LEASE_UNKNOWN && is_young(share))
        return;
    if (answer == LEASE_REFUSED || answer == LEASE_DIFFERS)
        refuse(share, SHARE_RETURNS, name,
               answer == LEASE_DIFFERS ? "it came before with other bits"
                                       : "not its chunk's tally");
    else
        spool_remove(share_dir_at(share->dir, SHARE_RETURNS), name);
    if ((entry = find_lease(share, name)))
        drop(share, entry);
}

/* A heartbeat. Taken out of the way first: the worker may put the next one there meanwhile. */
static void take_word(struct share *share, const char *name)
{
    const int words = share_dir_at(share->dir, SHARE_WORDS);
    struct entry *entry = find_lease(share, name);
    char mine[SPOOL_NAME_SIZE + 8];
    enum lease_answer answer;
    struct lease_word word;

    snprintf(mine, sizeof mine, "read.%.60s", name);
    if (strncmp(name, "read.", 5) == 0 || !spool_move(words, name, words, mine))
        return;
    if (!read_word(share, SHARE_WORDS, mine, name, &word))
        return;
    answer = leases_hear(share->leases, &word);
    spool_remove(words, mine);
    if (entry) {
        entry->taken = true;
        if (answer == LEASE_STOP || word.let_go || word.failed ||
            (answer == LEASE_UNKNOWN && !is_young(share)))
            drop(share, entry);
    }
    lease_word_fini(&word);
}

static void take_all(struct share *share, enum share_place place,
                     void (*take)(struct share *share, const char *name))
{
    size_t count;
    char(*names)[SPOOL_NAME_SIZE] = spool_list(share_dir_at(share->dir, place), &count);

    for (size_t i = 0; i < count; i++)
        take(share, names[i]);
    free(names);
}

/* ------------------------------------------------------- what lies where it lies */

static void see_offer(struct share *share, const char *name)
{
    struct entry *entry = find_name(share, name);

    if (entry)
        entry->seen = true;
    else /* of another time */
        spool_remove(share_dir_at(share->dir, SHARE_OFFERS), name);
}

static void see_taken(struct share *share, const char *name)
{
    struct entry *entry = find_name(share, name);

    if (!entry)
        entry = add(share, name); /* of a daemon before this one */
    if (!entry) {
        refuse(share, SHARE_TAKEN, name, "no name of ours");
        return;
    }
    if (!entry->taken) /* from now on its worker has to be heard of */
        leases_hear(share->leases, &entry->word);
    entry->seen = entry->taken = true;
}

/* Whether the chunk stays with whoever has it. An offer is kept up by us, what was taken by its
 * worker; a worker of before the start is taken for the chunk's as soon as that is offered. */
static bool stays(struct share *share, struct entry *entry)
{
    struct lease_word word = entry->word;
    enum lease_answer answer;

    word.waiting = !entry->taken;
    answer = entry->taken && !is_young(share) ? leases_look(share->leases, &word)
                                              : leases_hear(share->leases, &word);
    return answer == LEASE_GO_ON || (answer == LEASE_UNKNOWN && entry->taken && is_young(share));
}

static void look_after(struct share *share)
{
    for (size_t i = 0; i < share->count; i++)
        share->entries[i].seen = false;
    take_all(share, SHARE_OFFERS, see_offer); /* in this order: files go from there */
    take_all(share, SHARE_TAKEN, see_taken);  /* to there */
    for (size_t i = share->count; i-- > 0;) {
        struct entry *entry = &share->entries[i];

        /* One in neither place may be on its way: listings of network file systems are late. */
        if (entry->seen ? !stays(share, entry)
                        : leases_look(share->leases, &entry->word) != LEASE_GO_ON)
            drop(share, entry);
    }
}

/* Puts a chunk there for whoever comes. False = there is none, or no place for it. */
static bool offer(struct share *share)
{
    const struct lease_asker asker = {.owner = "", .worker = "shared directory"};
    struct lease_loan loan = {0};
    struct lease_word word;
    char name[SPOOL_NAME_SIZE], *text;
    bool put;

    if (leases_take(share->leases, &asker, &loan) != STORE_OK)
        return false;
    share_name(&loan, name);
    share_name_read(name, &word);
    word.waiting = true;
    leases_hear(share->leases, &word);
    text = lease_json_loan(&loan);
    put = text && spool_put(share_dir_at(share->dir, SHARE_OFFERS), name, text, strlen(text));
    if (!put && !share->troubled)
        log_write(LOG_LEVEL_WARNING, "share_trouble",
                  LOG_FIELDS(log_text("reason", text ? strerror(errno) : "no memory")));
    share->troubled = !put;
    if (!put || !add(share, name)) {
        word.let_go = true;
        leases_hear(share->leases, &word);
    }
    free(text);
    lease_loan_fini(&loan);
    return put;
}

/* ---------------------------------------------------------------------- thread */

static bool wait(struct share *share)
{
    struct timespec until;
    int code = 0;
    bool stopping;

    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += LIMIT_SHARE_LOOK_MS * 1000000L;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    pthread_mutex_lock(&share->mutex);
    while (code == 0 && !share->stopping)
        code = pthread_cond_timedwait(&share->changed, &share->mutex, &until);
    stopping = share->stopping;
    pthread_mutex_unlock(&share->mutex);
    return !stopping;
}

/* The first time round nothing is offered: workers of before are to keep what they have. */
static void *share_main(void *context)
{
    struct share *share = context;
    bool first = true;

    do {
        take_all(share, SHARE_RETURNS, take_return);
        take_all(share, SHARE_WORDS, take_word);
        look_after(share);
        while (!first && offer(share))
            ;
        first = false;
    } while (wait(share));
    return NULL;
}

struct share *share_start(const char *path, struct leases *leases, int64_t lease_ms, char *reason,
                          size_t size)
{
    struct share *share = calloc(1, sizeof *share);

    if (!share) {
        snprintf(reason, size, "out of memory");
        return NULL;
    }
    share->leases = leases;
    share->lease_ms = lease_ms;
    share->started_ms = now_ms();
    pthread_mutex_init(&share->mutex, NULL);
    pthread_cond_init(&share->changed, NULL);
    share->dir = share_dir_open(path, reason, size);
    if (share->dir && !share_dir_lock(share->dir))
        snprintf(reason, size, "the shared directory %s is another daemon's", path);
    else if (share->dir && pthread_create(&share->thread, NULL, share_main, share) != 0)
        snprintf(reason, size, "no thread can be had");
    else if (share->dir)
        return share;
    share_dir_free(share->dir);
    pthread_cond_destroy(&share->changed);
    pthread_mutex_destroy(&share->mutex);
    free(share);
    return NULL;
}

void share_stop(struct share *share)
{
    if (!share)
        return;
    pthread_mutex_lock(&share->mutex);
    share->stopping = true;
    pthread_cond_signal(&share->changed);
    pthread_mutex_unlock(&share->mutex);
    pthread_join(share->thread, NULL);
    share_dir_free(share->dir);
    pthread_cond_destroy(&share->changed);
    pthread_mutex_destroy(&share->mutex);
    free(share->entries);
    free(share);
}
