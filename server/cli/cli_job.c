/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_job.c - what subcommands share; see cli.h. */
#include "cli.h"
#include "cli_simulate.h"
#include "limits.h"
#include "scene_json.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static int load_job(const char *path, struct bcd_watch *watch, struct bcd_scene **out);
static void print_faults(const char *path, const struct bcd_errors *errors);

int cli_wrong(const struct cli_command *command, const char *format, ...)
{
    va_list arguments;
    fprintf(stderr, "bcd %s: ", command->name);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    cli_usage(stderr, command);
    return CLI_USAGE;
}

int cli_workers(const struct cli_line *line, int64_t *workers)
{
    const char *text = cli_value(line, "workers");
    *workers = cli_cores();
    if (!text || cli_parse_integer(text, 1, LIMIT_WORKERS_MAX, workers))
        return CLI_OK;
    return cli_wrong(line->command, "--workers must be 1 to %d, not \"%s\"", LIMIT_WORKERS_MAX,
                     text);
}

bool cli_parse_integer(const char *text, int64_t min, int64_t max, int64_t *value)
{
    char *end;
    errno = 0;
    long long n = strtoll(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0 || n < min || n > max)
        return false;
    *value = n;
    return true;
}

int cli_load_job(const char *path, struct bcd_scene **scene)
{
    return load_job(path, NULL, scene);
}

int cli_check_job(const char *path, struct bcd_scene **scene)
{
    struct bcd_watch watch = {.seconds_max = LIMIT_START_SECONDS_MAX};
    return load_job(path, &watch, scene);
}

static int load_job(const char *path, struct bcd_watch *watch, struct bcd_scene **out)
{
    struct bcd_errors errors = {0};
    struct bcd_scene *scene = NULL;
    struct ticket ticket = {0};
    size_t size;
    char *text = cli_read_file(path, &size);
    if (!text)
        return CLI_FAILED;
    enum bcd_status status = scene_json_complete_ticket(text, size, &scene, &ticket, &errors);
    free(text);
    ticket_fini(&ticket);
    if (status == BCD_OK)
        status = bcd_scene_prepare(scene, watch, &errors);
    if (status == BCD_OK) {
        *out = scene;
        return CLI_OK;
    }
    bcd_scene_free(scene);
    if (errors.count > 0)
        print_faults(path, &errors);
    else
        fprintf(stderr, "bcd: %s: %s\n", path, bcd_status_text(status));
    return CLI_FAILED;
}

/* One byte more than allowed is enough for the reader to refuse it. */
char *cli_read_file(const char *path, size_t *size)
{
    const size_t room = (size_t)LIMIT_BODY_BYTES_MAX + 1;
    FILE *file = strcmp(path, "-") == 0 ? stdin : fopen(path, "rb");
    char *text = malloc(room + 1);
    bool good = file && text;
    if (good) {
        *size = fread(text, 1, room, file);
        text[*size] = '\0';
        good = !ferror(file);
    }
    if (!good) {
        fprintf(stderr, "bcd: %s cannot be read: %s\n", path, strerror(errno));
        free(text);
        text = NULL;
    }
    if (file && file != stdin)
        fclose(file);
    return text;
}

void cli_put_clean(FILE *out, const char *text)
{
    for (; *text; text++) {
        bool control = (unsigned char)*text < 0x20 || *text == 0x7F;
        fputc(control ? '?' : *text, out);
    }
}

int cli_print_take(char *text)
{
    if (!text) {
        fprintf(stderr, "bcd: out of memory\n");
        return CLI_FAILED;
    }
    int status = cli_print_bytes(text, strlen(text));
    free(text);
    return status;
}

int cli_print_bytes(const char *bytes, size_t size)
{
    if (fwrite(bytes, 1, size, stdout) == size && fflush(stdout) == 0)
        return CLI_OK;
    fprintf(stderr, "bcd: the result cannot be written: %s\n", strerror(errno));
    return CLI_FAILED;
}

static void print_faults(const char *path, const struct bcd_errors *errors)
{
    size_t all = errors->count + errors->dropped;
    fprintf(stderr, "bcd: %s: %zu fault%s\n", path, all, all == 1 ? "" : "s");
    for (size_t i = 0; i < errors->count; i++) {
        fputs("  ", stderr);
        cli_put_clean(stderr, errors->items[i].field[0] ? errors->items[i].field : "the job");
        fputs(": ", stderr);
        cli_put_clean(stderr, errors->items[i].text);
        fputc('\n', stderr);
    }
    if (errors->dropped > 0)
        fprintf(stderr, "  and %zu more\n", errors->dropped);
}
