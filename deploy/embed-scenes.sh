#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# embed-scenes.sh tests/scenes/2022-fig3-x.json ... > scenes.inc
#
# Prints the papers' scenes as one JSON list, as bytes in C: what GET /v1/scenes answers.
set -eu

list() {
    separator='{"scenes":['
    for file in "$@"; do
        base=${file##*/}
        case $base in
        2022-*) source='Phys. Rev. E 106, 054606 (2022)' doi=10.1103/PhysRevE.106.054606 ;;
        2024-*) source='Comput. Phys. Commun. 309, 109474 (2025)' doi=10.1016/j.cpc.2024.109474 ;;
        *)
            echo "embed-scenes.sh: $file: from what paper is that?" >&2
            exit 1
            ;;
        esac
        printf '%s\n{"name":"%s","source":"%s","doi":"%s","job":' "$separator" "${base%.json}" \
            "$source" "$doi"
        sed 's/^ *//; s/": /":/' "$file" | tr -d '\n'
        printf '}'
        separator=,
    done
    printf '\n]}\n'
}

echo 'static const char scenes_json[] = {'
list "$@" | od -An -v -tu1 | sed 's/[0-9][0-9]*/&,/g'
echo '0};'
