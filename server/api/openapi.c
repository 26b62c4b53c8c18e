/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "openapi.h"
#include "components.inc"
#include "json_lines.h"
#include "limits.h"
#include "routes.h"
#include "schema_json.h"
#include "schema_results.h"
#include "text.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

static void add_info(struct text *text);
static void add_path(struct text *text, size_t first);
static void add_operation(struct text *text, const struct route *route);
static void add_parameters(struct text *text, const struct route *route);
static void add_query(struct text *text, const struct query_row *row);
static void add_body(struct text *text, const struct route *route);
static void add_answers(struct text *text, const struct route *route);
static void add_answer(struct text *text, const struct route *route, size_t index);
static void add_components(struct text *text);
static void add_problem(struct text *text);

/* Whether an earlier row has that path: then it was printed with it. */
static bool seen(size_t index)
{
    for (size_t i = 0; i < index; i++)
        if (strcmp(routes_at(i)->pattern, routes_at(index)->pattern) == 0)
            return true;
    return false;
}

char *openapi_print(void)
{
    struct text text = {0};
    add_info(&text);
    text_add(&text, ",\"paths\":{");
    for (size_t i = 0; routes_at(i); i++)
        if (!seen(i))
            add_path(&text, i);
    text_add(&text, "},\"components\":{");
    add_components(&text);
    text_add(&text, "}}");
    return json_lines_take(text_take(&text));
}

static void add_info(struct text *text)
{
    text_add(text,
             "{\"openapi\":\"3.1.0\",\"info\":{\"title\":\"bcdd\",\"version\":\"%s\","
             "\"summary\":\"Brownian motion of hard rods in one dimension\",\"description\":",
             BCD_VERSION);
    text_add_json_string(
        text, "Jobs in, results with error bars and exact theory out. Every GET can be a HEAD. "
              "Faults are application/problem+json, all of a job at once, each with the pointer of "
              "its field. Unknown query parameters and keys are refused. While the server has no "
              "tokens, requests from its own machine need none.");
    text_add(text, ",\"license\":{\"name\":\"GPL-3.0-or-later\","
                   "\"identifier\":\"GPL-3.0-or-later\"}},\"servers\":[{\"url\":\"/\"}]");
}

static void add_path(struct text *text, size_t first)
{
    const struct route *route, *head = routes_at(first);
    text_add(text, "%s\"%s\":{", first ? "," : "", head->pattern);
    for (size_t i = first; (route = routes_at(i)); i++) {
        if (strcmp(route->pattern, head->pattern) != 0)
            continue;
        text_add(text, "%s\"", i > first ? "," : "");
        for (const char *c = route->method; *c; c++)
            text_add(text, "%c", tolower((unsigned char)*c));
        text_add(text, "\":{");
        add_operation(text, route);
        text_add(text, "}");
    }
    text_add(text, "}");
}

/* What operations are sorted by: "jobs" of /v1/jobs/..., "service" of all else. */
static void add_tag(struct text *text, const char *pattern)
{
    const char *name = strncmp(pattern, "/v1/", 4) == 0 ? pattern + 4 : "service";
    text_add(text, ",\"tags\":[\"%.*s\"]", (int)strcspn(name, "/."), name);
}

static void add_operation(struct text *text, const struct route *route)
{
    text_add(text, "\"operationId\":\"%s\",\"summary\":", route->id);
    text_add_json_string(text, route->doc);
    struct text words = {0};
    text_add(&words, "%s%sFor %s%s.", route->more ? route->more : "", route->more ? " " : "",
             route->role == ROLE_NONE ? "anybody" : role_name(route->role),
             route->role == ROLE_NONE || route->role == ROLE_ADMIN ? ""
             : route->role == ROLE_WORKER                          ? "s and admins"
                                                                   : "s and above");
    char *more = text_take(&words);
    text_add(text, ",\"description\":");
    text_add_json_string(text, more ? more : "");
    text->failed |= !more;
    free(more);
    add_tag(text, route->pattern);
    text_add(text,
             route->role == ROLE_NONE ? ",\"security\":[]" : ",\"security\":[{\"token\":[]},{}]");
    add_parameters(text, route);
    if (route->body)
        add_body(text, route);
    add_answers(text, route);
}

/* --------------------------------------------------------------- what is sent */

static void add_parameters(struct text *text, const struct route *route)
{
    const char *separator = "";
    text_add(text, ",\"parameters\":[");
    for (const char *at = strchr(route->pattern, '{'); at; at = strchr(at + 1, '{')) {
        text_add(text, "%s{\"$ref\":\"#/components/parameters/%.*s\"}", separator,
                 (int)strcspn(at + 1, "}"), at + 1);
        separator = ",";
    }
    for (const struct query_row *row = route->query; row && row->name; row++) {
        text_add(text, "%s", separator);
        add_query(text, row);
        separator = ",";
    }
    if (route->filters) {
        text_add(text, "%s{\"$ref\":\"#/components/parameters/filters\"}", separator);
        separator = ",";
    }
    if (route->idempotency_key)
        text_add(text, "%s{\"$ref\":\"#/components/parameters/idempotency_key\"}", separator);
    text_add(text, "]");
}

static void add_words(struct text *text, const char *words)
{
    text_add(text, "\"type\":\"string\",\"enum\":[");
    for (const char *at = words; *at;) {
        size_t length = strcspn(at, " ");
        text_add(text, "%s\"%.*s\"", at == words ? "" : ",", (int)length, at);
        at += length + strspn(at + length, " ");
    }
    text_add(text, "]");
}

static void add_query(struct text *text, const struct query_row *row)
{
    text_add(text, "{\"name\":");
    text_add_json_string(text, row->name);
    text_add(text, ",\"in\":\"query\",\"description\":");
    text_add_json_string(text, row->doc);
    text_add(text, row->many ? ",\"schema\":{\"type\":\"array\",\"items\":{" : ",\"schema\":{");
    switch (row->type) {
    case QUERY_TEXT:
    case QUERY_TIME:
        text_add(text, "\"type\":\"string\"");
        break;
    case QUERY_LABEL:
        text_add(text, "\"type\":\"string\",\"minLength\":1,\"maxLength\":%d",
                 LIMIT_LABEL_CHARACTERS_MAX);
        break;
    case QUERY_OWNER:
        text_add(text, "\"type\":\"string\",\"pattern\":\"^[a-z0-9_-]{1,%d}$\"", OWNER_SIZE - 1);
        break;
    case QUERY_TAG:
        text_add(text, "\"type\":\"string\",\"pattern\":\"^[A-Za-z0-9._-]{1,%d}$\"",
                 LIMIT_TAG_BYTES_MAX);
        break;
    case QUERY_ID:
        text_add(text, "\"type\":\"string\",\"pattern\":\"^[a-z0-9-]{1,%d}$\"", CALL_ARG_SIZE - 1);
        break;
    case QUERY_WORD:
        add_words(text, row->words);
        break;
    case QUERY_BOOLEAN:
        text_add(text, "\"type\":\"boolean\"");
        break;
    case QUERY_INTEGER:
    case QUERY_NUMBER:
        text_add(text,
                 "\"type\":\"%s\",\"minimum\":", row->type == QUERY_INTEGER ? "integer" : "number");
        text_add_number(text, row->min);
        text_add(text, ",\"maximum\":");
        text_add_number(text, row->max);
        break;
    }
    text_add(text, row->many ? "}}}" : "}}");
}

static void add_body(struct text *text, const struct route *route)
{
    text_add(text,
             ",\"requestBody\":{\"required\":true,\"content\":{\"application/json\":{\"schema\":{"
             "\"$ref\":\"#/components/schemas/%s\"},\"example\":%s}}}",
             route->body, route->example);
}

/* --------------------------------------------------------- what is answered */

static const char *meaning(int status)
{
    return status == 200   ? "done"
           : status == 201 ? "made"
           : status == 202 ? "taken; it goes on"
           : status == 304 ? "as before"
                           : "done, nothing to say";
}

static void add_answers(struct text *text, const struct route *route)
{
    const char *separator = "";
    text_add(text, ",\"responses\":{");
    for (size_t i = 0; i < ROUTE_ANSWERS_MAX && route->answers[i].type; i++) {
        bool first = true;
        for (size_t k = 0; k < i; k++)
            first = first && route->answers[k].status != route->answers[i].status;
        if (!first)
            continue;
        text_add(text, "%s", separator);
        add_answer(text, route, i);
        separator = ",";
    }
    uint64_t problems = routes_problems(route);
    for (int status = 400; status < 600; status++) {
        bool any = false;
        for (int p = 0; p < PROBLEMS; p++)
            any = any || ((problems >> p & 1) && reply_problem_status(p) == status);
        if (any)
            text_add(text, ",\"%d\":{\"$ref\":\"#/components/responses/problem%d\"}", status,
                     status);
    }
    text_add(text, "}");
}

/* The index-th answer and those after it with the same status, one content type each. */
static void add_answer(struct text *text, const struct route *route, size_t index)
{
    int status = route->answers[index].status;
    const char *separator = "";
    text_add(text, "\"%d\":{\"description\":\"%s\"", status, meaning(status));
    if (status == 201 || status == 202)
        text_add(text,
                 ",\"headers\":{\"Location\":{\"required\":true,\"description\":\"where it is\","
                 "\"schema\":{\"type\":\"string\",\"pattern\":\"^/\"}}}");
    if (route->answers[index].type[0]) {
        text_add(text, ",\"content\":{");
        for (size_t i = index; i < ROUTE_ANSWERS_MAX && route->answers[i].type; i++) {
            const struct route_answer *answer = &route->answers[i];
            if (answer->status != status)
                continue;
            text_add(text, "%s\"%s\":{\"schema\":{", separator, answer->type);
            if (answer->schema)
                text_add(text, "\"$ref\":\"#/components/schemas/%s\"", answer->schema);
            else
                text_add(text, "\"type\":\"string\"");
            text_add(text, "}}");
            separator = ",";
        }
        text_add(text, "}");
    }
    text_add(text, "}");
}

/* ------------------------------------------------------------------ components */

static void add_components(struct text *text)
{
    text_add(text, "\"schemas\":{\"Job\":");
    schema_json_add_job(text);
    text_add(text, ",");
    schema_results_add(text);
    text_add(text, ",");
    add_problem(text);
    const char *inner = strchr(components_json, '{') + 1;
    text_add(text, ",%.*s", (int)(strrchr(components_json, '}') - inner), inner);
    text_add(text, "},\"responses\":{");
    const char *separator = "";
    for (int status = 400; status < 600; status++) {
        bool any = false;
        for (int p = 0; p < PROBLEMS; p++) {
            if (reply_problem_status(p) != status || p == PROBLEM_METHOD)
                continue; /* no operation answers that a method is not there */
            text_add(text, any ? "; %s" : "%s\"problem%d\":{\"description\":\"",
                     any ? reply_problem_title(p) : separator, status);
            if (!any)
                text_add(text, "%s", reply_problem_title(p));
            any = true;
            separator = ",";
        }
        if (any)
            text_add(text, "\",\"content\":{\"application/problem+json\":{\"schema\":{"
                           "\"$ref\":\"#/components/schemas/Problem\"}}}}");
    }
    text_add(text, "},\"parameters\":{");
    const struct route_arg *arg;
    for (size_t i = 0; (arg = routes_arg(i)); i++)
        text_add(text,
                 "\"%s\":{\"name\":\"%s\",\"in\":\"path\",\"required\":true,\"schema\":{"
                 "\"type\":\"string\",\"pattern\":\"^%s{1,%d}$\"}},",
                 arg->name, arg->name, arg->set, CALL_ARG_SIZE - 1);
    text_add(
        text,
        "\"filters\":{\"name\":\"filters\",\"in\":\"query\",\"style\":\"form\",\"explode\":true,"
        "\"description\":\"by the dotted path of what a job holds, at most %d\",\"schema\":{"
        "\"type\":\"object\",\"additionalProperties\":{\"type\":\"string\"}}},"
        "\"idempotency_key\":{\"name\":\"Idempotency-Key\",\"in\":\"header\",\"description\":"
        "\"a request sent again with the same key does nothing twice\",\"schema\":{"
        "\"type\":\"string\",\"pattern\":\"^[!-~]{1,%d}$\"}}},",
        LIMIT_FILTERS_MAX, LIMIT_IDEMPOTENCY_KEY_BYTES_MAX);
    text_add(text, "\"securitySchemes\":{\"token\":{\"type\":\"http\",\"scheme\":\"bearer\"}}");
}

static void add_problem(struct text *text)
{
    text_add(text, "\"Problem\":{\"description\":\"What is wrong (RFC 9457)\",\"type\":\"object\","
                   "\"additionalProperties\":false,"
                   "\"required\":[\"type\",\"title\",\"status\",\"detail\"],"
                   "\"properties\":{\"type\":{\"enum\":[");
    for (int p = 0; p < PROBLEMS; p++)
        text_add(text, "%s\"%s\"", p ? "," : "", reply_problem_type(p));
    text_add(text, "]},\"title\":{\"type\":\"string\"},\"status\":{\"type\":\"integer\"},"
                   "\"detail\":{\"type\":\"string\"},\"errors\":{\"type\":\"array\",\"items\":{"
                   "\"type\":\"object\",\"additionalProperties\":false,\"required\":[\"detail\"],"
                   "\"properties\":{\"pointer\":{\"type\":\"string\"},"
                   "\"parameter\":{\"type\":\"string\"},\"detail\":{\"type\":\"string\"}}}},"
                   "\"estimate\":{\"$ref\":\"#/components/schemas/Estimate\"}}}");
}
