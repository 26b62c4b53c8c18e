/* SPDX-License-Identifier: GPL-3.0-or-later
 * handle_leases.c - workers elsewhere: chunks out, word and tallies back; see lease.h. */
#include "handle.h"
#include "lease.h"
#include "reply.h"
#include "request_check.h"

#include <stdio.h>
#include <string.h>

static bool read_word(const struct call *call, bool ended, struct lease_word *word,
                      struct reply *reply);

void handle_leases_take(const struct service *service, const struct call *call, struct reply *reply)
{
    const struct request *request = call->request;
    struct bcd_errors errors = {0};
    struct lease_loan loan = {0};
    char worker[LEASE_WORKER_SIZE] = "";
    const struct lease_asker asker = {call->identity.owner, worker};
    if (!request_check_json(request, reply))
        return;
    if (!lease_json_read_request(request->body, request->body_size, worker, &errors)) {
        reply_bcd(reply, BCD_INVALID, &errors);
        return;
    }
    enum store_status status = service->leases ? leases_take(service->leases, &asker, &loan)
                                               : STORE_NOT_FOUND; /* all is run here */
    if (status == STORE_OK || status == STORE_NOT_FOUND)
        reply_json_take(reply, lease_json_loan(status == STORE_OK ? &loan : NULL));
    else
        reply_bcd(reply, BCD_NO_MEMORY, NULL);
    reply->routine = true;
    lease_loan_fini(&loan);
}

void handle_leases_hear(const struct service *service, const struct call *call, struct reply *reply)
{
    struct lease_word word = {0};
    if (!read_word(call, false, &word, reply)) {
        lease_word_fini(&word);
        return;
    }
    switch (service->leases ? leases_hear(service->leases, &word) : LEASE_UNKNOWN) {
    case LEASE_GO_ON:
        reply_json_take(reply, strdup("{\"answer\":\"go_on\"}\n"));
        break;
    case LEASE_UNKNOWN:
        reply_json_take(reply, strdup("{\"answer\":\"unknown\"}\n"));
        break;
    default:
        reply_json_take(reply, strdup("{\"answer\":\"stop\"}\n"));
        break;
    }
    reply->routine = true;
    lease_word_fini(&word);
}

void handle_leases_return(const struct service *service, const struct call *call,
                          struct reply *reply)
{
    struct lease_word word = {0};
    if (!read_word(call, true, &word, reply)) {
        lease_word_fini(&word);
        return;
    }
    switch (service->leases ? leases_return(service->leases, &word) : LEASE_UNKNOWN) {
    case LEASE_GO_ON:
        reply_json_take(reply, strdup("{\"answer\":\"taken\"}\n"));
        break;
    case LEASE_AGAIN:
        reply_json_take(reply, strdup("{\"answer\":\"again\"}\n"));
        break;
    case LEASE_DIFFERS:
        reply_problem(reply, PROBLEM_STATE,
                      "chunk %lld of job %s was returned before with other bits: one of the two "
                      "machines, or programs, computes wrongly",
                      (long long)word.chunk, word.job);
        break;
    case LEASE_REFUSED:
        reply_problem(reply, PROBLEM_STATE, "this is no tally of chunk %lld of job %s",
                      (long long)word.chunk, word.job);
        break;
    default: /* cancelled, or ended long ago */
        reply_json_take(reply, strdup("{\"answer\":\"unwanted\"}\n"));
        break;
    }
    reply->routine = true;
    lease_word_fini(&word);
}

static bool read_word(const struct call *call, bool ended, struct lease_word *word,
                      struct reply *reply)
{
    const struct request *request = call->request;
    struct bcd_errors errors = {0};
    if (!request_check_json(request, reply))
        return false;
    if (!lease_json_read_word(request->body, request->body_size, ended, word, &errors)) {
        reply_bcd(reply, BCD_INVALID, &errors);
        return false;
    }
    snprintf(word->id, sizeof(word->id), "%.19s", call->arg[0]);
    snprintf(word->owner, sizeof(word->owner), "%s", call->identity.owner);
    return true;
}
