/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "secret.h"

#include <sha2.h>
#include <string.h>
#include <sys/random.h>

enum { BITS_SIZE = 52 }; /* one byte, of which five bits count, per digit: 260 bits */

static const char digits[] = "abcdefghijklmnopqrstuvwxyz234567";

bool secret_make(char secret[SECRET_SIZE])
{
    unsigned char bits[BITS_SIZE];
    if (getrandom(bits, sizeof(bits), 0) != (ssize_t)sizeof(bits))
        return false;
    memcpy(secret, "bcd_", 4);
    for (size_t i = 0; i < sizeof(bits); i++)
        secret[4 + i] = digits[bits[i] & 31];
    secret[SECRET_SIZE - 1] = '\0';
    secret_wipe(bits, sizeof(bits));
    return true;
}

bool secret_hash(const char *secret, unsigned char hash[SECRET_HASH_SIZE])
{
    size_t length = strnlen(secret, SECRET_SIZE);
    SHA2_CTX context;
    if (length != SECRET_SIZE - 1 || strncmp(secret, "bcd_", 4) != 0 ||
        strspn(secret + 4, digits) != length - 4)
        return false;
    SHA256Init(&context);
    SHA256Update(&context, (const unsigned char *)secret, length);
    SHA256Final(hash, &context);
    return true;
}

const char *secret_find(const char *text)
{
    return strstr(text, "bcd_");
}

bool secret_same(const unsigned char a[SECRET_HASH_SIZE], const unsigned char b[SECRET_HASH_SIZE])
{
    unsigned differs = 0;
    for (size_t i = 0; i < SECRET_HASH_SIZE; i++)
        differs |= (unsigned)(a[i] ^ b[i]);
    return differs == 0;
}

void secret_wipe(void *bytes, size_t size)
{
    explicit_bzero(bytes, size);
}
