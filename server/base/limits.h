/* SPDX-License-Identifier: GPL-3.0-or-later
 * limits.h - every limit of the service has its name here and a test that hits it. */
#ifndef LIMITS_H
#define LIMITS_H

enum {
    LIMIT_BODY_BYTES_MAX = 1 << 20,        /* request body */
    LIMIT_LIST_ROWS_DEFAULT = 50,          /* GET /v1/jobs */
    LIMIT_LIST_ROWS_MAX = 1000,
    LIMIT_FILTERS_MAX = 8,
    LIMIT_JSON_DEPTH_MAX = 16,
    LIMIT_IDEMPOTENCY_KEY_BYTES_MAX = 255,
    LIMIT_LABEL_CHARACTERS_MAX = 200,      /* of a job */
    LIMIT_TAGS_MAX = 16,
    LIMIT_TAG_BYTES_MAX = 64,
    LIMIT_SWEEP_POINTS_MAX = 100000,       /* of a sweep, extensions included */
    LIMIT_SWEEP_POINTER_BYTES_MAX = 63,    /* of an axis */
    LIMIT_SWEEP_FAULTY_MAX = 1000,         /* points with faults before the rest is not looked at */
    LIMIT_CONNECTIONS_MAX = 6000,
    LIMIT_CONNECTIONS_CROWDED = 1800,      /* from here on idle ones are ended, the oldest first, */
    LIMIT_CONNECTIONS_KEPT = 1500,         /* until so many are left */
    LIMIT_CROWDED_IDLE_MS = 500,           /* then idle, slow or stalled for so long is too long */
    LIMIT_HTTP_THREADS = 4,
    LIMIT_HEADER_BYTES_MAX = 32 << 10,     /* request line and headers of one request */
    LIMIT_QUERY_MAX = 32,                  /* parameters after the "?" */
    LIMIT_BODIES_BYTES_MAX = 64 << 20,     /* bodies of all requests in progress together */
    LIMIT_ANSWERS_BYTES_MAX = 256 << 20,   /* bodies of all answers on their way together */
    LIMIT_SEND_BUFFER_BYTES = 256 << 10,   /* of a connection, in the system */
    LIMIT_ANSWER_AGE_MS_MAX = 600000,      /* from the request's last byte to the answer's */
    LIMIT_STREAM_STALL_MS_MAX = 30000,     /* a client takes nothing of its answer */
    LIMIT_STREAMS_MAX = 500,               /* open event streams */
    LIMIT_MAP_CELLS_MAX = 10000,           /* of a heat map */
    LIMIT_ASIDE_MAX = 16,                  /* long requests of a kind that wait for another, */
    LIMIT_ASIDE_OWNER_MAX = 8,             /* so many of one owner, the one at work included */
    LIMIT_RESULT_AT_ONCE_BYTES = 1 << 18,  /* a longer table is printed aside, */
    LIMIT_RESULTS_OWNER_MAX = 8,           /* so many of one owner and no more */
    LIMIT_THEORY_OWNER_MAX = 4,            /* POST /v1/theory of one owner, waiting or at work */
    LIMIT_HOLDS_MAX = 1000,                /* requests that wait for something to happen */
    LIMIT_WAIT_SECONDS_MAX = 60,           /* ?wait= */
    LIMIT_BACKUP_MS = 500000,              /* GET /v1/backup: until the copy is made and checked */
    LIMIT_OWNER_STREAMS_MAX = 200,         /* open event streams of one owner */
    LIMIT_REQUEST_ID_BYTES_MAX = 64,       /* X-Request-Id; a longer one is not taken over */
    LIMIT_FEED_CHANGES = 4096,             /* of jobs, kept for those who listen */
    LIMIT_FEED_RUNNING = 64,               /* jobs in motion whose progress is told */
    LIMIT_FEED_SAMPLE_MS = 200,
    LIMIT_EVENTS_GAP_MS = 250,             /* between two batches of one event stream */
    LIMIT_PING_MS = 15000,
    LIMIT_METRICS_OWNERS = 20,             /* of queued jobs, each a line of /metrics */
    LIMIT_READY_WRITE_MS = 10000,          /* ready: the store took something this lately */
    LIMIT_READY_WORKER_MS = 600000,        /* ready: a busy worker has moved this lately */
    LIMIT_READY_DISK_BYTES = 64 << 20,     /* ready: so much is free */
    LIMIT_REQUEST_AGE_MS_MAX = 30000,      /* from the first byte to the last */
    LIMIT_IDLE_MS_MAX = 60000,
    LIMIT_WORKERS_MAX = 1024,
    LIMIT_SLICE_MS = 50,                   /* a worker looks at cancel and stop this often */
    LIMIT_CHECKPOINT_MS = 5000,            /* at most this much work is lost by a crash, */
    LIMIT_CHECKPOINT_SHARE = 100,          /* or saving takes more than a part in so many of the */
    LIMIT_CHECKPOINT_WAIT_SHARE = 20,      /* processor's time, or of all time: for slow disks */
    LIMIT_CHECKPOINT_FIRST_MS = 500,       /* less in the beginning: twice as much each time */
    LIMIT_CHECKPOINT_ROW_BYTES = 1 << 20,  /* a larger one has a file of its own beside the base */
    LIMIT_CHECKPOINT_SETTLE_MS = 500,      /* the disk is given so long to write it */
    LIMIT_CHECKPOINT_LOST_MS = 10000,      /* for less work lost the share may be exceeded: by a */
    LIMIT_CHECKPOINT_CREDIT_SHARE = 4,     /* part in so many of the time that a chunk will take, */
    LIMIT_CHECKPOINT_CREDIT_MS = 120000,   /* and of so long a time: the first ones make the file */
    LIMIT_FINISHES_WAITING = 8,            /* of one owner, before more of its jobs are begun */
    LIMIT_CRASHES_MAX = 3,                 /* of the server by one job, which then has failed */
    LIMIT_STARVED_MAX = 5,                 /* attempts lost in a row, with nothing saved and the */
                                           /* kernel out of memory: the job has failed */
    LIMIT_LOST_BARREN = 3,                 /* attempts lost in a row with nothing saved: it rests */
    LIMIT_REST_MS_MAX = 10000,             /* such a job lets others go first for so long */
    LIMIT_DRAIN_MS = 5000,                 /* requests in progress at shutdown */
    LIMIT_LEASE_MS = 30000,                /* a worker elsewhere is heard of this often */
    LIMIT_LEASE_BYTES_MAX = 700 << 10,     /* of a tally or checkpoint that goes to and fro */
    LIMIT_LENT_CHECKPOINT_MS = 60000,      /* of a chunk that is run elsewhere, in the store */
    LIMIT_LENDING_TAKE = 4,                /* threads that lend: so many take chunks at a time, */
    LIMIT_LENDING_WORK = 4,                /* so many put results away and finish jobs */
    LIMIT_LENDING_FIRST = 16,              /* so many there are at first, see worker.h */
    LIMIT_LEASES_OFFERED = 16,             /* chunks that nobody has come for yet: see lease.h */
    LIMIT_LEASE_FAILURES = 2,              /* of a chunk elsewhere, and the job has failed */
    LIMIT_LEASES_REMEMBERED = 4096,        /* results, compared with those that come once more */
    LIMIT_SHARE_LOOK_MS = 500,             /* between two looks into a shared directory */
    LIMIT_USAGE_HALF_LIFE_MS = 86400000,   /* of core seconds used, as far as fair share goes */
    LIMIT_USAGE_SAVE_MS = 5000,            /* core seconds go to the store this often */
    LIMIT_HOST_NAMES_MAX = 16,             /* --host-name */
    LIMIT_TOKENS_MAX = 1000,               /* that are neither revoked nor expired */
    LIMIT_TOKEN_DAYS_MAX = 3650,
    LIMIT_TOKEN_KEPT_DAYS = 90,            /* revoked or expired: then it is forgotten */
    LIMIT_TOKEN_NAME_CHARACTERS_MAX = 100,
    LIMIT_AUDIT_ROWS_MAX = 200000,         /* the oldest lines go */
    LIMIT_AUDIT_REFUSED_MS = 10000,        /* refused authentications: one line in this time */
    LIMIT_SQL_TEXT_BYTES_MAX = 100 << 20,  /* bcd sql: one text or blob; results are shorter */
    LIMIT_SQL_HEAP_BYTES_MAX = 1 << 30,    /* all that a question holds at a time */
    LIMIT_SQL_PATTERN_BYTES_MAX = 1000,    /* of LIKE and GLOB */
    LIMIT_SQL_GRACE_MS = 1000,             /* past --timeout: one costly function may be at work */
    LIMIT_THEORIES_KEPT = 64,              /* exact equilibria, for other jobs of the same system */
};

/* What a finished job leaves behind for others of its family. */
enum {
    LIMIT_SAMPLE_BYTES_MAX = 4 << 20,      /* a longer tally is not kept */
    LIMIT_MILESTONES_BYTES_MAX = 64 << 10, /* its tallies at milestones before the end together */
};

/* A job that the estimate puts above one of these is refused with the limit's name. */
#define LIMIT_RUN_BYTES_MAX 4e9       /* memory of one chunk in motion */
#define LIMIT_RESULT_BYTES_MAX 64e6   /* all tables of one job */
#define LIMIT_DISK_BYTES_MAX 2e9      /* the same, and the parts of one that runs */
#define LIMIT_CORE_SECONDS_MAX 3.2e7  /* one core for a year */

/* Exact theory, in core seconds of a nominal machine, which are counted and not measured: what is
 * beyond is left out, the same everywhere. */
#define LIMIT_THEORY_SECONDS_MAX 30.        /* of one job */
#define LIMIT_THEORY_AT_ONCE_SECONDS .1     /* a longer one of a job is computed aside */
#define LIMIT_THEORY_ANSWER_SECONDS_MAX 10. /* of one POST /v1/theory */
#define LIMIT_THEORY_ANSWER_BYTES_MAX 16e6  /* its tables */
#define LIMIT_THEORIES_BYTES_MAX 32e6       /* of all that are kept */

/* How equilibrium starts are drawn, in the same seconds: looked for at the submission, else left to
 * the start of the job. */
#define LIMIT_PREPARE_SECONDS_MAX .03
#define LIMIT_START_SECONDS_MAX 60.

/* A part of a job that has used more than so many times its estimate, and so many core seconds
 * more, is stopped, and the job failed: --overrun-factor, --overrun-seconds. */
#define LIMIT_OVERRUN_FACTOR 10.
#define LIMIT_OVERRUN_SECONDS 60.

/* Quotas of an owner who was given no others: PUT /v1/owners/OWNER. */
#define LIMIT_OWNER_QUEUED_MAX 1000000
#define LIMIT_OWNER_DAY_SECONDS_MAX 3.2e8 /* used today, and needed by all that waits */
#define LIMIT_OWNER_BYTES_MAX 1e12

#endif
