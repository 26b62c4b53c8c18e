/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "download.h"
#include "cli_words.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SHOW_MS = 200 };

struct target {
    const char *file; /* NULL = stdout */
    char *part;       /* where it is written meanwhile, or NULL: a device, a pipe, stdout */
    FILE *out;
    double bytes;
    int error; /* errno of a failed write */
    bool show; /* progress on stderr */
    int64_t shown_ms;
};

static bool begin(struct target *target);
static bool finish(struct target *target, bool whole);
static void show(void *context);

static bool take(void *context, const char *bytes, size_t size)
{
    struct target *target = context;
    target->bytes += (double)size;
    if (fwrite(bytes, 1, size, target->out) == size)
        return true;
    target->error = errno;
    return false;
}

int download(const struct cli_line *line, struct client *client, const char *path,
             const char *about, const char *file)
{
    struct target target = {.file = file, .show = file && isatty(STDERR_FILENO)};
    struct client_answer answer = {0};
    const struct client_request request = {
        .method = "GET", .path = path, .take = take, .tick = show, .context = &target};
    if (!begin(&target)) {
        fprintf(stderr, "bcd %s: %s cannot be written: %s\n", line->command->name, file,
                strerror(errno));
        return CLI_FAILED;
    }
    int status = cli_server_ask(line, client, about, &request, &answer);
    client_answer_fini(&answer);
    if (target.shown_ms)
        fputs("\r\033[K", stderr);
    bool written = finish(&target, status == CLI_OK);
    if (target.error || (status == CLI_OK && !written)) {
        fprintf(stderr, "bcd %s: %s cannot be written: %s\n", line->command->name,
                file ? file : "the result", strerror(target.error ? target.error : errno));
        return CLI_FAILED;
    }
    return status;
}

/* A plain file is written beside its place under another name; what is none (a device, a pipe) must
 * not be replaced by one. */
static bool begin(struct target *target)
{
    struct stat status;
    struct text part = {0};
    target->out = stdout;
    if (!target->file)
        return true;
    if (stat(target->file, &status) == 0 && !S_ISREG(status.st_mode)) {
        target->out = fopen(target->file, "we");
        return target->out != NULL;
    }
    text_add(&part, "%s.part-XXXXXX", target->file);
    target->part = text_take(&part);
    int fd = target->part ? mkostemp(target->part, O_CLOEXEC) : -1;
    mode_t mask = umask(0);
    umask(mask);
    target->out = fd >= 0 && fchmod(fd, 0666 & ~mask) == 0 ? fdopen(fd, "w") : NULL;
    if (target->out)
        return true;
    int cause = errno;
    if (fd >= 0) {
        close(fd);
        unlink(target->part);
    }
    free(target->part);
    errno = cause;
    return false;
}

/* Puts it in its place, or away. */
static bool finish(struct target *target, bool whole)
{
    bool good = fflush(target->out) == 0;
    if (target->part)
        good = good && (!whole || fsync(fileno(target->out)) == 0);
    if (target->out != stdout)
        good = fclose(target->out) == 0 && good;
    if (!target->part)
        return good;
    good = good && whole && !target->error && rename(target->part, target->file) == 0;
    int cause = errno;
    if (!good)
        unlink(target->part);
    free(target->part);
    errno = cause;
    return good;
}

static void show(void *context)
{
    struct target *target = context;
    int64_t now = cli_now_ms();
    struct text text = {0};
    if (!target->show || now - target->shown_ms < SHOW_MS)
        return;
    cli_add_bytes(&text, target->bytes);
    char *words = text_take(&text);
    fprintf(stderr, "\r%s: %s\033[K", target->file, words ? words : "");
    free(words);
    target->shown_ms = now;
}
