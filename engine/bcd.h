/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * bcd.h - the one door to libbcd, the simulation engine.
 *
 * A job travels through five objects, in this order:
 *
 *   bcd_scene   what is to be simulated: parameters and parts, checked and completed with defaults
 *   bcd_run     one chunk of it in motion: a few realizations, advanced in slices of ticks; several
 *               of them may go together as a bcd_team
 *   bcd_tally   what the runs measured: means and variances over independent samples
 *   bcd_table   the result of one observable: named columns, ready to be shown
 *
 * The engine knows no HTTP, JSON, SQL, clock, thread or log; it never prints or exits, and calls
 * back for one thing alone: whether to go on (struct bcd_watch).
 *
 * UNITS    The user's own length, time and energy units throughout (lambda, t, kT). Time is
 *          tick * time_step, never a running sum.
 * ERRORS   Functions that can fail return enum bcd_status (0 = BCD_OK) and fill the optional,
 *          caller-owned struct bcd_error. Outputs are untouched on failure.
 * MEMORY   _create = the caller owns it and ends it with _free, which accepts NULL. `const T *` is
 *          borrowed until its parent changes.
 * THREADS  No globals. A prepared scene is immutable and may be shared; every other object belongs
 *          to one thread at a time.
 */
#ifndef BCD_H
#define BCD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#pragma GCC visibility push(default)

#define BCD_VERSION "0.1.0"

/* Raised by one whenever the same job and seed would give other numbers than before. */
#define BCD_RESULT_VERSION 5

/* ------------------------------------------------------------------ status */

enum bcd_status {
    BCD_OK = 0,
    BCD_INVALID,  /* the job asks for something wrong or impossible: its author can mend it */
    BCD_NO_MEMORY,
    BCD_CORRUPT,  /* a checkpoint, tally or table does not belong here or is damaged */
    BCD_INTERNAL, /* our own mistake */
    BCD_STOPPED,  /* its watch (see below) ended it before it was done */
};

const char *bcd_status_text(enum bcd_status status);

/* One fault: which field of the job (a JSON pointer such as "/potential/amplitude", or "") and what
 * is wrong with it, in words that name the value and the limit. */
struct bcd_error {
    enum bcd_status code;
    char field[96];
    char text[256];
};

/* All faults of a job at once. count may not exceed the array: later faults only raise
 * `dropped`. */
enum { BCD_ERRORS_MAX = 32 };
struct bcd_errors {
    size_t count, dropped;
    struct bcd_error items[BCD_ERRORS_MAX];
};

/* Appends a fault to the list (printf-style). Also for callers that read jobs, so that theirs and
 * the engine's faults end up in one list. errors may be NULL. */
void bcd_errors_add(struct bcd_errors *errors, const char *field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* ------------------------------------------------------------------- watch */

/* Over computations that may take long. They count what they do in core seconds of a nominal
 * machine, so that what seconds_max or bytes_max cut off is the same everywhere, and ask
 * should_stop every few of its milliseconds. Whatever ends under a watch that has said no is
 * BCD_STOPPED. One watch may go over several computations, one after another; what follows once it
 * has ended ends at once. A watch that is a NULL pointer never ends anything. */
enum bcd_watch_end {
    BCD_WATCH_GOES_ON,
    BCD_WATCH_TOLD,    /* should_stop said so */
    BCD_WATCH_SECONDS, /* more than seconds_max */
    BCD_WATCH_BYTES,   /* more than bytes_max */
};
struct bcd_watch {
    bool (*should_stop)(void *context); /* NULL = never */
    void *context;
    double seconds_max, bytes_max; /* 0 = without limit */
    /* Zeroed by the caller, then the engine's: */
    double seconds;    /* nominal, used so far */
    double bytes;      /* memory in use at the moment */
    double bytes_most; /* the most that there was */
    double asked;      /* seconds when should_stop was asked last */
    enum bcd_watch_end end;
};

/* -------------------------------------------------------------- parameters */

enum bcd_param_type {
    BCD_PARAM_INTEGER, /* int64_t */
    BCD_PARAM_NUMBER,  /* double */
    BCD_PARAM_AUTO,    /* double, or "auto" (held as NaN) */
    BCD_PARAM_CHOICE,  /* one of a list of words (held as its index, int64_t) */
    BCD_PARAM_NUMBERS, /* a list of doubles (struct bcd_numbers) */
    BCD_PARAM_TEXT,    /* printable ASCII (char *, NULL = not given) */
};

/* A list, owned by the group it is a value of. */
struct bcd_numbers {
    size_t count;
    double *at;
};

/* One row of a parameter table. Checks, readers, writers and documentation all come from it. */
struct bcd_param {
    const char *name;
    enum bcd_param_type type;
    bool required;           /* no default: the job must give it */
    bool above_min;          /* the minimum itself is refused */
    const char *unit;        /* "length", "time", "energy", ... or "" */
    double min, max;         /* for numbers and integers, inclusive unless above_min; in a list
                              * for each of its numbers */
    size_t least, most;      /* how many numbers a list holds, how many characters a text */
    double fallback;         /* default: number, integer, index of a choice, or NaN = "auto" */
    const char *(*choice)(size_t index); /* the words of a CHOICE; NULL past the last */
    const char *doc;
    size_t offset;           /* where the value lives in the group's values */
};

/* The parameters of one object of the job: the job itself (pointer ""), its potential
 * ("/potential"), one observable ("/observables/msd"). rows end with name == NULL. */
struct bcd_group {
    const struct bcd_param *rows;
    void *values;
    uint64_t given;    /* bit i: row i was set by the job */
    char pointer[64];  /* JSON pointer of the object */
    const char *type;  /* the part's name ("cosine", "msd"); NULL for the job itself */
};

/* Row by name, or NULL. */
const struct bcd_param *bcd_group_find(const struct bcd_group *group, const char *name);

/* Set one value after checking type and range; a fault is appended to errors and false returned.
 * _number refuses NaN and infinities; for an INTEGER row it accepts whole numbers up to 2^53 only
 * through _integer. _numbers copies a list. _text sets a CHOICE, "auto", or copies a TEXT. */
bool bcd_group_set_integer(struct bcd_group *group, const struct bcd_param *row, int64_t value,
                           struct bcd_errors *errors);
bool bcd_group_set_number(struct bcd_group *group, const struct bcd_param *row, double value,
                          struct bcd_errors *errors);
bool bcd_group_set_numbers(struct bcd_group *group, const struct bcd_param *row,
                           const double *values, size_t count, struct bcd_errors *errors);
bool bcd_group_set_text(struct bcd_group *group, const struct bcd_param *row, const char *value,
                        struct bcd_errors *errors);

/* Read one value back. _number of a list or text is NaN. _text gives the word of a CHOICE; "auto"
 * for an AUTO row that holds it; a TEXT, "" where none was given; NULL where the row holds a number
 * or a list. _numbers gives a list, borrowed. */
int64_t bcd_group_integer(const struct bcd_group *group, const struct bcd_param *row);
double bcd_group_number(const struct bcd_group *group, const struct bcd_param *row);
struct bcd_numbers bcd_group_numbers(const struct bcd_group *group, const struct bcd_param *row);
const char *bcd_group_text(const struct bcd_group *group, const struct bcd_param *row);

/* ------------------------------------------------------------------- scene */

/* What kinds of parts a scene is put together from; the job's key of each kind is
 * bcd_slot_key(slot). A slot with `many` holds an object of parts by name ("observables"), one that
 * is `typed` one part chosen by its "type" ("potential"), the others the only part there is. */
enum bcd_slot {
    BCD_SLOT_POTENTIAL,
    BCD_SLOT_INTERACTION,
    BCD_SLOT_OBSERVABLE,
    BCD_SLOT_TARGET,
    BCD_SLOT_COUNT
};
const char *bcd_slot_key(enum bcd_slot slot);
bool bcd_slot_many(enum bcd_slot slot);
bool bcd_slot_typed(enum bcd_slot slot);

/* The catalogue: name, documentation and rows of the index-th part of a kind; NULL past the last.
 * Methods are chosen by the job's "method" and have no parameters of their own. */
struct bcd_part {
    const char *name, *doc;
    const struct bcd_param *params;
};
const struct bcd_part *bcd_catalogue(enum bcd_slot slot, size_t index);
const struct bcd_param *bcd_job_params(void);

struct bcd_scene;

enum bcd_status bcd_scene_create(struct bcd_scene **scene);
void bcd_scene_free(struct bcd_scene *scene);

/* The job's own parameters. */
struct bcd_group *bcd_scene_job(struct bcd_scene *scene);

/* Puts a part into a slot and returns its parameters, to be set; NULL with a fault in errors when
 * there is no such part, or the slot holds one already. */
struct bcd_group *bcd_scene_add(struct bcd_scene *scene, enum bcd_slot slot, const char *type,
                                struct bcd_errors *errors);

/* The index-th part of a slot, in the catalogue's order; NULL past the last. */
const struct bcd_group *bcd_scene_part(const struct bcd_scene *scene, enum bcd_slot slot,
                                       size_t index);
const struct bcd_group *bcd_scene_job_view(const struct bcd_scene *scene);

/* What the engine found out about potentials and interactions of scenes completed before, so that a
 * scene much like them is completed faster, without a bit's difference. Bounded in size (1024 of
 * each); belongs to one thread at a time; may be freed before the scenes. */
struct bcd_scene_cache;
enum bcd_status bcd_scene_cache_create(struct bcd_scene_cache **cache);
void bcd_scene_cache_free(struct bcd_scene_cache *cache);

/* Fills in defaults, checks everything that one field alone cannot tell, chooses method and time
 * step. All faults are appended to errors; BCD_INVALID if there are any (those that the caller
 * put there before included). cache may be NULL. Takes some ten microseconds, without a cache up to
 * milliseconds. */
enum bcd_status bcd_scene_complete(struct bcd_scene *scene, struct bcd_scene_cache *cache,
                                   struct bcd_errors *errors);

/* Makes what runs of a completed scene need and nothing before does: how "initial": "equilibrium"
 * is drawn, which takes up to seconds. BCD_INVALID, with the fault, where that turns out to be
 * impossible; BCD_STOPPED, with one as well, by the watch (may be NULL), and the scene as it was.
 * Afterwards the scene is immutable. */
enum bcd_status bcd_scene_prepare(struct bcd_scene *scene, struct bcd_watch *watch,
                                  struct bcd_errors *errors);

/* What the engine derived from a completed job, for the record: diffusion coefficient, time step,
 * method, number of steps, ... The index-th fact, in reading order; NULL past the last.
 * Exactly one of the three values is meant, told by kind. */
enum bcd_fact_kind { BCD_FACT_NUMBER, BCD_FACT_INTEGER, BCD_FACT_TEXT };
struct bcd_fact {
    const char *name, *unit;
    enum bcd_fact_kind kind;
    double number;
    int64_t integer;
    char text[160];
};
const struct bcd_fact *bcd_scene_fact(const struct bcd_scene *scene, size_t index);

/* Bytes that identify the job's outcome: result version, every parameter of the job with its type,
 * defaults filled in, every part. Equal bytes = equal results. Not the seedless physics: the seed
 * is a parameter like any other. Writes at most `size` bytes, returns the length. */
size_t bcd_scene_encode(const struct bcd_scene *scene, void *bytes, size_t size);

/* The same without target and number of realizations, only whether there is more than one: jobs
 * with equal bytes run the same realizations in the same chunks, one of them more than another. */
size_t bcd_scene_encode_family(const struct bcd_scene *scene, void *bytes, size_t size);

/* What the equilibrium of a completed scene depends on, as far as its observables ask for it: jobs
 * with equal bytes can share a theory's. */
size_t bcd_scene_encode_equilibrium(const struct bcd_scene *scene, void *bytes, size_t size);

/* The job's size before it runs. core_seconds is a rough figure for one core. */
struct bcd_estimate {
    double run_bytes;    /* memory of one run in motion, checkpoint included */
    double result_bytes; /* all tables of the result */
    double tally_bytes;  /* tallies of all chunks, kept until the job is done */
    double steps;        /* time steps of all realizations together */
    double rod_steps;    /* steps times particles */
    double core_seconds;
    double theory_seconds; /* 0: whoever has results made adds bcd_theory_estimate's, to both */
};
void bcd_scene_estimate(const struct bcd_scene *scene, struct bcd_estimate *estimate);

/* Force between two neighbours of a completed scene whose surfaces are `gap` >= 0 apart, positive =
 * repulsion; 0 without interaction and beyond its range. */
double bcd_scene_pair_force(const struct bcd_scene *scene, double gap);

/* Realizations are run in chunks; how many a chunk holds depends on the job alone, so that the
 * order of reduction, and with it every bit of the result, does not depend on workers or
 * restarts. */
int64_t bcd_scene_chunks(const struct bcd_scene *scene);

/* How many realizations the first `chunks` of them hold. */
int64_t bcd_scene_realizations(const struct bcd_scene *scene, int64_t chunks);

/* --------------------------------------------------------------------- run */

struct bcd_run;
struct bcd_tally;
struct bcd_table;

/* Makes ready chunk number `chunk` (0 <= chunk < bcd_scene_chunks) of a prepared scene, which it
 * borrows until freed.
 * All memory is allocated here. */
enum bcd_status bcd_run_create(struct bcd_run **run, const struct bcd_scene *scene, int64_t chunk,
                               struct bcd_error *error);
/* The same under a watch (may be NULL), borrowed until the run is freed: over its memory, and over
 * equilibrium starts, which take up to seconds, here and in bcd_run_advance. What it stops is
 * BCD_STOPPED, and the run then good for nothing but being freed. */
enum bcd_status bcd_run_create_watched(struct bcd_run **run, const struct bcd_scene *scene,
                                       int64_t chunk, struct bcd_watch *watch,
                                       struct bcd_error *error);
void bcd_run_free(struct bcd_run *run);

/* Lets a run that was just created go on from what its chunk's first realizations measured: `tally`
 * of a finished run of the same chunk in a job of the same family (bcd_scene_encode_family), which
 * had fewer. Bit for bit as if it had run them itself. BCD_CORRUPT, and the run as it was, when the
 * tally is another job's, holds more realizations than the chunk, or there is but one: a single
 * realization is cut into blocks, and more of them is another job. */
enum bcd_status bcd_run_continue(struct bcd_run *run, const struct bcd_tally *tally,
                                 struct bcd_error *error);

/* Advances by `ticks` ticks (time steps), those of all realizations of the chunk counted together:
 * by up to 15 more where small rings go side by side, which cannot be cut between them; by less at
 * the end. Cutting a run into slices differently changes no bit of it. Fails only where a
 * realization's equilibrium start cannot be drawn; the run then stands still for good. */
enum bcd_status bcd_run_advance(struct bcd_run *run, int64_t ticks, struct bcd_error *error);
int64_t bcd_run_ticks_done(const struct bcd_run *run);
int64_t bcd_run_ticks_total(const struct bcd_run *run);

/* Checkpoint: a run restored from `bytes` into a freshly created run of the same scene and chunk
 * goes on bit for bit. _save writes exactly _checkpoint_size bytes. On failure the run is as it
 * was. */
size_t bcd_run_checkpoint_size(const struct bcd_run *run);
void bcd_run_save(const struct bcd_run *run, void *bytes);
enum bcd_status bcd_run_restore(struct bcd_run *run, const void *bytes, size_t size,
                                struct bcd_error *error);

/* The same without a copy, for large ones of which little has changed: a checkpoint is a head of
 * BCD_CHECKPOINT_HEAD bytes and pieces of BCD_CHECKPOINT_PIECE, the last one of what is left.
 * _checkpoint_piece: borrowed until the run moves or is freed. _checkpoint_head writes the head,
 * and sums[pieces]: pieces whose sums are those of another moment are the same, too. */
enum { BCD_CHECKPOINT_HEAD = 48, BCD_CHECKPOINT_PIECE = 1 << 16 };
size_t bcd_run_checkpoint_pieces(const struct bcd_run *run);
const void *bcd_run_checkpoint_piece(const struct bcd_run *run, size_t piece, size_t *size);
void bcd_run_checkpoint_head(const struct bcd_run *run, void *head, uint64_t *sums);

/* What a finished run measured. Borrowed from the run. */
const struct bcd_tally *bcd_run_tally(const struct bcd_run *run);

/* ------------------------------------------------------------------- hands */

/* Threads that help with one large ring. They are the caller's: the engine knows none. It cuts a
 * step into parts that need nothing of one another; who does which, and when, changes no bit. */
typedef void (*bcd_part)(void *of, int64_t part);
struct bcd_hands {
    /* How many there are beside the caller, at the moment; 0 = the run goes on alone. */
    int (*count)(void *context);
    /* Calls part(of, i) once for each i = 0 .. parts-1, on any threads, in any order, and returns
     * when all these calls have. */
    void (*share)(void *context, bcd_part part, void *of, int64_t parts);
    void *context;
};

/* Whether there is anything to share: the ring is large. */
bool bcd_scene_takes_hands(const struct bcd_scene *scene);

/* From now on the run calls these, which are borrowed, while it advances; NULL = none. */
void bcd_run_lend_hands(struct bcd_run *run, const struct bcd_hands *hands);

/* -------------------------------------------------------------------- team */

/* Runs of consecutive chunks that are advanced together: small rings go side by side, which takes
 * less time, and each run remains bit for bit what it is alone, at any time between two calls, its
 * checkpoints included. */
struct bcd_team;

/* How many chunks are worth it: 1, or a power of two where chunks hold one realization of a small
 * ring. Any power of two below is possible as well. */
int64_t bcd_scene_team(const struct bcd_scene *scene);

struct bcd_team_wanted {
    const struct bcd_scene *scene; /* prepared; borrowed until the team is freed */
    int64_t first, count;          /* chunks; count: a power of two up to bcd_scene_team */
    struct bcd_watch *watch;       /* of all its runs; may be NULL; borrowed likewise */
};

/* Makes the runs ready as bcd_run_create_watched does. They are the team's own: borrowed from it to
 * be saved, restored, continued, or for their tallies. They need not all be equally far: those that
 * are behind catch up first. */
enum bcd_status bcd_team_create(struct bcd_team **team, const struct bcd_team_wanted *wanted,
                                struct bcd_error *error);
void bcd_team_free(struct bcd_team *team);
int64_t bcd_team_count(const struct bcd_team *team);
struct bcd_run *bcd_team_run(const struct bcd_team *team, int64_t index);

/* As for a run, ticks of all runs counted together. */
enum bcd_status bcd_team_advance(struct bcd_team *team, int64_t ticks, struct bcd_error *error);
int64_t bcd_team_ticks_done(const struct bcd_team *team);
int64_t bcd_team_ticks_total(const struct bcd_team *team);

/* ------------------------------------------------------------------- tally */

/* An empty tally for a scene; tallies of jobs of one family are alike. Chunks are merged in the
 * order 0, 1, 2, ...; other orders give the same numbers only up to rounding. */
enum bcd_status bcd_tally_create(struct bcd_tally **tally, const struct bcd_scene *scene);
void bcd_tally_free(struct bcd_tally *tally);
void bcd_tally_merge(struct bcd_tally *into, const struct bcd_tally *from);

/* How many whole realizations are in it. */
int64_t bcd_tally_realizations(const struct bcd_tally *tally);

/* As bytes (little-endian, versioned, checksummed), to be kept. */
size_t bcd_tally_size(const struct bcd_tally *tally);
void bcd_tally_save(const struct bcd_tally *tally, void *bytes);
enum bcd_status bcd_tally_restore(struct bcd_tally *tally, const void *bytes, size_t size,
                                  struct bcd_error *error);

/* ------------------------------------------------------------------ target */

/* The first milestone after `chunks` chunks, in chunks: about half as many again each time, and all
 * of them at last. Jobs of a family have the same ones as far as they go. */
int64_t bcd_scene_milestone(const struct bcd_scene *scene, int64_t chunks);

/* A job with a target runs only as many of its chunks as it takes, which is looked at at the
 * milestones, so that it depends on the job alone. Up to where the job is to be run once `chunks`
 * are done and were not enough: the next milestone; without target all chunks. */
int64_t bcd_scene_goal(const struct bcd_scene *scene, int64_t chunks);

/* Why no more chunks are run. */
enum bcd_stop {
    BCD_STOP_NOT,          /* more are: up to the next milestone */
    BCD_STOP_ALL,          /* the job has no target */
    BCD_STOP_TARGET,       /* the observable is known well enough */
    BCD_STOP_REALIZATIONS, /* those are all that there may be */
    BCD_STOP_ROD_STEPS,    /* more would cost more than the target allows */
    BCD_STOP_TIME_STEP,    /* the error of the time step alone is larger, beyond doubt */
};
const char *bcd_stop_name(enum bcd_stop stop);

/* What the first milestones' chunks, merged, say about the target. Errors are shares of the value.
 * Of several rows: the root of the sum of squares of the errors over that of the values; where
 * values spread over decades (log_y), the root mean square of the rows' shares. Rows without value
 * or error bar do not count. NaN: there is nothing yet. */
struct bcd_verdict {
    enum bcd_stop stop;
    int64_t realizations;          /* that there are */
    double error;                  /* both, in quadrature */
    double statistical, time_step; /* without estimate of the latter: 0 */
    double expected;               /* realizations that it will probably take in all */
};
enum bcd_status bcd_tally_judge(const struct bcd_tally *tally, const struct bcd_scene *scene,
                                struct bcd_verdict *verdict);

/* ------------------------------------------------------------------ theory */

/* The exact references of a completed scene: equilibrium of the ring of N rods that the simulation
 * samples ("canonical") and of the infinite system at the same density ("infinite"), closed forms
 * elsewhere. Where there is none, tables say why; also where it would take more than the watch's
 * seconds_max or bytes_max: of pairs three quarters of the seconds, for the rest may still be had.
 * Fails for want of memory, or BCD_STOPPED because the watch was told so.
 *
 * watch (NULL = however long it takes) is borrowed until the theory is freed: tables with closed
 * forms look at it too. known (or NULL) is a theory that was not cut short, of the same
 * bcd_scene_encode_equilibrium: what there is of its equilibrium is taken over, the same bits. */
struct bcd_theory;
enum bcd_theory_scope {
    BCD_THEORY_RING,     /* what results stand beside */
    BCD_THEORY_INFINITE, /* and the infinite system */
};
enum bcd_status bcd_theory_create(struct bcd_theory **theory, const struct bcd_scene *scene,
                                  enum bcd_theory_scope scope, struct bcd_watch *watch,
                                  const struct bcd_theory *known);

/* What it will take under a watch of these seconds_max (0 = without), closed forms included:
 * nominal core seconds, right within a factor 2 as a rule, and bytes. */
struct bcd_theory_cost {
    double seconds, bytes;
};
void bcd_theory_estimate(const struct bcd_scene *scene, enum bcd_theory_scope scope,
                         double seconds_max, struct bcd_theory_cost *cost);

/* Whether limits of the watch left something out; its memory; core seconds of a nominal machine
 * that went into the equilibrium, also where it was taken over. */
bool bcd_theory_cut_short(const struct bcd_theory *theory);
size_t bcd_theory_bytes(const struct bcd_theory *theory);
double bcd_theory_seconds(const struct bcd_theory *theory);
void bcd_theory_free(struct bcd_theory *theory);

/* One row of numbers about the equilibrium as a whole, table "equilibrium": external energy,
 * pressure of the infinite system, bonded fraction, the theory's own relative error. Absent columns
 * say why. */
enum bcd_status bcd_theory_summary(const struct bcd_theory *theory, struct bcd_table **table);

/* ------------------------------------------------------------------- table */

enum bcd_role { /* what a column is to a reader or a plot */
    BCD_ROLE_X,
    BCD_ROLE_VALUE,
    BCD_ROLE_STDERR,          /* one standard error of the value column */
    BCD_ROLE_THEORY,          /* exact reference of the value column */
    BCD_ROLE_TIME_STEP_ERROR, /* estimated error from the finite time step */
    BCD_ROLE_OTHER,
    BCD_ROLE_SERIES, /* rows with equal consecutive values here make one curve */
};

struct bcd_column {
    char name[32];
    enum bcd_role role;
    double *values;    /* [rows]; NaN = no number there; NULL = the whole column is absent */
    char reason[160];  /* why it is absent */
};

/* A remark that goes with a result: "stderr_from": "realizations". Text when text[0], else
 * number. */
struct bcd_note {
    char name[32];
    char text[160];
    double number;
};

enum { BCD_COLUMNS_MAX = 8, BCD_NOTES_MAX = 16 };
struct bcd_table {
    char name[32];                  /* the observable */
    bool scalar;                    /* one row, to be shown as numbers rather than lists */
    bool log_x, log_y;              /* how it is usually plotted */
    char x_label[64], y_label[64];  /* axis titles with units */
    size_t rows, columns, notes;
    struct bcd_column column[BCD_COLUMNS_MAX];
    struct bcd_note note[BCD_NOTES_MAX];
};

/* The result of the index-th observable of the scene (same order as bcd_scene_part), with exact
 * values beside it unless theory is NULL. BCD_STOPPED when the theory's watch was told to stop. */
enum bcd_status bcd_tally_table(const struct bcd_tally *tally, const struct bcd_scene *scene,
                                const struct bcd_theory *theory, size_t index,
                                struct bcd_table **table);

/* The exact values alone, on the same rows. */
enum bcd_status bcd_theory_table(const struct bcd_theory *theory, const struct bcd_scene *scene,
                                 size_t index, struct bcd_table **table);
void bcd_table_free(struct bcd_table *table);
const struct bcd_column *bcd_table_column(const struct bcd_table *table, enum bcd_role role);

/* As bytes (little-endian, versioned, checksummed), to be kept. _save writes bcd_table_size
 * bytes. */
size_t bcd_table_size(const struct bcd_table *table);
void bcd_table_save(const struct bcd_table *table, void *bytes);
enum bcd_status bcd_table_load(struct bcd_table **table, const void *bytes, size_t size,
                               struct bcd_error *error);

/* ---------------------------------------------------------------- baseline */

/* What no method can do without: the noise of n rods and the force of a cosine potential, added to
 * y[n], which has room for 3 more, for `ticks` steps, nothing resolved. Benchmarks give step costs
 * as ratios to it. */
void bcd_baseline_noise_and_force(double *y, int64_t n, int64_t ticks);

/* Hand-written loops of one reduced scene each: noise, the forces that the scene has, the method's
 * resolver, and nothing else. Benchmarks compare whole runs with them, in time and memory; the
 * positions are the same to the last bit.
 *
 * All have rods of length 1/2 on a ring of length 2 n, from a lattice, seed 1; the field is a
 * cosine of amplitude 6, the drag 1, the attraction sticky (1, range .05, exponent 3), the density
 * one of 50 bins, looked at every 20 steps. A step is 1e-4 long, 1e-5 with attraction. */
enum bcd_baseline_features {
    BCD_BASELINE_FIELD = 1,
    BCD_BASELINE_DRAG = 2,
    BCD_BASELINE_STICKY = 4,
    BCD_BASELINE_DENSITY = 8,
};
enum bcd_baseline_method { BCD_BASELINE_BCD, BCD_BASELINE_STRANG };
struct bcd_baseline;

/* Which scenes there are: features of the index-th, and its name; NULL past the last. */
const char *bcd_baseline_name(size_t index, unsigned *features);

/* features: one of those above; n >= 2. The caller frees it. */
enum bcd_status bcd_baseline_create(struct bcd_baseline **baseline, unsigned features,
                                    enum bcd_baseline_method method, int64_t n);
void bcd_baseline_free(struct bcd_baseline *baseline);
void bcd_baseline_advance(struct bcd_baseline *baseline, int64_t ticks);

/* x[n]: positions of the rods' centres, unwrapped, where observable trajectory sees them. */
void bcd_baseline_positions(struct bcd_baseline *baseline, double *x);

/* Counts of the density, [50]; of method strang at the middle of noises. NULL without density. */
const int64_t *bcd_baseline_counts(const struct bcd_baseline *baseline);

/* Memory that the loop needs. */
size_t bcd_baseline_bytes(const struct bcd_baseline *baseline);

#pragma GCC visibility pop

#endif
