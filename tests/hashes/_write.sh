#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Writes the vectors of this folder anew, after a change that raised the result version: NAME.txt is
# the encoding of the job NAME.json, SHA256SUMS the hashes. Their differences belong into the commit.
set -eu
cd "$(dirname "$0")/../.."
for job in tests/hashes/*.json; do
    "${B:-build}/bcd" check --encoding "$job" >"${job%.json}.txt"
done
cd tests/hashes
sha256sum ./*.txt | sed 's, \./, ,' >SHA256SUMS
