/* SPDX-License-Identifier: GPL-3.0-or-later
 * config.h - the daemon's command line. */
#ifndef CONFIG_H
#define CONFIG_H

#include "access.h"
#include "job_admit.h"
#include "limits.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum backend {
    BACKEND_LOCAL,   /* chunks are run here */
    BACKEND_WORKERS, /* they are lent to whoever asks: bcd worker */
    BACKEND_SLURM,   /* the same, and workers are started by Slurm */
};

struct config {
    char host[64];    /* numeric address */
    uint16_t port;    /* 0 = pick a free one */
    const char *data; /* borrowed from argv */
    size_t workers;   /* threads, or chunks that are lent at a time */
    enum backend backend;
    const char *slurm; /* file that says how; borrowed from argv */
    const char *share; /* directory for workers that cannot reach the daemon; NULL = none */
    int64_t lease_ms;  /* a worker elsewhere that was not heard of for so long has lost its chunk */
    int nice;          /* what is added to theirs */
    bool log_reads; /* a line in the log for each request, not only for those that change or fail */
    enum access_mode auth;
    struct job_limits limits;
    const char *names[LIMIT_HOST_NAMES_MAX + 1]; /* borrowed; NULL ends them */
};

enum config_action { CONFIG_RUN, CONFIG_HELP, CONFIG_VERSION, CONFIG_WRONG };

/* For CONFIG_WRONG, `reason` says what is wrong in words for the operator. */
enum config_action config_parse(int argc, char *const *argv, struct config *config, char *reason,
                                size_t size);

const char *config_usage(void);

#endif
