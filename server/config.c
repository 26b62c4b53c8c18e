/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "config.h"
#include "limits.h"

#include <arpa/inet.h>
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WORKERS_NICE = 5 };

static const char *option_value(const char *name, char *const **argument);
static bool limit_option(char *const **argument, struct config *config, char *reason, size_t size);
static bool parse_listen(const char *text, struct config *config, char *reason, size_t size);
static bool backend_option(char *const **argument, struct config *config, char *reason,
                           size_t size);
static bool parse_backend(const char *name, enum backend *backend, char *reason, size_t size);
static bool add_name(const char *name, struct config *config, char *reason, size_t size);
static bool parse_count(const char *text, unsigned long max, unsigned long *value);
static size_t cores(void);

const char *config_usage(void)
{
    return "usage: bcdd --data DIR [--listen HOST:PORT] [--workers N] [--auth MODE]\n"
           "            [--backend local|workers|slurm] [--slurm FILE] [--share DIR]\n"
           "            [--lease SECONDS] [--host-name NAME] [--log all|changes] [--nice N]\n"
           "            [--memory BYTES] [--overrun-factor K] [--overrun-seconds S]\n"
           "       bcdd token create|list|revoke --help\n"
           "Brownian cluster dynamics as a service: jobs in over HTTP, results out.\n"
           "\n"
           "  --data DIR          where jobs and results are kept; created when missing\n"
           "  --listen HOST:PORT  address to listen on (127.0.0.1:8080); port 0 picks one. An\n"
           "                      address that others can reach needs an admin's token first\n"
           "  --workers N         threads that simulate (as many as there are cores); with other\n"
           "                      backends how many chunks are lent at a time, at most (1024)\n"
           "  --backend WHERE     where jobs are run: local, here; workers: by bcd worker,\n"
           "                      anywhere; slurm: the same, started by Slurm\n"
           "  --slurm FILE        how Slurm is to start them; slurm.conf.example tells\n"
           "  --share DIR         workers and daemon meet in this directory, not over HTTP\n"
           "  --lease SECONDS     who runs a chunk elsewhere is heard of this often, or somebody\n"
           "                      else gets it: 2..3600 (30)\n"
           "  --nice N            how far they give way to requests and other programs: 0..19\n"
           "                      (5); with 0 nor do measurements for reports\n"
           "  --log all|changes   requests in the log: all, or without reads that go well (all)\n"
           "  --auth MODE         auto: on loopback nobody needs a token until there is one;\n"
           "                      required: everybody does; open: nobody, on loopback only\n"
           "  --host-name NAME    a name that clients call this server by; may be repeated\n"
           "  --memory BYTES      that one part of a job in motion may have (4e9)\n"
           "  --overrun-factor K  a part of a job that has used more than K times the estimate,\n"
           "  --overrun-seconds S and S core seconds more, is stopped; the job failed (10, 60)\n"
           "  --version           print the version\n"
           "  --help              print this\n";
}

enum config_action config_parse(int argc, char *const *argv, struct config *config, char *reason,
                                size_t size)
{
    unsigned long workers = 0, nice = WORKERS_NICE;
    *config = (struct config){.host = "127.0.0.1", .port = 8080, .log_reads = true};
    config->limits = job_limits_usual();
    config->lease_ms = LIMIT_LEASE_MS;
    char *const *end = argv + argc;
    for (char *const *argument = argv + 1; argument < end; argument++) {
        const char *name = *argument, *value;
        if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0)
            return CONFIG_HELP;
        if (strcmp(name, "--version") == 0)
            return CONFIG_VERSION;
        if ((value = option_value("--listen", &argument))) {
            if (!parse_listen(value, config, reason, size))
                return CONFIG_WRONG;
        } else if ((value = option_value("--data", &argument))) {
            config->data = value;
        } else if ((value = option_value("--log", &argument))) {
            config->log_reads = strcmp(value, "all") == 0;
            if (!config->log_reads && strcmp(value, "changes") != 0) {
                snprintf(reason, size, "--log takes all or changes, not \"%s\"", value);
                return CONFIG_WRONG;
            }
        } else if ((value = option_value("--workers", &argument))) {
            if (!parse_count(value, LIMIT_WORKERS_MAX, &workers) || workers == 0) {
                snprintf(reason, size, "--workers takes a number from 1 to %d, not \"%s\"",
                         LIMIT_WORKERS_MAX, value);
                return CONFIG_WRONG;
            }
        } else if ((value = option_value("--nice", &argument))) {
            if (!parse_count(value, 19, &nice)) {
                snprintf(reason, size, "--nice takes a number from 0 to 19, not \"%s\"", value);
                return CONFIG_WRONG;
            }
        } else if (limit_option(&argument, config, reason, size) ||
                   backend_option(&argument, config, reason, size)) {
            if (reason[0])
                return CONFIG_WRONG;
        } else if ((value = option_value("--auth", &argument))) {
            if (!access_mode_parse(value, &config->auth)) {
                snprintf(reason, size, "--auth takes auto, required or open, not \"%s\"", value);
                return CONFIG_WRONG;
            }
        } else if ((value = option_value("--host-name", &argument))) {
            if (!add_name(value, config, reason, size))
                return CONFIG_WRONG;
        } else {
            snprintf(reason, size, "\"%s\" is no option, or lacks its value", name);
            return CONFIG_WRONG;
        }
    }
    config->workers = workers > 0                        ? workers
                      : config->backend == BACKEND_LOCAL ? cores()
                                                         : LIMIT_WORKERS_MAX;
    config->nice = (int)nice;
    if ((config->backend == BACKEND_SLURM) != (config->slurm != NULL)) {
        snprintf(reason, size, "--backend slurm and --slurm FILE belong together");
        return CONFIG_WRONG;
    }
    if (config->share && config->backend == BACKEND_LOCAL) {
        snprintf(reason, size, "--share is for --backend workers or slurm");
        return CONFIG_WRONG;
    }
    if (config->data && config->data[0])
        return CONFIG_RUN;
    snprintf(reason, size, "--data DIR is needed: the place for jobs and results");
    return CONFIG_WRONG;
}

/* One of the limits of jobs: true if it was, with the reason if it is wrong. */
static bool limit_option(char *const **argument, struct config *config, char *reason, size_t size)
{
    const struct {
        const char *name;
        double *value, least;
    } rows[] = {
        {"--memory", &config->limits.run_bytes, 1},
        {"--overrun-factor", &config->limits.overrun_factor, 0},
        {"--overrun-seconds", &config->limits.overrun_seconds, 0},
    };
    reason[0] = '\0';
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        char *end = NULL;
        const char *text = option_value(rows[i].name, argument);
        if (!text)
            continue;
        double value = strtod(text, &end);
        if (end == text || *end || !(value >= rows[i].least) || !isfinite(value))
            snprintf(reason, size, "%s takes a number from %g on, not \"%s\"", rows[i].name,
                     rows[i].least, text);
        *rows[i].value = value;
        return true;
    }
    return false;
}

/* Where jobs are run: true if it was such an option, with the reason if it is wrong. */
static bool backend_option(char *const **argument, struct config *config, char *reason, size_t size)
{
    const char *value;
    unsigned long seconds;
    reason[0] = '\0';
    if ((value = option_value("--backend", argument))) {
        parse_backend(value, &config->backend, reason, size);
        return true;
    }
    if ((value = option_value("--slurm", argument))) {
        config->slurm = value;
        return true;
    }
    if ((value = option_value("--share", argument))) {
        config->share = value;
        return true;
    }
    if (!(value = option_value("--lease", argument)))
        return false;
    if (!parse_count(value, 3600, &seconds) || seconds < 2)
        snprintf(reason, size, "--lease takes 2 to 3600 seconds, not \"%s\"", value);
    else
        config->lease_ms = (int64_t)seconds * 1000;
    return true;
}

/* The value of "--name value" or "--name=value", NULL if this is another option or the value is
 * missing. argv ends with NULL. Moves on to the value. */
static const char *option_value(const char *name, char *const **argument)
{
    size_t length = strlen(name);
    const char *text = **argument;
    if (strncmp(text, name, length) != 0)
        return NULL;
    if (text[length] == '=')
        return text + length + 1;
    if (text[length] != '\0' || !(*argument)[1])
        return NULL;
    return *++*argument;
}

static bool parse_listen(const char *text, struct config *config, char *reason, size_t size)
{
    const char *colon = strrchr(text, ':');
    unsigned long port;
    if (!colon || !parse_count(colon + 1, UINT16_MAX, &port)) {
        snprintf(reason, size, "--listen takes HOST:PORT, not \"%s\"", text);
        return false;
    }
    bool bracket = text[0] == '[' && colon > text + 1 && colon[-1] == ']';
    int length = (int)(colon - text) - 2 * bracket;
    char host[sizeof(config->host)];
    struct in6_addr any;
    if (snprintf(host, sizeof(host), "%.*s", length, text + bracket) >= (int)sizeof(host))
        host[0] = '\0';
    if (strcmp(host, "localhost") == 0)
        snprintf(host, sizeof(host), "127.0.0.1");
    if (inet_pton(bracket ? AF_INET6 : AF_INET, host, &any) != 1) {
        snprintf(reason, size, "--listen takes a numeric address like 127.0.0.1 or [::1]: \"%s\"",
                 text);
        return false;
    }
    snprintf(config->host, sizeof(config->host), "%s", host);
    config->port = (uint16_t)port;
    return true;
}

static bool parse_backend(const char *name, enum backend *backend, char *reason, size_t size)
{
    *backend = strcmp(name, "workers") == 0 ? BACKEND_WORKERS
               : strcmp(name, "slurm") == 0 ? BACKEND_SLURM
                                            : BACKEND_LOCAL;
    if (*backend != BACKEND_LOCAL || strcmp(name, "local") == 0)
        return true;
    snprintf(reason, size, "--backend takes local, workers or slurm, not \"%s\"", name);
    return false;
}

/* One more name; what it is made of is what names of machines are made of. */
static bool add_name(const char *name, struct config *config, char *reason, size_t size)
{
    size_t count = 0, length = strlen(name);
    while (config->names[count])
        count++;
    if (count == LIMIT_HOST_NAMES_MAX)
        snprintf(reason, size, "--host-name is possible %d times", LIMIT_HOST_NAMES_MAX);
    else if (length == 0 || length > 253 ||
             strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-") !=
                 length)
        snprintf(reason, size, "--host-name takes a name without a port, not \"%s\"", name);
    else
        config->names[count] = name;
    return config->names[count] != NULL;
}

static bool parse_count(const char *text, unsigned long max, unsigned long *value)
{
    size_t length = strlen(text);
    if (length == 0 || length > 9 || strspn(text, "0123456789") != length)
        return false;
    *value = strtoul(text, NULL, 10);
    return *value <= max;
}

/* Those this process may use. */
static size_t cores(void)
{
    cpu_set_t set;
    int count = sched_getaffinity(0, sizeof(set), &set) == 0 ? CPU_COUNT(&set) : 1;
    return count > LIMIT_WORKERS_MAX ? LIMIT_WORKERS_MAX : (size_t)count;
}
