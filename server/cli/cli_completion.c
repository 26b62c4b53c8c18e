/* SPDX-License-Identifier: GPL-3.0-or-later
 * cli_completion.c - bcd completion: what bash and zsh need to complete its command line, from the
 * rows of the commands; see cli.h. */
#include "cli.h"
#include "text.h"

#include <string.h>

static char *print_bash(void);
static char *print_zsh(void);

static int completion(const struct cli_line *line)
{
    if (strcmp(line->operand[0], "bash") == 0)
        return cli_print_take(print_bash());
    if (strcmp(line->operand[0], "zsh") == 0)
        return cli_print_take(print_zsh());
    return cli_wrong(line->command, "bash and zsh are known, not \"%s\"", line->operand[0]);
}

const struct cli_command cli_completion_command = {
    .name = "completion",
    .operands = "bash|zsh",
    .least = 1,
    .most = 1,
    .doc = "prints what a shell needs to complete this command line",
    .text = "make install puts it in place. For one session of bash:\n"
            "  eval \"$(bcd completion bash)\"",
    .function = completion,
};

/* Whether its operands are ids that the server knows. */
static bool takes_ids(const struct cli_command *command)
{
    return command->server &&
           (strncmp(command->operands, "ID", 2) == 0 ||
            strncmp(command->operands, "SWEEP ", 6) == 0) &&
           strncmp(command->name, "token", 5) != 0;
}

static bool takes_file(const char *value)
{
    return strstr(value, "FILE") || strstr(value, "DIR") || strstr(value, ".json");
}

/* "bash|zsh" */
static bool takes_words(const char *operands)
{
    return strchr(operands, '|') &&
           operands[strspn(operands, "abcdefghijklmnopqrstuvwxyz|")] == '\0';
}

/* ---------------------------------------------------------------------- bash */

static void add_bash_command(struct text *text, const struct cli_command *command)
{
    const struct cli_option *row;
    text_add(text, "    '%s')\n        options=\"--help", command->name);
    for (size_t i = 0; (row = cli_option_at(command, i)); i++)
        text_add(text, " --%s", row->name);
    text_add(text, "\"\n");
    if (takes_ids(command))
        text_add(text, "        words='$(bcd list --ids --limit 100 --timeout 2 2>/dev/null)'\n");
    else if (takes_words(command->operands))
        text_add(text, "        words='%s'\n", command->operands);
    text_add(text, "        case $before in\n");
    for (size_t i = 0; (row = cli_option_at(command, i)); i++) {
        if (!row->value)
            continue;
        text_add(text, "        --%s", row->name);
        if (row->letter)
            text_add(text, " | -%c", row->letter);
        text_add(text, ") value=%d words='%s' ;;\n", 1, row->choices ? row->choices : "");
    }
    text_add(text, "        esac ;;\n");
}

static char *print_bash(void)
{
    const struct cli_command *command;
    struct text text = {0};
    text_add(&text, "# bash completion for bcd, made by `bcd completion bash`\n"
                    "_bcd() {\n"
                    "    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
                    "    local command=${COMP_WORDS[1]} options= words= value=\n"
                    "    COMPREPLY=()\n"
                    "    if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
                    "        COMPREPLY=($(compgen -W 'help --help --version");
    for (size_t i = 0; (command = cli_command_at(i)); i++)
        text_add(&text, " %s", command->name);
    text_add(&text, "' -- \"$word\"))\n        return\n    fi\n    case $command in\n");
    for (size_t i = 0; (command = cli_command_at(i)); i++) {
        if (!command->parts)
            continue;
        text_add(&text,
                 "    %s)\n        if [ \"$COMP_CWORD\" -eq 2 ]; then\n"
                 "            COMPREPLY=($(compgen -W '",
                 command->name);
        for (size_t p = 0; command->parts[p]; p++)
            text_add(&text, "%s%s", p ? " " : "", cli_word(command->parts[p]));
        text_add(&text, "' -- \"$word\"))\n            return\n        fi\n"
                        "        command=\"$command ${COMP_WORDS[2]}\" ;;\n");
    }
    text_add(&text, "    help)\n        words='");
    for (size_t i = 0; (command = cli_command_at(i)); i++)
        text_add(&text, "%s%s", i ? " " : "", command->name);
    text_add(&text, "' ;;\n    esac\n    case $command in\n");
    for (size_t i = 0; (command = cli_command_at(i)); i++) {
        if (!command->parts)
            add_bash_command(&text, command);
        for (size_t p = 0; command->parts && command->parts[p]; p++)
            add_bash_command(&text, command->parts[p]);
    }
    /* Without words of ours readline completes names of files. */
    text_add(&text, "    esac\n"
                    "    if [ -z \"$value\" ] && [ \"${word#-}\" != \"$word\" ]; then\n"
                    "        words=$options\n"
                    "    fi\n"
                    "    eval \"words=\\\"$words\\\"\"\n"
                    "    COMPREPLY=($(compgen -W \"${words//|/ }\" -- \"$word\"))\n"
                    "}\n"
                    "complete -o default -F _bcd bcd\n");
    return text_take(&text);
}

/* ----------------------------------------------------------------------- zsh */

/* Within '...' of a description: quotes end it, colons and brackets mean something. */
static void add_zsh_words(struct text *text, const char *words)
{
    for (const char *c = words; *c; c++)
        if (*c == '\'')
            text_add(text, "'\\''");
        else if (strchr(":[]\\", *c))
            text_add(text, "\\%c", *c);
        else
            text_add_bytes(text, *c == '\n' ? " " : c, 1);
}

static void add_zsh_option(struct text *text, const struct cli_command *command,
                           const struct cli_option *row)
{
    const struct cli_option *other;
    text_add(text, " \\\n            '");
    if (row->many) {
        text_add(text, "*");
    } else {
        text_add(text, "(--%s", row->name);
        for (size_t i = 0; row->either && (other = cli_option_at(command, i)); i++)
            if (other != row && other->either == row->either)
                text_add(text, " --%s", other->name);
        text_add(text, ")");
    }
    text_add(text, "--%s[", row->name);
    add_zsh_words(text, row->doc);
    text_add(text, "]");
    if (row->value) {
        text_add(text, ":");
        add_zsh_words(text, row->value);
        text_add(text, ":");
        if (row->choices)
            text_add(text, "(%s)", row->choices);
        else if (takes_file(row->value))
            text_add(text, "_files");
    }
    text_add(text, "'");
}

static void add_zsh_command(struct text *text, const struct cli_command *command)
{
    const struct cli_option *row;
    text_add(text, "    '%s')\n        _arguments '--help[tells more]'", command->name);
    for (size_t i = 0; (row = cli_option_at(command, i)); i++)
        add_zsh_option(text, command, row);
    if (takes_ids(command))
        text_add(text, " \\\n            '*:id:{compadd -- ${(f)\"$(bcd list --ids --limit 100 "
                       "--timeout 2 2>/dev/null)\"}}'");
    else if (command->operands[0] && takes_file(command->operands))
        text_add(text, " \\\n            '*:file:_files'");
    else if (takes_words(command->operands)) {
        text_add(text, " \\\n            '*:word:(");
        for (const char *c = command->operands; *c; c++)
            text_add_bytes(text, *c == '|' ? " " : c, 1);
        text_add(text, ")'");
    }
    text_add(text, " ;;\n");
}

static void add_zsh_list(struct text *text, const struct cli_command *const *commands)
{
    const struct cli_command *command;
    for (size_t i = 0; (command = commands ? commands[i] : cli_command_at(i)); i++) {
        text_add(text, "%s'%s:", i ? " " : "", cli_word(command));
        add_zsh_words(text, command->doc);
        text_add(text, "'");
    }
}

static char *print_zsh(void)
{
    const struct cli_command *command;
    struct text text = {0};
    text_add(&text, "#compdef bcd\n# zsh completion for bcd, made by `bcd completion zsh`\n"
                    "_bcd() {\n    local -a commands\n    local command=$words[2]\n"
                    "    commands=(");
    add_zsh_list(&text, NULL);
    text_add(&text, " 'help:tells more of a command')\n"
                    "    if ((CURRENT == 2)) || { ((CURRENT == 3)) && [[ $command == help ]]; "
                    "}; then\n        _describe command commands\n        return\n    fi\n"
                    "    case $command in\n");
    for (size_t i = 0; (command = cli_command_at(i)); i++) {
        if (!command->parts)
            continue;
        text_add(&text, "    %s)\n        commands=(", command->name);
        add_zsh_list(&text, command->parts);
        text_add(&text, ")\n        if ((CURRENT == 3)); then\n"
                        "            _describe command commands\n            return\n        fi\n"
                        "        command=\"$command $words[3]\"\n"
                        "        shift words\n        ((CURRENT--)) ;;\n");
    }
    text_add(&text, "    esac\n    shift words\n    ((CURRENT--))\n    case $command in\n");
    for (size_t i = 0; (command = cli_command_at(i)); i++) {
        if (!command->parts)
            add_zsh_command(&text, command);
        for (size_t p = 0; command->parts && command->parts[p]; p++)
            add_zsh_command(&text, command->parts[p]);
    }
    text_add(&text,
             "    esac\n}\n"
             "if [ \"$funcstack[1]\" = _bcd ]; then _bcd \"$@\"; else compdef _bcd bcd; fi\n");
    return text_take(&text);
}
