/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fuzz.h"

#include <string.h>

const struct fuzz_target *fuzz_target(size_t index)
{
    static const struct fuzz_target targets[] = {
        {"job", fuzz_job, 4096},         {"ticket", fuzz_ticket, 2048},
        {"sweep", fuzz_sweep, 4096},     {"formula", fuzz_formula, 1100},
        {"request", fuzz_request, 4096}, {"find", fuzz_find, 1024},
        {"blob", fuzz_blob, 8192},       {"index", fuzz_index, 8192},
    };
    return index < sizeof(targets) / sizeof(targets[0]) ? &targets[index] : NULL;
}

char *fuzz_text(const uint8_t *data, size_t size)
{
    char *text = malloc(size + 1);
    FUZZ_CHECK(text);
    memcpy(text, data, size);
    text[size] = '\0';
    return text;
}
