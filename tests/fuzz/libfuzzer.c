/* SPDX-License-Identifier: GPL-3.0-or-later
 * libfuzzer.c - what libFuzzer calls; FUZZ_TARGET in the environment tells which target. */
#include "fuzz.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *wanted = getenv("FUZZ_TARGET");
    const struct fuzz_target *target;
    for (size_t i = 0; wanted && (target = fuzz_target(i)); i++) {
        if (strcmp(target->name, wanted) == 0) {
            if (size <= target->longest)
                target->run(data, size);
            return 0;
        }
    }
    fprintf(stderr, "FUZZ_TARGET is none\n");
    abort();
}
