/* SPDX-License-Identifier: GPL-3.0-or-later
 * route_table.c - the rows; see routes.h. After a change here: make schema. */
#include "limits.h"
#include "routes.h"
#include "store_audit.h"

#include <string.h>

#define JOB "/v1/jobs/{id}"
#define SWEEP "/v1/sweeps/{id}"
#define TOKEN "/v1/tokens/{id}"
#define LEASE "/v1/leases/{id}"
#define WORK "/v1/reports/work-precision"
#define STABILITY "/v1/reports/stability"

#define JSON "application/json"
/* With no schema of its own. */
#define CSV "text/csv", NULL
#define SVG "image/svg+xml", NULL
#define SSE "text/event-stream", NULL
#define PLAIN "text/plain", NULL
#define SAME                                                                                       \
    {                                                                                              \
        304, "", NULL                                                                              \
    } /* for If-None-Match */
#define P(name) ROUTE_PROBLEM(name)

#define EXAMPLE_JOB                                                                                \
    "{\"particles\":10,\"length\":20,\"diameter\":0.5,"                                            \
    "\"potential\":{\"type\":\"cosine\",\"amplitude\":6},\"initial\":\"equilibrium\",\"time\":2,"  \
    "\"observables\":{\"density\":{\"bins\":20},\"energy\":{}}}"

#define EXAMPLE_TOKEN                                                                              \
    "{\"owner\":\"anna\",\"role\":\"submitter\",\"name\":\"laptop\",\"expires_in\":7776000}"

#define EXAMPLE_WORD                                                                               \
    "{\"job\":\"jx\",\"chunk\":0,\"core_seconds\":1.5,\"ticks_done\":10,\"ticks_total\":100}"

#define EXAMPLE_RETURN                                                                             \
    "{\"job\":\"jx\",\"chunk\":0,\"core_seconds\":1.5,\"tally\":\"AA==\","                     \
    "\"sha256\":\"6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d\"}"

#define EXAMPLE_SWEEP                                                                              \
    "{\"base\":" EXAMPLE_JOB ",\"axes\":{\"/diameter\":[0.25,0.5],"                                \
    "\"/seed\":{\"first\":1,\"count\":3}}}"

static const struct query_row submit_query[] = {
    {"force", QUERY_BOOLEAN, .doc = "true runs the job anew although the same one stands"},
    {0},
};

static const struct query_row retry_query[] = {
    {"cancelled", QUERY_BOOLEAN, .doc = "true runs those that were cancelled, too"},
    {0},
};

static const struct query_row list_query[] = {
    {"state", QUERY_WORD, .words = "queued running done failed cancelled", .many = true,
     .doc = "jobs in it, or in one of them"},
    {"owner", QUERY_OWNER, .doc = "whose jobs"},
    {"label", QUERY_LABEL, .doc = "exactly this label"},
    {"tag", QUERY_TAG, .many = true, .doc = "jobs with this tag, with all of them"},
    {"sweep", QUERY_ID, .many = true, .doc = "jobs of this sweep, of all of them"},
    {"submitted_after", QUERY_TIME, .doc = "at this moment or later"},
    {"submitted_before", QUERY_TIME, .doc = "before this moment"},
    {"started_after", QUERY_TIME, .doc = "likewise"},
    {"started_before", QUERY_TIME, .doc = "likewise"},
    {"finished_after", QUERY_TIME, .doc = "likewise"},
    {"finished_before", QUERY_TIME, .doc = "likewise"},
    {"sort", QUERY_TEXT,
     .doc = "any scalar, downwards with a minus before it; usual is -submitted"},
    {"limit", QUERY_INTEGER, .min = 1, .max = LIMIT_LIST_ROWS_MAX, .doc = "how many; 50"},
    {"cursor", QUERY_TEXT, .doc = "\"next\" of the page before, with the same sort"},
    {0},
};

static const struct query_row get_query[] = {
    {"wait", QUERY_NUMBER, .min = 0, .max = LIMIT_WAIT_SECONDS_MAX,
     .doc = "seconds to wait for the job's end, if it has not ended"},
    {0},
};

static const struct query_row events_query[] = {
    {"owner", QUERY_OWNER, .doc = "of this owner's jobs only, and no counts"},
    {"sweep", QUERY_ID, .doc = "of this sweep's jobs only; counts are of its points"},
    {0},
};

static const struct query_row audit_query[] = {
    {"owner", QUERY_OWNER, .doc = "who did it"},
    {"action", QUERY_WORD, .words = STORE_AUDIT_ACTIONS, .doc = "what was done"},
    {"object", QUERY_TEXT, .doc = "id of the job, sweep, token or owner"},
    {"limit", QUERY_INTEGER, .min = 1, .max = LIMIT_LIST_ROWS_MAX, .doc = "how many; 50"},
    {"cursor", QUERY_INTEGER, .min = 1, .max = 1e15, .doc = "\"next\" of the page before"},
    {0},
};

static const struct query_row picture_query[] = {
    {"x", QUERY_TEXT, .doc = "axis that single numbers go along; the first"},
    {"curves", QUERY_TEXT, .doc = "axis that has a curve for each value; the next"},
    {"y", QUERY_TEXT, .doc = "a second axis: a heat map of single numbers over both"},
    {"scale", QUERY_WORD, .words = "linear log", .doc = "of the map's colours; linear"},
    {0},
};

static const struct query_row sweeps_query[] = {
    {"owner", QUERY_OWNER, .doc = "sweeps of this owner"},
    {"limit", QUERY_INTEGER, .min = 1, .max = LIMIT_LIST_ROWS_MAX, .doc = "how many; 50"},
    {"cursor", QUERY_TEXT, .doc = "\"next\" of the page before"},
    {0},
};

static const struct query_row report_query[] = {
    {"begin", QUERY_BOOLEAN,
     .doc = "false: 404 while there is none, instead of having it measured"},
    {0},
};

static const struct query_row measure_query[] = {
    {"budget", QUERY_NUMBER, .min = 0.01, .max = 60, .doc = "core seconds of one entry"},
    {0},
};

/* clang-format off */
static const struct route routes[] = {
    {"POST", "/v1/jobs", ROLE_SUBMITTER, handle_jobs_submit, "submitJob",
     "submit a job; ?force=true runs it anew although it stands",
     "202: it is on disk and will run. 200: the same job stands already, this is its record.",
     .query = submit_query, .idempotency_key = true, .body = "Job", .example = EXAMPLE_JOB,
     .answers = {{202, JSON, "JobRecord"}, {200, JSON, "JobRecord"}},
     .problems = P(DISK_FULL) | P(QUOTA)},
    {"GET", "/v1/jobs", ROLE_READER, handle_jobs_list, "listJobs",
     "jobs; ?state= &sort= &limit= &cursor= and filters like &potential.amplitude=6",
     "Any scalar can be a filter: of the job (diameter=0.5, potential.amplitude>=6), of what was "
     "derived (derived.steps<=1e6), of results (results.energy.energy=0.3..0.5; an end may be "
     "left out), of what became of it (outcome.target.reached=false, outcome.realizations>=100), "
     "priority, owner, label, the moments. != finds jobs without it too. At most 8.",
     .query = list_query, .filters = true, .answers = {{200, JSON, "JobList"}}},
    {"GET", JOB, ROLE_READER, handle_jobs_get, "getJob",
     "one job: state, progress, parameters; ?wait= for its end",
     .query = get_query, .answers = {{200, JSON, "JobRecord"}, SAME}},
    {"GET", JOB "/attempts", ROLE_READER, handle_jobs_attempts, "listAttempts",
     "each time that a job was in motion, newest first, and how that ended",
     "lost: the server ended without a word, no fault of the job's. crashed: the job ended the "
     "server; after three such it has failed. The latest 1000.",
     .answers = {{200, JSON, "AttemptList"}}},
    {"DELETE", JOB, ROLE_SUBMITTER, handle_jobs_cancel, "cancelJob",
     "cancel a job", "Once more does no harm; what has ended otherwise stays: 409.",
     .answers = {{200, JSON, "JobRecord"}}, .problems = P(STATE) | P(DISK_FULL)},
    {"GET", JOB "/results", ROLE_READER, handle_results_all, "getResults",
     "all results of a job", "409 while there are none, and of a job that failed or was cancelled.",
     .answers = {{200, JSON, "Results"}, SAME}, .problems = P(STATE)},
    {"GET", JOB "/results/{name}", ROLE_READER, handle_results_json, "getResult",
     "one observable",
     "Columns as lists, numbers where there is one row. stderr is one standard error, theory "
     "exact, time_step_error what the finite step may have done; null comes with NAME_reason.",
     .answers = {{200, JSON, "Result"}, SAME}, .problems = P(STATE)},
    {"GET", JOB "/results/{name}.csv", ROLE_READER, handle_results_csv, "getResultCsv",
     "one observable as CSV", .answers = {{200, CSV}, SAME}, .problems = P(STATE)},
    {"GET", JOB "/results/{name}.svg", ROLE_READER, handle_results_svg, "getResultPicture",
     "one observable as a picture", .answers = {{200, SVG}, SAME}, .problems = P(STATE)},
    {"GET", JOB "/events", ROLE_READER, handle_events_job, "streamJobEvents",
     "a job's events: progress, then done",
     "Server-Sent Events. data is {\"id\",\"state\",\"progress\"}; the stream ends after done, or "
     "after end, when the token that it came with does.",
     .answers = {{200, SSE}}, .problems = P(QUOTA)},
    {"GET", "/v1/events", ROLE_READER, handle_events_all, "streamEvents",
     "what happens to all jobs: job, counts; ?owner= ?sweep=",
     "Server-Sent Events. job: {\"id\",\"state\",\"owner\",\"progress\"}; counts: jobs by "
     "state; lost: more changed than is told one by one; end: of the token that it came with. "
     "Last-Event-ID goes on where one was.",
     .query = events_query, .answers = {{200, SSE}}, .problems = P(NOT_FOUND) | P(QUOTA)},
    {"POST", "/v1/sweeps", ROLE_SUBMITTER, handle_sweeps_submit, "submitSweep",
     "submit a sweep: a base job and axes that vary it",
     "An axis is a JSON pointer into the job and its values: a list, {\"from\",\"to\",\"points\","
     "\"scale\":\"linear\" or \"log\"}, or {\"first\",\"count\"}. zip names axes that go together. "
     "All points are kept, or none. 200: the same sweep stands already.",
     .idempotency_key = true, .lane = LANE_SWEEPS, .body = "Sweep", .example = EXAMPLE_SWEEP,
     .answers = {{202, JSON, "SweepRecord"}, {200, JSON, "SweepRecord"}},
     .problems = P(QUOTA) | P(DISK_FULL)},
    {"GET", "/v1/sweeps", ROLE_READER, handle_sweeps_list, "listSweeps",
     "sweeps, newest first; ?owner= &limit= &cursor=",
     .query = sweeps_query, .answers = {{200, JSON, "SweepList"}}},
    {"GET", SWEEP, ROLE_READER, handle_sweeps_get, "getSweep",
     "one sweep: how many of its jobs are in each state, axes",
     .answers = {{200, JSON, "SweepRecord"}}},
    {"DELETE", SWEEP, ROLE_SUBMITTER, handle_sweeps_cancel, "cancelSweep",
     "cancel a sweep: what has not ended and nobody else wants",
     .lane = LANE_SWEEPS, .answers = {{200, JSON, "SweepRecord"}}, .problems = P(DISK_FULL)},
    {"POST", SWEEP "/extend", ROLE_SUBMITTER, handle_sweeps_extend, "extendSweep",
     "more values for axes of a sweep", "200: it has all of them already.",
     .lane = LANE_SWEEPS, .body = "SweepExtension", .example = "{\"axes\":{\"/diameter\":[0.75]}}",
     .answers = {{202, JSON, "SweepRecord"}, {200, JSON, "SweepRecord"}},
     .problems = P(STATE) | P(QUOTA) | P(DISK_FULL)},
    {"POST", SWEEP "/retry", ROLE_SUBMITTER, handle_sweeps_retry, "retrySweep",
     "run the jobs of a sweep that failed once more", "200: there are none.",
     .query = retry_query, .lane = LANE_SWEEPS,
     .answers = {{202, JSON, "SweepRecord"}, {200, JSON, "SweepRecord"}},
     .problems = P(STATE) | P(QUOTA) | P(DISK_FULL)},
    {"GET", SWEEP "/results/{name}", ROLE_READER, handle_sweep_results_json, "getSweepResult",
     "one observable of all jobs of a sweep",
     "A row for each point: job, state, the axes' values, and the columns where the job is done.",
     .answers = {{200, JSON, "SweepResult"}}},
    {"GET", SWEEP "/results/{name}.csv", ROLE_READER, handle_sweep_results_csv,
     "getSweepResultCsv", "the same as CSV, of jobs that are done", .answers = {{200, CSV}}},
    {"GET", SWEEP "/results/{name}.ndjson", ROLE_READER, handle_sweep_results_lines,
     "getSweepResultLines", "the same, one line of JSON for each point",
     .answers = {{200, "application/x-ndjson", NULL}}},
    {"GET", SWEEP "/results/{name}.npz", ROLE_READER, handle_sweep_results_npz,
     "getSweepResultArrays", "the same as arrays for numpy.load",
     "An array for each axis, for each column, of job ids and of states; NaN where there is no "
     "result.", .answers = {{200, "application/zip", NULL}}},
    {"GET", SWEEP "/results/{name}.svg", ROLE_READER, handle_sweep_results_svg,
     "getSweepResultPicture",
     "the same as a family of curves, or with ?y= as a heat map; ?x= &curves= &y=",
     "Jobs that differ in seed alone are averaged; axes not drawn stand at their first value.",
     .lane = LANE_DRAWINGS, .query = picture_query, .answers = {{200, SVG}}},
    {"POST", "/v1/estimate", ROLE_READER, handle_jobs_estimate, "estimateJob",
     "a job's cost before it is submitted", .body = "Job", .example = EXAMPLE_JOB,
     .answers = {{200, JSON, "Estimate"}}},
    {"POST", "/v1/forecast", ROLE_READER, handle_forecast, "forecastJob",
     "a job's statistical errors before it is submitted, from a sample of it",
     "Runs some realizations for a fraction of a second. null, with the reason, where that tells "
     "nothing: of slow observables, long lags, costly steps. Good to a factor of two.",
     .lane = LANE_DRAWINGS, .body = "Job", .example = EXAMPLE_JOB,
     .answers = {{200, JSON, "Forecast"}}, .problems = P(TOO_COSTLY)},
    {"POST", "/v1/theory", ROLE_READER, handle_theory, "computeTheory",
     "a job's exact references",
     "For each observable the values on its own bins or lags: theory is the system of N rods, "
     "infinite the one at the same density. One at a time, others wait; 503 when there are many. "
     "What would take too long is null, with the reason.",
     .body = "Job", .example = EXAMPLE_JOB,
     .answers = {{200, JSON, "Theory"}}, .problems = P(TOO_COSTLY) | P(QUOTA)},
    {"GET", "/v1/reports", ROLE_READER, handle_reports_list, "listReports",
     "the reports that this server measures of itself, and how far it is with them",
     .answers = {{200, JSON, "ReportList"}}},
    {"GET", WORK, ROLE_READER, handle_reports_json, "getWorkPrecision",
     "error against run time on this machine",
     "202 while it is being measured, which the first request begins.", .query = report_query,
     .answers = {{200, JSON, "WorkPrecision"}, {202, JSON, "ReportState"}},
     .problems = P(NOT_FOUND) | P(MEASURING)},
    {"GET", WORK ".csv", ROLE_READER, handle_reports_csv, "getWorkPrecisionCsv",
     "error against run time as CSV", .query = report_query,
     .answers = {{200, CSV}, {202, JSON, "ReportState"}},
     .problems = P(NOT_FOUND) | P(MEASURING)},
    {"GET", WORK ".svg", ROLE_READER, handle_reports_svg, "getWorkPrecisionPicture",
     "error against run time as a picture", .query = report_query,
     .answers = {{200, SVG}, {202, JSON, "ReportState"}},
     .problems = P(NOT_FOUND) | P(MEASURING)},
    {"POST", WORK, ROLE_OPERATOR, handle_reports_measure, "measureWorkPrecision",
     "measure it again; ?budget=", .query = measure_query,
     .answers = {{202, JSON, "ReportState"}}, .problems = P(MEASURING)},
    {"DELETE", WORK, ROLE_OPERATOR, handle_reports_stop, "stopWorkPrecision",
     "stop measuring it", .answers = {{200, JSON, "ReportState"}}, .problems = P(MEASURING)},
    {"GET", STABILITY, ROLE_READER, handle_stability_json, "getStability",
     "what every method does at the extremes",
     "202 while it is being measured, with what was found so far; the first request begins it.",
     .query = report_query, .answers = {{200, JSON, "Stability"}, {202, JSON, "ReportState"}},
     .problems = P(NOT_FOUND) | P(MEASURING)},
    {"GET", STABILITY ".csv", ROLE_READER, handle_stability_csv, "getStabilityCsv",
     "what every method does at the extremes as CSV", .query = report_query,
     .answers = {{200, CSV}, {202, JSON, "ReportState"}},
     .problems = P(NOT_FOUND) | P(MEASURING)},
    {"GET", STABILITY ".svg", ROLE_READER, handle_stability_svg, "getStabilityPicture",
     "what every method does at the extremes as a picture", .query = report_query,
     .answers = {{200, SVG}, {202, JSON, "ReportState"}},
     .problems = P(NOT_FOUND) | P(MEASURING)},
    {"POST", STABILITY, ROLE_OPERATOR, handle_stability_measure, "measureStability",
     "measure it again; about two minutes of one core",
     .answers = {{202, JSON, "ReportState"}}, .problems = P(MEASURING)},
    {"DELETE", STABILITY, ROLE_OPERATOR, handle_stability_stop, "stopStability",
     "stop measuring it", .answers = {{200, JSON, "ReportState"}}, .problems = P(MEASURING)},
    {"POST", "/v1/leases", ROLE_WORKER, handle_leases_take, "takeLease",
     "a chunk of a job to run, if there is one",
     "For programs of this project: `bcd worker`.",
     .body = "LeaseRequest", .example = "{\"worker\":\"node7:4711\",\"result_version\":5}",
     .answers = {{200, JSON, "LeaseAnswer"}}},
    {"POST", LEASE "/heartbeat", ROLE_WORKER, handle_leases_hear, "hearLease",
     "how far a chunk is, with a checkpoint now and then", .body = "LeaseWord",
     .example = EXAMPLE_WORD, .answers = {{200, JSON, "LeaseHeard"}}},
    {"POST", LEASE "/return", ROLE_WORKER, handle_leases_return, "returnLease",
     "the tally of a chunk, with its checksum",
     "One that comes once more is compared with the first: `again`, or 409 when it has other bits.",
     .body = "LeaseReturn", .example = EXAMPLE_RETURN, .answers = {{200, JSON, "LeaseTaken"}},
     .problems = P(STATE)},
    {"GET", "/v1/me", ROLE_READER, handle_people_me, "getMe",
     "who you are, what you may use and have used", .answers = {{200, JSON, "Me"}}},
    {"POST", "/v1/tokens", ROLE_ADMIN, handle_people_token_create, "createToken",
     "make a token; the answer shows it, and nothing ever will again",
     "From the first token on every request needs one. The first must be an admin's.",
     .body = "TokenRequest", .example = EXAMPLE_TOKEN,
     .answers = {{201, JSON, "NewToken"}}, .problems = P(TOKENS) | P(DISK_FULL)},
    {"GET", "/v1/tokens", ROLE_ADMIN, handle_people_token_list, "listTokens",
     "tokens, also ended ones (for 90 days), without what is secret",
     .answers = {{200, JSON, "TokenList"}}},
    {"DELETE", TOKEN, ROLE_ADMIN, handle_people_token_revoke, "revokeToken",
     "revoke a token", .answers = {{200, JSON, "Token"}}, .problems = P(TOKENS) | P(DISK_FULL)},
    {"GET", "/v1/owners", ROLE_ADMIN, handle_people_owners, "listOwners",
     "who has jobs or quotas", .answers = {{200, JSON, "OwnerList"}}},
    {"PUT", "/v1/owners/{owner}", ROLE_ADMIN, handle_people_owner_put, "setQuotas",
     "set an owner's quotas; those not named become the server's defaults",
     .body = "Quotas", .example = "{\"queued_points\":100000,\"stored_bytes\":1e10}",
     .answers = {{200, JSON, "Owner"}}, .problems = P(DISK_FULL)},
    {"GET", "/v1/audit", ROLE_ADMIN, handle_people_audit, "listAudit",
     "who did what, newest first; ?owner= &action= &object= &limit= &cursor=",
     .query = audit_query, .answers = {{200, JSON, "AuditList"}}},
    {"GET", "/v1/backup", ROLE_ADMIN, handle_backup, "getBackup",
     "a checked copy of the whole database as of now",
     "To be put back as DIR/bcd.sqlite. One at a time: 503 while another is made or sent.",
     .lane = LANE_BACKUPS, .answers = {{200, "application/vnd.sqlite3", NULL}},
     .problems = P(DISK_FULL)},
    {"GET", "/healthz", ROLE_NONE, handle_service_health, "getHealth",
     "is the server alive", .answers = {{200, JSON, "Status"}}},
    {"GET", "/readyz", ROLE_NONE, handle_service_ready, "getReadiness",
     "does it take jobs", "503 names what is wrong: store, disk, workers, server.",
     .answers = {{200, JSON, "Status"}}},
    {"GET", "/metrics", ROLE_READER, handle_service_metrics, "getMetrics",
     "counters and gauges for Prometheus", .answers = {{200, PLAIN}}},
    {"GET", "/v1/schema/job", ROLE_NONE, handle_service_schema, "getJobSchema",
     "JSON Schema of a job", .answers = {{200, "application/schema+json", "Schema"}, SAME}},
    {"GET", "/openapi.json", ROLE_NONE, handle_service_openapi, "getDescription",
     "this API as OpenAPI 3.1", .answers = {{200, JSON, "OpenApi"}, SAME}},
    {"GET", "/v1", ROLE_NONE, handle_service_index, "getIndex",
     "this list", .answers = {{200, JSON, "Index"}}},
    {"GET", "/v1/scenes", ROLE_READER, handle_page_scenes, "listScenes",
     "scenes of the papers, as jobs", .answers = {{200, JSON, "SceneList"}}},
    {"GET", "/", ROLE_NONE, handle_page_index, "getPage",
     "the web page", "What it shows it asks for with the token of whoever looks.",
     .answers = {{200, "text/html", NULL}, SAME}},
    {"GET", "/page/{file}", ROLE_NONE, handle_page_file, "getPageFile",
     "what the web page consists of",
     .answers = {{200, "text/javascript", NULL}, {200, "text/css", NULL}, {200, SVG}, SAME}},
};
/* clang-format on */

#define LETTERS_DIGITS "abcdefghijklmnopqrstuvwxyz0123456789"
static const struct route_arg args[] = {
    {"id", LETTERS_DIGITS "-", "[a-z0-9-]"},
    {"name", LETTERS_DIGITS "_", "[a-z0-9_]"},
    {"owner", LETTERS_DIGITS "_-", "[a-z0-9_-]"},
    {"file", LETTERS_DIGITS "_.", "[a-z0-9_.]"},
};

const struct route_arg *routes_arg(size_t index)
{
    return index < sizeof(args) / sizeof(args[0]) ? &args[index] : NULL;
}

const struct route *routes_at(size_t index)
{
    return index < sizeof(routes) / sizeof(routes[0]) ? &routes[index] : NULL;
}

uint64_t routes_problems(const struct route *route)
{
    uint64_t problems = route->problems | P(BAD_REQUEST) | P(QUERY) | P(FORBIDDEN) | P(WRONG_HOST) |
                        P(TOO_LARGE) | P(INTERNAL) | P(BUSY);
    if (route->role != ROLE_NONE)
        problems |= P(WHO) | P(ROLE);
    if (route->pattern[strcspn(route->pattern, "{")])
        problems |= P(NOT_FOUND);
    if (route->body)
        problems |= P(NOT_JSON) | P(MEDIA_TYPE) | P(INVALID_JOB);
    return problems;
}
