/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * secret.h - tokens as people hold them: "bcd_" and 256 random bits in base 32.
 *
 * What is kept of one is its SHA-256. A slow hash (bcrypt, argon2) protects words that people think
 * up from being guessed; 256 random bits cannot be guessed at any speed, and the check must be
 * cheap, as every request makes it.
 */
#ifndef SECRET_H
#define SECRET_H

#include <stdbool.h>
#include <stddef.h>

enum { SECRET_SIZE = 4 + 52 + 1, SECRET_HASH_SIZE = 32 };

/* A new one; false = the system has no random bits. */
bool secret_make(char secret[SECRET_SIZE]);

/* False when the text cannot be one. */
bool secret_hash(const char *secret, unsigned char hash[SECRET_HASH_SIZE]);

/* Where something that looks like the beginning of one stands in a text; NULL if nowhere. */
const char *secret_find(const char *text);

/* Takes the same time wherever they differ. */
bool secret_same(const unsigned char a[SECRET_HASH_SIZE], const unsigned char b[SECRET_HASH_SIZE]);

/* Overwrites what was secret, whatever the compiler thinks of it. */
void secret_wipe(void *bytes, size_t size);

#endif
