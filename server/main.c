/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcdd, the daemon: store, queue, workers, HTTP, in this order; and back when a signal says so.
 *
 * THREADS  All signals that end the daemon are blocked before the first thread starts; only the
 * main thread takes them, with sigwait, and does nothing else.
 */
#include "aside.h"
#include "bcd.h"
#include "config.h"
#include "crash.h"
#include "description.h"
#include "handle.h"
#include "heap_json.h"
#include "http_guard.h"
#include "log.h"
#include "metrics.h"
#include "notify.h"
#include "routes.h"
#include "share.h"
#include "slurm.h"
#include "stream_counts.h"
#include "token.h"
#include "worker.h"

#include <gsl/gsl_errno.h>

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

enum { EXIT_OK = 0, EXIT_FAILED = 1, EXIT_USAGE = 2, DESCRIPTORS_WANTED = 8192, REPORTS_NICE = 19 };

/* What brings chunks to other machines, if anything does. */
struct elsewhere {
    struct share *share;
    struct slurm *slurm;
};

static int serve(const struct config *config);
static bool start_threads(const struct config *config, struct service *service, char *reason,
                          size_t size);
static bool begin_queue(struct service *service, const struct config *config);
static bool start_elsewhere(const struct config *config, struct elsewhere *elsewhere,
                            struct service *service, char *reason, size_t size);
static void announce(const struct config *config, uint16_t port);
static void observe(void *context, const struct http_done *done);
static void wake(void *http);
static void wait_for_end(const sigset_t *ending);
static void block_signals(sigset_t *ending);
static void raise_descriptors(void);

int main(int argc, char **argv)
{
    struct config config;
    char reason[512];
    if (argc > 1 && strcmp(argv[1], "token") == 0)
        return token_main(argc, argv);
    switch (config_parse(argc, argv, &config, reason, sizeof(reason))) {
    case CONFIG_HELP:
        fputs(config_usage(), stdout);
        return EXIT_OK;
    case CONFIG_VERSION:
        puts("bcdd " BCD_VERSION);
        return EXIT_OK;
    case CONFIG_WRONG:
        fprintf(stderr, "bcdd: %s\n(bcdd --help tells the options)\n", reason);
        return EXIT_USAGE;
    case CONFIG_RUN:
        break;
    }
    gsl_set_error_handler_off(); /* its own would abort the process */
    heap_json_init();
    raise_descriptors();
    crash_watch();
    return serve(&config);
}

static int serve(const struct config *config)
{
    atomic_flag backup = ATOMIC_FLAG_INIT;
    struct metrics metrics = {.started_s = time(NULL)};
    struct stream_counts streams = STREAM_COUNTS_INIT;
    struct description description = {0};
    struct service service = {
        .backup = &backup, .metrics = &metrics, .streams = &streams, .description = &description};
    struct http *http = NULL;
    struct elsewhere elsewhere = {0};
    char reason[512] = "the store or the queue cannot be started, the log says why";
    int result = EXIT_FAILED;
    sigset_t ending;
    block_signals(&ending);
    if (!description_init(&description)) {
        snprintf(reason, sizeof(reason), "out of memory");
        goto cleanup;
    }
    if (store_open(&service.store, config->data, reason, sizeof(reason)) != STORE_OK ||
        access_create(&service.access, service.store, config->auth,
                      http_guard_loopback(config->host), reason, sizeof(reason)) != STORE_OK)
        goto cleanup;
    if (!begin_queue(&service, config) || !start_threads(config, &service, reason, sizeof(reason)))
        goto cleanup;
    const struct http_options options = {.host = config->host,
                                         .names = config->names,
                                         .port = config->port,
                                         .handler = routes_dispatch,
                                         .observer = observe,
                                         .log_reads = config->log_reads,
                                         .context = &service};
    http = http_start(&options, reason, sizeof(reason));
    if (!http)
        goto cleanup;
    atomic_store(&service.http, http);
    feed_wake(service.feed, wake, http);
    announce(config, http_port(http));
    if (!start_elsewhere(config, &elsewhere, &service, reason, sizeof(reason)))
        goto cleanup;
    wait_for_end(&ending);
    result = EXIT_OK;
cleanup:
    if (result != EXIT_OK)
        fprintf(stderr, "bcdd: %s\n", reason);
    if (service.feed)
        feed_wake(service.feed, NULL, NULL);
    for (int i = 0; i < LANES; i++)
        aside_stop(service.lane[i]); /* they call http.c */
    http_stop(http);
    slurm_stop(elsewhere.slurm);
    share_stop(elsewhere.share);
    for (int i = 0; i < LANES; i++)
        aside_free(service.lane[i]);
    if (service.queue)
        queue_stop(service.queue);
    report_keeper_free(service.reports);
    workers_stop(service.workers);
    leases_free(service.leases);
    feed_free(service.feed);
    queue_free(service.queue);
    access_free(service.access);
    store_close(service.store);
    description_fini(&description);
    return result;
}

static bool start_threads(const struct config *config, struct service *service, char *reason,
                          size_t size)
{
    if (config->backend != BACKEND_LOCAL)
        service->leases = leases_create(config->lease_ms);
    if (config->backend == BACKEND_LOCAL || service->leases)
        service->workers =
            workers_start_lending(config->workers, service->queue, service->store, service->leases);
    if (!service->workers) {
        snprintf(reason, size, "%zu worker threads cannot be had", config->workers);
        return false;
    }
    workers_step_back(service->workers, config->nice);
    for (int i = LANE_NONE + 1; i < LANES; i++) {
        service->lane[i] = aside_create(&aside_rules[i]);
        if (!service->lane[i]) {
            snprintf(reason, size, "the threads for long requests cannot be had");
            return false;
        }
    }
    return true;
}

/* The queue with what was in motion, and what stands around it. */
static bool begin_queue(struct service *service, const struct config *config)
{
    if (queue_create(&service->queue, service->store) != STORE_OK)
        return false;
    queue_set_limits(service->queue, &config->limits);
    if (queue_recover(service->queue) != STORE_OK ||
        feed_create(&service->feed, service->store, service->queue) != STORE_OK)
        return false;
    /* Measurements are the least urgent of all, where anything is to give way. */
    service->reports = report_keeper_create(service->store, config->nice > 0 ? REPORTS_NICE : 0);
    return service->reports != NULL;
}

/* Workers find the daemon where it listens, unless there is another way. */
static bool start_elsewhere(const struct config *config, struct elsewhere *elsewhere,
                            struct service *service, char *reason, size_t size)
{
    bool v6 = strchr(config->host, ':') != NULL;
    char url[128];
    snprintf(url, sizeof(url), "http://%s%s%s:%d", v6 ? "[" : "", config->host, v6 ? "]" : "",
             http_port(atomic_load(&service->http)));
    if (config->share && !(elsewhere->share = share_start(config->share, service->leases,
                                                          config->lease_ms, reason, size)))
        return false;
    const struct slurm_way way = {.url = url, .share = config->share, .chunks = config->workers};
    if (config->backend == BACKEND_SLURM)
        elsewhere->slurm = slurm_start(config->slurm, service->leases, &way, reason, size);
    atomic_store(&service->slurm, elsewhere->slurm);
    return config->backend != BACKEND_SLURM || elsewhere->slurm;
}

static void observe(void *context, const struct http_done *done)
{
    const struct service *service = context;
    metrics_observe(service->metrics, done);
}

/* Something happened to a job. */
static void wake(void *http)
{
    http_pulse(http);
}

/* The first line on stdout: whoever started the daemon reads the port from it. */
static void announce(const struct config *config, uint16_t port)
{
    bool v6 = strchr(config->host, ':') != NULL;
    printf("listening on http://%s%s%s:%d\n", v6 ? "[" : "", config->host, v6 ? "]" : "", port);
    fflush(stdout);
    log_write(LOG_LEVEL_INFO, "listening",
              LOG_FIELDS(log_text("host", config->host), log_integer("port", port),
                         log_integer("workers", (int64_t)config->workers),
                         log_text("version", BCD_VERSION)));
}

static void wait_for_end(const sigset_t *ending)
{
    int number = 0;
    notify_manager("READY=1");
    sigwait(ending, &number);
    notify_manager("STOPPING=1");
    log_write(LOG_LEVEL_INFO, "stopping", LOG_FIELDS(log_text("signal", sigabbrev_np(number))));
}

/* SIGPIPE: a client that hangs up, or a reader of our stdout, must not end the daemon. SIGXFSZ: a
 * limit on file sizes is a full disk, which the store reports. */
static void block_signals(sigset_t *ending)
{
    sigemptyset(ending);
    sigaddset(ending, SIGTERM);
    sigaddset(ending, SIGINT);
    sigaddset(ending, SIGHUP);
    pthread_sigmask(SIG_BLOCK, ending, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
}

/* Thousands of connections need more descriptors than the usual soft limit gives. */
static void raise_descriptors(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= DESCRIPTORS_WANTED)
        return;
    limit.rlim_cur = limit.rlim_max < DESCRIPTORS_WANTED ? limit.rlim_max : DESCRIPTORS_WANTED;
    setrlimit(RLIMIT_NOFILE, &limit);
}
