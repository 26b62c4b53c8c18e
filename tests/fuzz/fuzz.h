/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * fuzz.h - what is fed with bytes of any kind, and must neither crash nor break what its header
 * promises. Each target is a function on bytes; test_corpus.c feeds it the files of
 * corpus/NAME/ in every `make check`, libfuzzer.c what libFuzzer thinks up (fuzz_long.sh). A
 * promise that is broken ends the process: an input that does so becomes a file of the corpus.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

struct fuzz_target {
    const char *name;
    void (*run)(const uint8_t *data, size_t size);
    size_t longest; /* bytes of an input that is worth trying */
};

/* NULL past the last. */
const struct fuzz_target *fuzz_target(size_t index);

/* fuzz_job.c: jobs, and label, tags and priority beside them. */
void fuzz_job(const uint8_t *data, size_t size);
void fuzz_ticket(const uint8_t *data, size_t size);
/* fuzz_sweep.c: a sweep; after a NUL an extension of it. */
void fuzz_sweep(const uint8_t *data, size_t size);
/* fuzz_formula.c: an energy in x. */
void fuzz_formula(const uint8_t *data, size_t size);
/* fuzz_request.c: "METHOD TARGET", header lines, an empty line, a body; a query of GET /v1/jobs. */
void fuzz_request(const uint8_t *data, size_t size);
void fuzz_find(const uint8_t *data, size_t size);
/* fuzz_blob.c: the bodies of checkpoints, tallies and tables, and blobs whole; columns and cursors
 * of the index that jobs are found by. The first byte chooses. */
void fuzz_blob(const uint8_t *data, size_t size);
void fuzz_index(const uint8_t *data, size_t size);

#define FUZZ_CHECK(condition)                                                                      \
    ((condition) ? (void)0                                                                         \
                 : (fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition), abort()))

/* The bytes as a string, malloc'ed. */
char *fuzz_text(const uint8_t *data, size_t size);

#endif
