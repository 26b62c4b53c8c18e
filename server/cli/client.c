/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "client.h"
#include "bcd.h"

#include <curl/curl.h>

#include <assert.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

enum { TICK_MS = 200, RETRY_FIRST_MS = 100, RETRY_MOST_MS = 1000 };

/* One try of a request. */
struct attempt {
    struct client *client;
    const struct client_request *request;
    CURL *easy;
    struct curl_slist *headers;
    struct text body;
    bool taken;   /* `take` saw bytes */
    bool stopped; /* `take` wants no more */
    bool too_large;
    bool running; /* in the hands of `multi` */
    CURLcode result;
    long retry_after_s;
};

struct client {
    CURLM *multi; /* keeps the connection between requests */
    CURL *easy;
    struct attempt stream;     /* in the background; easy NULL = none */
    bool stream_moved;         /* it brought something since client_wait */
    char *url, *authorization; /* header line, or NULL */
    int64_t patience_ms, silence_s;
    bool local; /* on loopback: never through a proxy */
    bool met;   /* it answered once */
    char words[CURL_ERROR_SIZE + 64];
    sigset_t signals, before;
    int signal_fd, signal;
};

static const char *check_url(const char *url, bool *local);
static bool check_token(const char *token);
static bool begin(struct client *client, struct attempt *attempt);
static void advance(struct client *client);
static void drive(struct client *client, struct attempt *attempt);
static void end(struct client *client, struct attempt *attempt);
static void read_answer(struct client *client, struct attempt *attempt,
                        struct client_answer *answer);
static bool take_signal(struct client *client);
static int64_t now_ms(void);

/* ---------------------------------------------------------------- beginning and end */

struct client *client_create(const struct client_options *options, char *reason, size_t size)
{
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP};
    bool local = false;
    const char *wrong = check_url(options->url, &local);
    if (!wrong && options->token && !check_token(options->token))
        wrong = "the token holds characters that no token has";
    struct client *client = wrong ? NULL : calloc(1, sizeof *client);
    if (!client) {
        snprintf(reason, size, "%s", wrong ? wrong : "out of memory");
        return NULL;
    }
    struct text url = {0}, authorization = {0};
    size_t length = strlen(options->url);
    length -= options->url[length - 1] == '/';
    text_add(&url, "%.*s", (int)length, options->url);
    if (options->token)
        text_add(&authorization, "Authorization: Bearer %s", options->token);
    client->url = text_take(&url);
    client->authorization = options->token ? text_take(&authorization) : NULL;
    client->local = local;
    client->patience_ms = CLIENT_PATIENCE_MS;
    client->silence_s = options->silence_s ? options->silence_s : CLIENT_SILENCE_S;
    /* What whoever started us wants ignored (nohup) stays ignored. */
    sigemptyset(&client->signals);
    for (size_t i = 0; i < sizeof ending / sizeof *ending; i++) {
        struct sigaction action;
        if (sigaction(ending[i], NULL, &action) == 0 && action.sa_handler != SIG_IGN)
            sigaddset(&client->signals, ending[i]);
    }
    pthread_sigmask(SIG_BLOCK, &client->signals, &client->before);
    client->signal_fd = signalfd(-1, &client->signals, SFD_NONBLOCK | SFD_CLOEXEC);
    curl_global_init(CURL_GLOBAL_DEFAULT);
    client->multi = curl_multi_init();
    client->easy = curl_easy_init();
    bool good = client->multi && client->easy && client->url && client->signal_fd >= 0 &&
                (client->authorization || !options->token);
    if (good)
        return client;
    snprintf(reason, size, "no client can be had: %s", strerror(errno));
    client_free(client);
    return NULL;
}

void client_free(struct client *client)
{
    if (!client)
        return;
    client_stream_end(client);
    curl_easy_cleanup(client->easy);
    curl_multi_cleanup(client->multi);
    curl_global_cleanup();
    if (client->signal_fd >= 0)
        close(client->signal_fd);
    pthread_sigmask(SIG_SETMASK, &client->before, NULL);
    if (client->authorization)
        explicit_bzero(client->authorization, strlen(client->authorization));
    free(client->authorization);
    free(client->url);
    free(client);
}

void client_answer_fini(struct client_answer *answer)
{
    free(answer->body);
    *answer = (struct client_answer){0};
}

/* NULL, or what is wrong with it. */
static const char *check_url(const char *url, bool *local)
{
    static const CURLUPart unwanted[] = {CURLUPART_USER, CURLUPART_PASSWORD, CURLUPART_QUERY,
                                         CURLUPART_FRAGMENT};
    const char *wrong = NULL;
    char *part = NULL;
    CURLU *parts = curl_url();
    if (strncmp(url, "http://", 7) != 0 && strncmp(url, "https://", 8) != 0)
        wrong = "the URL must begin with http:// or https://";
    else if (!parts || curl_url_set(parts, CURLUPART_URL, url, 0) != CURLUE_OK)
        wrong = "the URL cannot be understood; it is like http://127.0.0.1:8080";
    for (size_t i = 0; !wrong && i < sizeof unwanted / sizeof *unwanted; i++)
        if (curl_url_get(parts, unwanted[i], &part, 0) == CURLUE_OK)
            wrong = "the URL is scheme, host, port and perhaps a path, like http://127.0.0.1:8080; "
                    "tokens come from BCD_TOKEN or --token-file";
    curl_free(part);
    part = NULL;
    if (!wrong && curl_url_get(parts, CURLUPART_HOST, &part, 0) == CURLUE_OK)
        *local = strcmp(part, "localhost") == 0 || strncmp(part, "127.", 4) == 0 ||
                 strcmp(part, "[::1]") == 0;
    curl_free(part);
    curl_url_cleanup(parts);
    return wrong;
}

static bool check_token(const char *token)
{
    for (const char *c = token; *c; c++)
        if (*c <= ' ' || *c >= 0x7F)
            return false;
    return *token != '\0';
}

/* -------------------------------------------------------------------- asking */

/* Whether another try may help. */
static bool retry(const struct client *client, const struct attempt *attempt,
                  const struct client_answer *answer)
{
    const CURLcode result = attempt->result;
    if (attempt->request->once || attempt->taken || attempt->stopped || attempt->too_large)
        return false;
    if (result == CURLE_OK)
        return answer->status == 503 && attempt->retry_after_s >= 0;
    bool connected = result != CURLE_COULDNT_CONNECT && result != CURLE_COULDNT_RESOLVE_HOST &&
                     result != CURLE_OPERATION_TIMEDOUT;
    bool hopeless = result == CURLE_PEER_FAILED_VERIFICATION || result == CURLE_URL_MALFORMAT ||
                    result == CURLE_UNSUPPORTED_PROTOCOL || result == CURLE_SSL_CACERT_BADFILE;
    return !hopeless && (connected || client->met);
}

enum client_status client_ask(struct client *client, const struct client_request *request,
                              struct client_answer *answer)
{
    int64_t until = now_ms() + client->patience_ms, pause = RETRY_FIRST_MS;
    for (;;) {
        struct attempt attempt = {
            .request = request, .easy = client->easy, .result = CURLE_OUT_OF_MEMORY};
        *answer = (struct client_answer){0};
        if (begin(client, &attempt))
            drive(client, &attempt);
        end(client, &attempt);
        if (attempt.result == CURLE_OK)
            read_answer(client, &attempt, answer);
        else if (!client->words[0])
            snprintf(client->words, sizeof client->words, "%s", curl_easy_strerror(attempt.result));
        free(text_take(&attempt.body));
        if (!client->signal && (!retry(client, &attempt, answer) || now_ms() + pause > until)) {
            client->met |= attempt.result == CURLE_OK;
            return attempt.result == CURLE_OK ? CLIENT_OK
                   : attempt.stopped          ? CLIENT_STOPPED
                   : attempt.taken            ? CLIENT_LOST
                                              : CLIENT_UNREACHABLE;
        }
        client_answer_fini(answer);
        if (!client->signal && request->lost)
            request->lost(request->context);
        if (!client_wait(client, pause))
            return CLIENT_SIGNAL;
        pause = 2 * pause < RETRY_MOST_MS ? 2 * pause : RETRY_MOST_MS;
    }
}

bool client_wait(struct client *client, int64_t ms)
{
    struct curl_waitfd fd = {.fd = client->signal_fd, .events = CURL_WAIT_POLLIN};
    int64_t until = now_ms() + ms, left = ms;
    client->stream_moved = false;
    do {
        advance(client);
        if (client->stream_moved || take_signal(client))
            break;
        curl_multi_poll(client->multi, &fd, 1, (int)left, NULL);
        left = until - now_ms();
    } while (left > 0);
    return !take_signal(client);
}

bool client_stream_begin(struct client *client, const struct client_request *request)
{
    client_stream_end(client);
    client->stream = (struct attempt){.request = request, .easy = curl_easy_init()};
    return client->stream.easy && begin(client, &client->stream);
}

int client_stream_status(const struct client *client)
{
    long status = 0;
    if (client->stream.easy)
        curl_easy_getinfo(client->stream.easy, CURLINFO_RESPONSE_CODE, &status);
    return (int)status;
}

bool client_stream_open(const struct client *client)
{
    return client->stream.running;
}

void client_stream_end(struct client *client)
{
    if (!client->stream.easy)
        return;
    end(client, &client->stream);
    curl_easy_cleanup(client->stream.easy);
    free(text_take(&client->stream.body));
    client->stream = (struct attempt){0};
}

void client_patience(struct client *client, int64_t ms)
{
    client->patience_ms = ms;
}

int client_signal(const struct client *client)
{
    return client->signal;
}

const char *client_words(const struct client *client)
{
    return client->words;
}

const char *client_url(const struct client *client)
{
    return client->url;
}

static size_t take_bytes(char *bytes, size_t one, size_t size, void *context)
{
    struct attempt *attempt = context;
    const struct client_request *request = attempt->request;
    long status = 0;
    (void)one;
    curl_easy_getinfo(attempt->easy, CURLINFO_RESPONSE_CODE, &status);
    if (request->take && status / 100 == 2) {
        attempt->taken = true;
        if (attempt == &attempt->client->stream)
            attempt->client->stream_moved = true;
        attempt->stopped = !request->take(request->context, bytes, size);
        return attempt->stopped ? 0 : size;
    }
    attempt->too_large = size > CLIENT_BODY_BYTES_MAX - attempt->body.size;
    if (attempt->too_large)
        return 0;
    text_add_bytes(&attempt->body, bytes, size);
    return attempt->body.failed ? 0 : size;
}

static size_t take_header(char *bytes, size_t one, size_t size, void *context)
{
    struct attempt *attempt = context;
    static const char name[] = "retry-after:";
    (void)one;
    if (size > sizeof name && strncasecmp(bytes, name, sizeof name - 1) == 0)
        attempt->retry_after_s = strtol(bytes + sizeof name - 1, NULL, 10);
    return size;
}

static bool add_header(struct curl_slist **headers, const char *line)
{
    struct curl_slist *longer = curl_slist_append(*headers, line);
    if (longer)
        *headers = longer;
    return longer != NULL;
}

static bool add_headers(const struct client *client, const struct client_request *request,
                        struct curl_slist **headers)
{
    char key[CLIENT_KEY_SIZE + 32];
    bool good =
        add_header(headers, request->events ? "Accept: text/event-stream" : "Accept: */*") &&
        add_header(headers, "Expect:"); /* no 100-continue: a round trip for nothing */
    if (request->body)
        good = good && add_header(headers, "Content-Type: application/json");
    if (request->key) {
        snprintf(key, sizeof key, "Idempotency-Key: %s", request->key);
        good = good && add_header(headers, key);
    }
    if (client->authorization)
        good = good && add_header(headers, client->authorization);
    return good;
}

static void set_options(struct client *client, struct attempt *attempt)
{
    const struct client_request *request = attempt->request;
    CURL *easy = attempt->easy;
    curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request->method);
    if (request->body) {
        curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->body_size);
        curl_easy_setopt(easy, CURLOPT_POSTFIELDS, request->body);
    }
    curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, attempt->headers);
    curl_easy_setopt(easy, CURLOPT_USERAGENT, "bcd/" BCD_VERSION);
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_PRIVATE, attempt);
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, (long)CLIENT_CONNECT_MS);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, (long)client->silence_s);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, take_bytes);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, attempt);
    curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, take_header);
    curl_easy_setopt(easy, CURLOPT_HEADERDATA, attempt);
    if (attempt != &client->stream)
        curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, client->words);
    if (client->local)
        curl_easy_setopt(easy, CURLOPT_PROXY, "");
}

/* Hands the request to `multi`. */
static bool begin(struct client *client, struct attempt *attempt)
{
    struct text url = {0};
    attempt->client = client;
    attempt->retry_after_s = -1;
    curl_easy_reset(attempt->easy);
    text_add(&url, "%s%s", client->url, attempt->request->path);
    char *where = text_take(&url);
    bool good = where && add_headers(client, attempt->request, &attempt->headers) &&
                curl_easy_setopt(attempt->easy, CURLOPT_URL, where) == CURLE_OK; /* copied */
    free(where);
    if (!good)
        return false;
    if (attempt != &client->stream)
        client->words[0] = '\0';
    set_options(client, attempt);
    attempt->running = curl_multi_add_handle(client->multi, attempt->easy) == CURLM_OK;
    return attempt->running;
}

/* Moves whatever is going on; notes what has ended. */
static void advance(struct client *client)
{
    int running, left;
    curl_multi_perform(client->multi, &running);
    for (CURLMsg *message; (message = curl_multi_info_read(client->multi, &left));) {
        struct attempt *attempt = NULL;
        if (message->msg != CURLMSG_DONE)
            continue;
        curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &attempt);
        attempt->result = message->data.result;
        attempt->running = false;
        if (attempt == &client->stream)
            client->stream_moved = true;
    }
}

/* Until the answer is there, time is up or a signal comes. */
static void drive(struct client *client, struct attempt *attempt)
{
    struct curl_waitfd fd = {.fd = client->signal_fd, .events = CURL_WAIT_POLLIN};
    const struct client_request *request = attempt->request;
    for (;;) {
        advance(client);
        if (!attempt->running || take_signal(client))
            return;
        if (request->tick)
            request->tick(request->context);
        curl_multi_poll(client->multi, &fd, 1, TICK_MS, NULL);
    }
}

/* Takes it out of `multi`, done or not. */
static void end(struct client *client, struct attempt *attempt)
{
    curl_multi_remove_handle(client->multi, attempt->easy);
    curl_slist_free_all(attempt->headers);
    attempt->headers = NULL;
    attempt->running = false;
}

static void read_answer(struct client *client, struct attempt *attempt,
                        struct client_answer *answer)
{
    const char *type = NULL;
    long status = 0;
    curl_easy_getinfo(client->easy, CURLINFO_RESPONSE_CODE, &status);
    curl_easy_getinfo(client->easy, CURLINFO_CONTENT_TYPE, &type);
    answer->status = (int)status;
    snprintf(answer->type, sizeof answer->type, "%s", type ? type : "");
    answer->size = attempt->body.size;
    answer->body = text_take(&attempt->body);
}

/* True from the first signal on. */
static bool take_signal(struct client *client)
{
    struct signalfd_siginfo info;
    if (!client->signal && read(client->signal_fd, &info, sizeof info) == (ssize_t)sizeof info)
        client->signal = (int)info.ssi_signo;
    return client->signal != 0;
}

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* --------------------------------------------------------------------- small things */

void client_key(char key[CLIENT_KEY_SIZE])
{
    unsigned char bytes[16];
    int length = snprintf(key, CLIENT_KEY_SIZE, "bcd-");
    if (getrandom(bytes, sizeof bytes, 0) !=
        (ssize_t)sizeof bytes) /* up to 256 bytes: all or none */
        abort();
    for (size_t i = 0; i < sizeof bytes; i++)
        length += snprintf(key + length, CLIENT_KEY_SIZE - (size_t)length, "%02x", bytes[i]);
}

void client_add_query(struct text *path, const char *name, const char *value)
{
    const char *const parts[] = {name, value};
    for (size_t p = 0; p < 2; p++) {
        bool first = !path->bytes || !strchr(path->bytes, '?');
        text_add(path, "%s", p ? "=" : first ? "?" : "&");
        for (const char *c = parts[p]; *c; c++)
            if (strchr("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~", *c))
                text_add_bytes(path, c, 1);
            else
                text_add(path, "%%%02X", (unsigned char)*c);
    }
}
