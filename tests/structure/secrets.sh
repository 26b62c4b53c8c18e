#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Tokens are compared as hashes, in a time that does not tell where they differ, and all of them are
# looked at: what no test of a running server could measure reliably.
set -u

. tests/structure/_report.sh

echo 1..4
report "what reads a token is one file" "$(
    grep -rl 'authorization' --include='*.[ch]' server | grep -vE \
        '^server/(api/access\.c|http/(http\.[ch]|http_receive\.c)|cli/client\.c)$'
)"
report "it hashes the token, and compares the hash with every one that there is" "$(
    body=$(sed -n '/^struct identity access_identify/,/^}/p' server/api/access.c)
    for wanted in 'secret_hash(token, hash)' 'secret_same(hash, access->tokens\[i\].hash)' \
        'for (size_t i = 0; sound && i < access->count; i++)'; do
        echo "$body" | grep -q "$wanted" || echo "no $wanted"
    done
    echo "$body" | grep -nE '\b(break|goto|memcmp|strcmp|strncmp)\b'
)"
report "comparing two hashes reads all of both" "$(
    body=$(sed -n '/^bool secret_same/,/^}/p' server/base/secret.c)
    echo "$body" | grep -q 'differs |= ' || echo "no such loop"
    echo "$body" | grep -nE '\b(break|if|memcmp)\b|&&|\|\|'
)"
report "no hash of a token is compared in another way" "$(
    grep -nE '(memcmp|strcmp|strncmp|bcmp)[ ]*\(.*(secret|token.*hash|hash.*token)' -r server \
        --include='*.c' | grep -vE 'strncmp\(secret, "bcd_", 4\)'
)"
