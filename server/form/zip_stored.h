/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * zip_stored.h - a zip archive of uncompressed files, written front to back into a text that
 * somebody empties on the way: sizes are known before, checksums after each file (data
 * descriptors); all sizes and offsets have 64 bits (PKWARE APPNOTE 6.3.9, 4.3, 4.5.3).
 *
 * Own code although libarchive could do it: that would bring eight further libraries (XML, ACLs,
 * cryptography, five compressors) into the daemon's address space to write four fixed headers.
 */
#ifndef ZIP_STORED_H
#define ZIP_STORED_H

#include "text.h"

#include <stdint.h>

enum { ZIP_FILES_MAX = 32, ZIP_NAME_SIZE = 80 };

struct zip {
    struct zip_file {
        char name[ZIP_NAME_SIZE];
        uint64_t offset, size;
        uint32_t crc;
    } files[ZIP_FILES_MAX];
    size_t count;
    uint64_t written; /* bytes of the archive so far */
};

/* Begins a file of `size` bytes; all of them go through zip_add before zip_end_file. At most
 * ZIP_FILES_MAX files. */
void zip_begin_file(struct zip *zip, struct text *text, const char *name, uint64_t size);
void zip_add(struct zip *zip, struct text *text, const void *bytes, size_t size);
void zip_end_file(struct zip *zip, struct text *text);

/* The directory, after the last file. */
void zip_end(struct zip *zip, struct text *text);

#endif
