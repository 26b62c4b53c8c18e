/* SPDX-License-Identifier: GPL-3.0-or-later
 * metrics.c - requests as counted, and all else that is known, as Prometheus text. */
#include "metrics.h"
#include "handle.h"
#include "limits.h"
#include "reply.h"
#include "routes.h"
#include "store_health.h"
#include "text.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static const double buckets_s[METRICS_BUCKETS] = {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                                  0.1,    0.25,  0.5,    1,     2.5,  10};

static size_t route_index(const struct http_done *done);
static void add_head(struct text *text, const char *name, const char *type, const char *help);
static void add_value(struct text *text, const char *name, const char *type, double value,
                      const char *help);
static void add_jobs(struct text *text, const struct service *service);
static void add_work(struct text *text, const struct service *service);
static void add_leases(struct text *text, const struct service *service);
static void add_pilots(struct text *text, const struct service *service);
static void add_requests(struct text *text, const struct metrics *metrics);
static void add_latency(struct text *text, const struct metrics *metrics);
static void add_open(struct text *text, const struct service *service);
static void add_store(struct text *text, const struct service *service);
static void add_process(struct text *text, const struct metrics *metrics);
static int64_t resident_bytes(void);
static int64_t open_descriptors(void);

void metrics_observe(struct metrics *metrics, const struct http_done *done)
{
    int class = done->reply->status / 100;
    if (class<METRICS_CLASSES &&class> 0)
        atomic_fetch_add(&metrics->requests[route_index(done)][class], 1);
    atomic_fetch_add(&metrics->bytes, done->bytes);
    if (done->cut)
        atomic_fetch_add(&metrics->cut, 1);
    if (done->reply->live || done->held)
        return;
    size_t bucket = 0;
    while (bucket < METRICS_BUCKETS && (double)done->us > buckets_s[bucket] * 1e6)
        bucket++;
    atomic_fetch_add(&metrics->latency[bucket], 1);
    atomic_fetch_add(&metrics->latency_us, (uint64_t)done->us);
}

static size_t route_index(const struct http_done *done)
{
    const struct route *route;
    const char *method = strcmp(done->method, "HEAD") == 0 ? "GET" : done->method;
    for (size_t i = 0; done->reply->route && i < METRICS_ROUTES_MAX - 1 && (route = routes_at(i));
         i++)
        if (route->pattern == done->reply->route && strcmp(route->method, method) == 0)
            return i;
    return METRICS_ROUTES_MAX - 1;
}

void handle_service_metrics(const struct service *service, const struct call *call,
                            struct reply *reply)
{
    struct text text = {0};
    (void)call;
    add_head(&text, "bcd_build_info", "gauge", "The program; its value is always 1.");
    text_add(&text, "bcd_build_info{version=\"%s\",result_version=\"%d\"} 1\n", BCD_VERSION,
             BCD_RESULT_VERSION);
    add_jobs(&text, service);
    add_work(&text, service);
    add_leases(&text, service);
    add_pilots(&text, service);
    if (service->metrics) {
        add_requests(&text, service->metrics);
        add_latency(&text, service->metrics);
    }
    add_open(&text, service);
    add_store(&text, service);
    add_process(&text, service->metrics);
    reply_text_take(reply, "text/plain; version=0.0.4; charset=utf-8", text_take(&text));
}

static void add_head(struct text *text, const char *name, const char *type, const char *help)
{
    text_add(text, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void add_value(struct text *text, const char *name, const char *type, double value,
                      const char *help)
{
    add_head(text, name, type, help);
    text_add(text, "%s ", name);
    text_add_number(text, value);
    text_add(text, "\n");
}

static void add_jobs(struct text *text, const struct service *service)
{
    int64_t counts[JOB_STATES];
    struct owner_queued owners[LIMIT_METRICS_OWNERS];
    size_t count = 0;
    if (store_jobs_counts(service->store, counts) != STORE_OK ||
        store_health_queued(service->store, owners, LIMIT_METRICS_OWNERS, &count) != STORE_OK)
        return;
    add_head(text, "bcd_jobs", "gauge", "Jobs in each state.");
    for (int state = 0; state < JOB_STATES; state++)
        text_add(text, "bcd_jobs{state=\"%s\"} %" PRId64 "\n",
                 job_state_name((enum job_state)state), counts[state]);
    add_head(text, "bcd_queued_jobs", "gauge", "Jobs queued, of the owners with most of them.");
    for (size_t i = 0; i < count; i++) /* an owner's name needs no escapes */
        text_add(text, "bcd_queued_jobs{owner=\"%s\"} %" PRId64 "\n", owners[i].owner,
                 owners[i].jobs);
    add_head(text, "bcd_waiting_core_seconds", "gauge",
             "What their jobs, and those that run, are expected to need.");
    for (size_t i = 0; i < count; i++) {
        text_add(text, "bcd_waiting_core_seconds{owner=\"%s\"} ", owners[i].owner);
        text_add_number(text, owners[i].core_seconds);
        text_add(text, "\n");
    }
}

static void add_work(struct text *text, const struct service *service)
{
    if (!service->workers)
        return;
    struct workers_counts counts;
    workers_count(service->workers, &counts);
    add_value(text, "bcd_workers", "gauge", (double)counts.alive, "Threads that simulate.");
    add_value(text, "bcd_workers_busy", "gauge", (double)counts.busy, "Of them, with a chunk.");
    add_value(text, "bcd_chunks_total", "counter", (double)counts.chunks,
              "Parts of jobs finished.");
    add_value(text, "bcd_rod_steps_total", "counter", counts.rod_steps,
              "Steps times particles done.");
    add_value(text, "bcd_core_seconds_total", "counter", counts.core_seconds,
              "Processor time of workers.");
    add_value(text, "bcd_checkpoints_total", "counter", (double)counts.checkpoints,
              "Checkpoints of jobs in motion.");
    add_value(text, "bcd_checkpoint_seconds_total", "counter", counts.saving_seconds,
              "Processor time that they took.");
}

static void add_leases(struct text *text, const struct service *service)
{
    struct lease_counts counts;
    if (!service->leases)
        return;
    leases_count(service->leases, &counts);
    add_value(text, "bcd_leases_held", "gauge", (double)counts.held, "Chunks that workers have.");
    add_value(text, "bcd_leases_offered", "gauge", (double)counts.offered,
              "Chunks that wait for a worker.");
    add_value(text, "bcd_leases_granted_total", "counter", (double)counts.granted,
              "Chunks given to workers.");
    add_value(text, "bcd_leases_expired_total", "counter", (double)counts.expired,
              "Of them, given up: the worker was not heard of.");
    add_value(text, "bcd_leases_returned_total", "counter", (double)counts.returned,
              "Results taken.");
    add_value(text, "bcd_leases_again_total", "counter", (double)counts.again,
              "Results that came once more, with the same bits.");
    add_value(text, "bcd_leases_differed_total", "counter", (double)counts.differed,
              "Results that came once more, with other bits.");
    add_value(text, "bcd_leases_unwanted_total", "counter", (double)counts.unwanted,
              "Results of chunks that nobody waited for, and nobody remembers.");
    add_value(text, "bcd_leases_missed_total", "counter", (double)counts.missed,
              "Questions for a chunk when there was none.");
}

static void add_pilots(struct text *text, const struct service *service)
{
    struct slurm *slurm = atomic_load(&service->slurm);
    struct slurm_counts counts;
    if (!slurm)
        return;
    slurm_count(slurm, &counts);
    add_value(text, "bcd_slurm_pilots_running", "gauge", (double)counts.running,
              "Workers that Slurm runs.");
    add_value(text, "bcd_slurm_pilots_waiting", "gauge", (double)counts.waiting,
              "Workers that wait for a place.");
    add_value(text, "bcd_slurm_pilots_submitted_total", "counter", (double)counts.submitted,
              "Workers asked of Slurm.");
    add_value(text, "bcd_slurm_pilots_failed_total", "counter", (double)counts.failed,
              "Of them, failed by themselves.");
    add_value(text, "bcd_slurm_answers", "gauge", counts.answers, "1 = Slurm's last answer came.");
}

static void add_requests(struct text *text, const struct metrics *metrics)
{
    add_head(text, "bcd_http_requests_total", "counter", "Requests answered.");
    for (size_t i = 0; i < METRICS_ROUTES_MAX; i++) {
        const struct route *route = i < METRICS_ROUTES_MAX - 1 ? routes_at(i) : NULL;
        for (int class = 1; class < METRICS_CLASSES; class ++) {
            uint64_t count = atomic_load(&metrics->requests[i][class]);
            if (count > 0)
                text_add(text,
                         "bcd_http_requests_total{method=\"%s\",route=\"%s\",class=\"%dxx\"} "
                         "%" PRIu64 "\n",
                         route ? route->method : "", route ? route->pattern : "", class, count);
        }
    }
    add_value(text, "bcd_http_sent_bytes_total", "counter", (double)atomic_load(&metrics->bytes),
              "Bytes of answers, without headers.");
    add_value(text, "bcd_http_cut_total", "counter", (double)atomic_load(&metrics->cut),
              "Answers that were not sent to their end.");
}

static void add_latency(struct text *text, const struct metrics *metrics)
{
    static const char name[] = "bcd_http_request_seconds";
    uint64_t count = 0;
    add_head(text, name, "histogram",
             "From the request to the answer's last byte; without streams and ?wait=.");
    for (size_t i = 0; i < METRICS_BUCKETS; i++) {
        count += atomic_load(&metrics->latency[i]);
        text_add(text, "%s_bucket{le=\"", name);
        text_add_number(text, buckets_s[i]);
        text_add(text, "\"} %" PRIu64 "\n", count);
    }
    count += atomic_load(&metrics->latency[METRICS_BUCKETS]);
    text_add(text, "%s_bucket{le=\"+Inf\"} %" PRIu64 "\n%s_sum ", name, count, name);
    text_add_number(text, (double)atomic_load(&metrics->latency_us) / 1e6);
    text_add(text, "\n%s_count %" PRIu64 "\n", name, count);
}

static void add_open(struct text *text, const struct service *service)
{
    struct http *http = atomic_load(&service->http);
    struct http_counts counts;
    if (!http)
        return;
    http_count(http, &counts);
    add_value(text, "bcd_http_connections", "gauge", (double)counts.connections,
              "Open connections.");
    add_value(text, "bcd_http_streams", "gauge", (double)counts.streams, "Open event streams.");
    add_value(text, "bcd_http_waiting", "gauge", (double)counts.holds,
              "Requests that wait: ?wait=, backups, sweeps.");
}

static void add_store(struct text *text, const struct service *service)
{
    struct store_health health;
    store_health(service->store, &health);
    add_value(text, "bcd_store_commits_total", "counter", (double)health.commits,
              "Transactions on disk.");
    add_value(text, "bcd_store_rollbacks_total", "counter", (double)health.rollbacks,
              "Transactions that changed nothing.");
    add_head(text, "bcd_store_failures_total", "counter",
             "Transactions that failed: no room, or another fault (fsync, too).");
    text_add(text,
             "bcd_store_failures_total{cause=\"full\"} %" PRId64 "\n"
             "bcd_store_failures_total{cause=\"broken\"} %" PRId64 "\n",
             health.full, health.broken);
    add_value(text, "bcd_store_bytes", "gauge", (double)health.database_bytes, "The database.");
    add_value(text, "bcd_store_log_bytes", "gauge", (double)health.log_bytes,
              "Its write-ahead log.");
    add_value(text, "bcd_disk_free_bytes", "gauge", (double)health.disk_free_bytes,
              "Of the file system with the database.");
}

/* Under the names that all Prometheus clients give them. */
static void add_process(struct text *text, const struct metrics *metrics)
{
    struct rusage usage;
    struct rlimit limit;
    getrusage(RUSAGE_SELF, &usage);
    getrlimit(RLIMIT_NOFILE, &limit);
    if (metrics)
        add_value(text, "process_start_time_seconds", "gauge", (double)metrics->started_s,
                  "When the process began, since 1970.");
    add_value(text, "process_cpu_seconds_total", "counter",
              (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                  (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / 1e6,
              "Processor time.");
    add_value(text, "process_resident_memory_bytes", "gauge", (double)resident_bytes(),
              "Memory in use.");
    add_value(text, "process_open_fds", "gauge", (double)open_descriptors(), "Open descriptors.");
    add_value(text, "process_max_fds", "gauge", (double)limit.rlim_cur, "Possible descriptors.");
}

static int64_t resident_bytes(void)
{
    int64_t pages = 0;
    FILE *file = fopen("/proc/self/statm", "re");
    if (file) {
        if (fscanf(file, "%*d %" SCNd64, &pages) != 1)
            pages = 0;
        fclose(file);
    }
    return pages * sysconf(_SC_PAGESIZE);
}

static int64_t open_descriptors(void)
{
    int64_t count = -3; /* ".", ".." and the directory itself */
    DIR *dir = opendir("/proc/self/fd");
    if (!dir)
        return 0;
    while (readdir(dir))
        count++;
    closedir(dir);
    return count;
}
