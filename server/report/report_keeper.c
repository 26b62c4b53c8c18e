/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * report_keeper.c - see report_keeper.h.
 *
 * THREADS  `mutex` guards state, kind, thread, thread_id, share, so_far and reason. The measuring
 *          thread takes it for a moment only, between runs; `stop` is the one thing it looks at
 *          within them.
 */
#include "report_keeper.h"
#include "log.h"
#include "report_machine.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum state { STATE_IDLE, STATE_MEASURING, STATE_ENDED /* its thread is to be joined */ };

struct report_keeper {
    struct store *store;
    char version[64];
    char *machine;
    int nice;
    atomic_int stop;
    double core_seconds; /* of the thread in motion */
    pthread_mutex_t mutex;
    enum state state;
    enum report_kind kind; /* of the thread in motion, or of the last one */
    pthread_t thread;
    pid_t thread_id; /* of the thread in motion, for its priority; 0 = not begun */
    double share;
    char *so_far; /* JSON; NULL = nothing */
    char reason[WORK_PRECISION_REASON];
};

static void *measure(void *context);

const char *report_kind_name(enum report_kind kind)
{
    static const char *const names[REPORT_KINDS] = {
        [REPORT_WORK_PRECISION] = "work-precision",
        [REPORT_STABILITY] = "stability",
    };
    return names[kind];
}

struct report_keeper *report_keeper_create(struct store *store, int nice)
{
    struct report_keeper *keeper = calloc(1, sizeof *keeper);
    if (!keeper)
        return NULL;
    keeper->machine = report_machine_json();
    if (!keeper->machine) {
        free(keeper);
        return NULL;
    }
    keeper->store = store;
    keeper->nice = nice;
    snprintf(keeper->version, sizeof keeper->version, "%s, results %d", BCD_VERSION,
             BCD_RESULT_VERSION);
    pthread_mutex_init(&keeper->mutex, NULL);
    return keeper;
}

void report_keeper_free(struct report_keeper *keeper)
{
    if (!keeper)
        return;
    atomic_store(&keeper->stop, 1);
    /* On a busy machine the least urgent thread may take long to come to the end of what it is
     * doing. Who may not raise a priority waits for that. */
    pthread_mutex_lock(&keeper->mutex);
    if (keeper->state == STATE_MEASURING && keeper->thread_id != 0)
        setpriority(PRIO_PROCESS, (id_t)keeper->thread_id, 0);
    bool begun = keeper->state != STATE_IDLE;
    pthread_mutex_unlock(&keeper->mutex);
    if (begun)
        pthread_join(keeper->thread, NULL);
    pthread_mutex_destroy(&keeper->mutex);
    free(keeper->so_far);
    free(keeper->machine);
    free(keeper);
}

static struct report_new name_report(const struct report_keeper *keeper, enum report_kind kind)
{
    return (struct report_new){
        .name = report_kind_name(kind), .version = keeper->version, .machine = keeper->machine};
}

enum store_status report_keeper_get(struct report_keeper *keeper, enum report_kind kind,
                                    enum report_form form, char **text)
{
    struct report_new which = name_report(keeper, kind);
    return store_reports_get(keeper->store, &which, form, text);
}

enum store_status report_keeper_when(struct report_keeper *keeper, enum report_kind kind,
                                     int64_t *created_ms)
{
    struct report_new which = name_report(keeper, kind);
    return store_reports_when(keeper->store, &which, created_ms);
}

/* Takes the text. */
static void put_so_far(struct report_keeper *keeper, char *text)
{
    free(keeper->so_far);
    keeper->so_far = text;
}

enum report_begun report_keeper_begin(struct report_keeper *keeper, enum report_kind kind,
                                      double core_seconds)
{
    enum report_begun begun = REPORT_BUSY;
    pthread_mutex_lock(&keeper->mutex);
    if (keeper->state == STATE_ENDED) {
        pthread_join(keeper->thread, NULL); /* it has let the mutex go for good */
        keeper->state = STATE_IDLE;
    }
    if (keeper->state == STATE_IDLE) {
        keeper->kind = kind;
        keeper->core_seconds = core_seconds;
        keeper->share = 0;
        put_so_far(keeper, NULL);
        keeper->thread_id = 0;
        keeper->reason[0] = '\0';
        atomic_store(&keeper->stop, 0);
        bool good = pthread_create(&keeper->thread, NULL, measure, keeper) == 0;
        keeper->state = good ? STATE_MEASURING : STATE_IDLE;
        begun = good ? REPORT_BEGUN : REPORT_NO_THREAD;
    }
    pthread_mutex_unlock(&keeper->mutex);
    return begun;
}

bool report_keeper_stop(struct report_keeper *keeper, enum report_kind kind)
{
    pthread_mutex_lock(&keeper->mutex);
    bool measuring = keeper->state == STATE_MEASURING && keeper->kind == kind;
    if (measuring)
        atomic_store(&keeper->stop, 1);
    pthread_mutex_unlock(&keeper->mutex);
    return measuring;
}

double report_keeper_progress(struct report_keeper *keeper, enum report_kind kind, char *reason)
{
    pthread_mutex_lock(&keeper->mutex);
    bool mine = keeper->kind == kind;
    double share = mine && keeper->state == STATE_MEASURING ? keeper->share : -1;
    if (reason)
        reason[0] = '\0';
    if (reason && mine) {
        memcpy(reason, keeper->reason, WORK_PRECISION_REASON);
        keeper->reason[0] = '\0';
    }
    pthread_mutex_unlock(&keeper->mutex);
    return share;
}

char *report_keeper_so_far(struct report_keeper *keeper, enum report_kind kind)
{
    pthread_mutex_lock(&keeper->mutex);
    bool mine = keeper->kind == kind && keeper->state == STATE_MEASURING && keeper->so_far;
    char *copy = mine ? strdup(keeper->so_far) : NULL;
    pthread_mutex_unlock(&keeper->mutex);
    return copy;
}

/* -------------------------------------------------------------- its thread */

static void set_share(void *context, double share)
{
    struct report_keeper *keeper = context;
    pthread_mutex_lock(&keeper->mutex);
    keeper->share = share;
    pthread_mutex_unlock(&keeper->mutex);
}

/* Takes the forms. */
static void keep(struct report_keeper *keeper, enum report_kind kind, char *form[REPORT_FORMS],
                 char *reason)
{
    struct report_new new = name_report(keeper, kind);
    enum store_status status = STORE_OK;
    bool whole = true;
    for (int i = 0; i < REPORT_FORMS; i++) {
        new.form[i] = form[i];
        whole = whole && form[i];
    }
    if (whole)
        status = store_reports_put(keeper->store, &new);
    if (!whole || status != STORE_OK)
        snprintf(reason, WORK_PRECISION_REASON, "%s",
                 !whole                 ? "out of memory"
                 : status == STORE_FULL ? "the disk is full"
                                        : "the store failed, the log says how");
    for (int i = 0; i < REPORT_FORMS; i++)
        free(form[i]);
}

static void measure_work_precision(struct report_keeper *keeper, char *reason)
{
    struct work_precision *report = calloc(1, sizeof *report);
    struct work_precision_options options = WORK_PRECISION_SHORT;
    if (keeper->core_seconds > 0)
        options.core_seconds = keeper->core_seconds;
    options.stop = &keeper->stop;
    options.progress = set_share;
    options.context = keeper;
    if (report && work_precision_measure(report, &options, reason)) {
        char *form[REPORT_FORMS] = {work_precision_print_json(report),
                                    work_precision_print_csv(report),
                                    work_precision_print_svg(report)};
        keep(keeper, REPORT_WORK_PRECISION, form, reason);
    }
    free(report);
}

static void set_so_far(void *context, const struct stability *so_far)
{
    struct report_keeper *keeper = context;
    char *entries = stability_print_entries(so_far->entry, so_far->count);
    pthread_mutex_lock(&keeper->mutex);
    keeper->share = (double)so_far->count / (double)so_far->planned;
    put_so_far(keeper, entries);
    pthread_mutex_unlock(&keeper->mutex);
}

static void measure_stability(struct report_keeper *keeper, char *reason)
{
    struct stability *report = calloc(1, sizeof *report);
    const struct stability_options options = {
        .stop = &keeper->stop, .found = set_so_far, .context = keeper};
    if (report)
        reason[0] = '\0';
    if (report && stability_measure(report, &options)) {
        char *form[REPORT_FORMS] = {stability_print_json(report), stability_print_csv(report),
                                    stability_print_svg(report)};
        keep(keeper, REPORT_STABILITY, form, reason);
    }
    free(report);
}

/* In Linux a priority is each thread's own. */
static void *measure(void *context)
{
    struct report_keeper *keeper = context;
    const char *name = report_kind_name(keeper->kind);
    char reason[WORK_PRECISION_REASON] = "out of memory";
    if (keeper->nice > 0)
        setpriority(PRIO_PROCESS, (id_t)gettid(), keeper->nice);
    pthread_mutex_lock(&keeper->mutex);
    keeper->thread_id = gettid();
    pthread_mutex_unlock(&keeper->mutex);
    log_write(LOG_LEVEL_INFO, "report_begun", LOG_FIELDS(log_text("report", name)));
    if (keeper->kind == REPORT_STABILITY)
        measure_stability(keeper, reason);
    else
        measure_work_precision(keeper, reason);
    log_write(reason[0] ? LOG_LEVEL_ERROR : LOG_LEVEL_INFO, "report_ended",
              LOG_FIELDS(log_text("report", name), log_text("reason", reason)));
    pthread_mutex_lock(&keeper->mutex);
    memcpy(keeper->reason, reason, sizeof reason);
    put_so_far(keeper, NULL);
    keeper->state = STATE_ENDED;
    pthread_mutex_unlock(&keeper->mutex);
    return NULL;
}
