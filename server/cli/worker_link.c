/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "worker_link.h"
#include "limits.h"
#include "share_dir.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { LAST_WORD_MS = 5000 };

/* What the last request came to is kept for link_fault. With a directory the client is never asked
 * anything: it is what watches for signals. */
struct link {
    const struct cli_line *line;
    struct client *client;
    struct share_dir *share; /* NULL = HTTP */
    enum client_status status;
    struct client_answer answer;
    char reason[512];
};

int link_open(const struct cli_line *line, const char *share, struct link **link)
{
    struct link *made = calloc(1, sizeof *made);
    int status = made ? CLI_OK : CLI_FAILED;
    if (made) {
        made->line = line;
        status = cli_server_open(line, &made->client);
    }
    if (status == CLI_OK && share &&
        !(made->share = share_dir_open(share, made->reason, sizeof made->reason))) {
        fprintf(stderr, "bcd worker: %s\n", made->reason);
        status = CLI_USAGE;
    }
    if (status == CLI_OK)
        *link = made;
    else
        link_free(made);
    return status;
}

void link_free(struct link *link)
{
    if (!link)
        return;
    client_answer_fini(&link->answer);
    client_free(link->client);
    share_dir_free(link->share);
    free(link);
}

bool link_wait(struct link *link, int64_t ms)
{
    return client_wait(link->client, ms);
}

int link_fault(struct link *link, const char *about)
{
    if (!link->reason[0])
        return cli_server_fault(link->line, link->client, about, link->status, &link->answer);
    fprintf(stderr, "bcd worker: %s\n", link->reason);
    return CLI_FAILED;
}

/* POST; the answer of a status below 300 is there to be read. Takes the body. */
static enum link_status post(struct link *link, const char *path, char *body, bool anyway)
{
    const struct client_request request = {
        .method = "POST", .path = path, .body = body, .body_size = body ? strlen(body) : 0};
    client_answer_fini(&link->answer);
    link->answer = (struct client_answer){0};
    link->status = body ? client_ask(link->client, &request, &link->answer) : CLIENT_UNREACHABLE;
    if (link->status == CLIENT_SIGNAL && anyway) {
        struct client *second = NULL; /* it is to end, and not to lose its work */
        if (cli_server_open(link->line, &second) == CLI_OK) {
            client_patience(second, LAST_WORD_MS);
            link->status = client_ask(second, &request, &link->answer);
        }
        client_free(second);
    }
    free(body);
    if (link->status == CLIENT_SIGNAL)
        return LINK_SIGNAL;
    if (link->status != CLIENT_OK)
        return LINK_AWAY;
    return link->answer.status < 300 ? LINK_OK : LINK_REFUSED;
}

enum link_status link_take(struct link *link, const char *worker, struct lease_loan *loan)
{
    struct bcd_errors errors = {0};
    *loan = (struct lease_loan){0};
    link->reason[0] = '\0';
    if (link->share)
        return client_signal(link->client)
                   ? LINK_SIGNAL
                   : worker_share_take(link->share, loan, link->reason, sizeof link->reason);
    enum link_status status = post(link, "/v1/leases", lease_json_request(worker), false);
    if (status != LINK_OK)
        return status;
    if (!lease_json_read_loan(link->answer.body, link->answer.size, loan, &errors)) {
        snprintf(link->reason, sizeof link->reason, "what the server lends cannot be read");
        return LINK_REFUSED;
    }
    return loan->id[0] ? LINK_OK : LINK_NOTHING;
}

static enum link_status send(struct link *link, const struct lease_loan *loan,
                             const struct lease_word *word, bool ended, bool anyway)
{
    struct text path = {0};
    char *body = lease_json_word(word, ended);
    enum link_status status = LINK_AWAY;
    link->reason[0] = '\0';
    if (link->share) {
        status = body ? worker_share_tell(link->share, loan, body, ended) : LINK_AWAY;
        if (status == LINK_AWAY)
            snprintf(link->reason, sizeof link->reason, "the directory cannot be written to: %s",
                     strerror(errno));
        free(body);
        return status;
    }
    text_add(&path, "/v1/leases/%s/%s", loan->id, ended ? "return" : "heartbeat");
    char *to = text_take(&path);
    if (to)
        status = post(link, to, body, anyway);
    else
        free(body);
    free(to);
    return status;
}

/* The word that an answer has for a chunk. */
static bool answer_is(const struct link *link, const char *what)
{
    struct answer *said = answer_json_load(link->answer.body, link->answer.size);
    const char *word = answer_json_text(said, "answer");
    bool is = word && strcmp(word, what) == 0;
    answer_json_free(said);
    return is;
}

enum link_status link_tell(struct link *link, const struct lease_loan *loan,
                           const struct lease_word *word, bool last)
{
    enum link_status status = send(link, loan, word, false, last);
    if (link->share || status != LINK_OK || answer_is(link, "go_on"))
        return status;
    return answer_is(link, "stop") ? LINK_STOP : LINK_UNKNOWN;
}

enum link_status link_return(struct link *link, const struct lease_loan *loan,
                             const struct lease_word *word)
{
    enum link_status status = send(link, loan, word, true, true);
    if (link->share || status != LINK_OK)
        return status;
    return answer_is(link, "unwanted") ? LINK_NOTHING : LINK_OK;
}
