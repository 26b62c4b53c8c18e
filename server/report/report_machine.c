/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report_machine.h"
#include "text.h"

#include <stdio.h>
#include <string.h>
#include <sys/utsname.h>
#include <unistd.h>

#ifdef __clang__
#define COMPILER "clang " __clang_version__
#else
#define COMPILER "gcc " __VERSION__
#endif

/* "model name : ..." of the first core, as Linux tells it on some architectures; "" elsewhere. */
static void find_processor(char *name, int size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    name[0] = '\0';
    while (file && name[0] == '\0' && fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');
        if (colon && strncmp(line, "model name", 10) == 0)
            snprintf(name, (size_t)size, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
    }
    if (file)
        fclose(file);
}

char *report_machine_json(void)
{
    struct utsname machine;
    struct text text = {0};
    char processor[200];
    find_processor(processor, sizeof processor);
    if (uname(&machine) != 0)
        snprintf(machine.machine, sizeof machine.machine, "unknown");
    text_add(&text, "{\"architecture\":");
    text_add_json_string(&text, machine.machine);
    text_add(&text, ",\"processor\":");
    text_add_json_string(&text, processor);
    text_add(&text, ",\"cores\":%ld,\"compiler\":", sysconf(_SC_NPROCESSORS_ONLN));
    text_add_json_string(&text, COMPILER);
    text_add(&text, "}");
    return text_take(&text);
}
