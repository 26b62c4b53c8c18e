#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Manual pages and completions tell of every command and option, without a complaint of their
# readers, and are installed.
set -u
LC_ALL=C
export LC_ALL
B=${B:-build}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

. tests/structure/_report.sh

make --no-print-directory -s install B="$B" DESTDIR="$work" PREFIX=/usr >"$work/make" 2>&1
share=$work/usr/share
for file in man/man1/bcd.1 man/man8/bcdd.8 bash-completion/completions/bcd zsh/site-functions/_bcd; do
    report "installed: $file" "$([ -s "$share/$file" ] || tail -n 5 "$work/make")"
done

for page in man1/bcd.1 man8/bcdd.8; do
    file=$share/man/$page
    if command -v mandoc >/dev/null; then
        report "$page: mandoc" "$(mandoc -T lint -W warning "$file" 2>&1)"
        mandoc -T ascii "$file" | col -b >"$work/${page#*/}"
    else
        count=$((count + 1))
        echo "ok $count - $page # SKIP no mandoc"
        sed 's/\\-/-/g; s/\\fI//g; s/\\fR//g' "$file" >"$work/${page#*/}"
    fi
    if command -v man >/dev/null && command -v groff >/dev/null; then
        report "$page: man" "$(LC_ALL=C.UTF-8 man --warnings -l "$file" 2>&1 >/dev/null)"
    fi
done

# "command|option" of all that --help tells of.
commands() {
    "$B/bcd" help | sed -n 's/^  \([a-z][a-z-]*\)  .*/\1/p'
}
for command in $(commands); do
    "$B/bcd" "$command" --help | sed -n "s/^usage: bcd \($command [a-z-]*\) .*/\1/p; s/^usage: bcd \($command\)\$/\1/p" |
        grep . || echo "$command"
done | while read -r first second; do
    case $second in
    '' | *[!a-z-]* | -*) echo "$first" ;;
    *) if "$B/bcd" help "$first" "$second" >/dev/null 2>&1; then echo "$first $second"; else echo "$first"; fi ;;
    esac
done | sort -u >"$work/commands"
report "commands are found" "$([ "$(wc -l <"$work/commands")" -gt 15 ] || cat "$work/commands")"
while read -r command; do
    # shellcheck disable=SC2086
    "$B/bcd" help $command | sed -n "s/^  --\([a-z-]*\).*/$command|\1/p"
done <"$work/commands" >"$work/options"
report "options are found" "$([ "$(wc -l <"$work/options")" -gt 40 ] || cat "$work/options")"

report "bcd(1) has every command" "$(
    while read -r command; do
        grep -qE "^ +bcd $command( |\$)" "$work/bcd.1" || echo "$command"
    done <"$work/commands"
)"
report "bcd(1) has every option" "$(
    cut -d '|' -f 2 "$work/options" | sort -u | while read -r option; do
        grep -qE "^ +--$option( |,|\$)" "$work/bcd.1" || echo "--$option"
    done
)"
report "bcdd(8) has every option of bcdd --help (deploy/bcdd.8)" "$(
    "$B/bcdd" --help | grep -oE -- '--[a-z-]+' | sort -u | while read -r option; do
        grep -qE -- "^ +$option( |,|\$)" "$work/bcdd.8" || echo "$option"
    done
)"

# Completion as a shell would ask for it.
cat >"$work/ask.bash" <<'ASK'
. "$1"
shift
COMP_WORDS=("$@")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
_bcd
printf '%s\n' "${COMPREPLY[@]}"
ASK
if command -v bash >/dev/null; then
    bash=$share/bash-completion/completions/bcd
    report "bash: every option of every command" "$(
        while IFS='|' read -r command option; do
            # shellcheck disable=SC2086
            bash "$work/ask.bash" "$bash" bcd $command "--$option" | grep -qx -- "--$option" ||
                echo "$command --$option"
        done <"$work/options"
    )"
    report "bash: commands, reports, choices" "$({
        bash "$work/ask.bash" "$bash" bcd subm
        bash "$work/ask.bash" "$bash" bcd report fig
        bash "$work/ask.bash" "$bash" bcd list --state ru
    } | diff - /dev/fd/3 3<<'WANTED'
submit
figures
running
WANTED
)"
fi
if command -v zsh >/dev/null; then
    report "zsh: reads it" "$(zsh -n "$share/zsh/site-functions/_bcd" 2>&1)"
fi
echo "1..$count"
