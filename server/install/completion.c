// Each shell gets its words written out: no completion runs the program. Values without a list of
// their own are file names, which shells complete by themselves.
#include <stdbool.h>
#include <string.h>

#include "server/command/command.h"
#include "server/install/pages.h"
#include "server/options.h"

// What `impactd get` is told to get.
static const char parts[] =
    "result series psd impacts energy manifest bundle job tradeoff ensemble compare sensitivity "
    "table";

static bool has_operand(const Command *command, const char *part) {
    return command->operands != NULL && strstr(command->operands, part) != NULL;
}

// "create list" of "create|list [NAME]", where the first operand is one of a list.
enum { ACTIONS_SIZE = 160 };
static bool actions_of(const Command *command, char actions[ACTIONS_SIZE]) {
    const char *operands = command->operands != NULL ? command->operands : "";
    const size_t length = strcspn(operands, " ");
    if (memchr(operands, '|', length) == NULL || length >= ACTIONS_SIZE)
        return false;
    snprintf(actions, ACTIONS_SIZE, "%.*s", (int)length, operands);
    for (char *bar = actions; (bar = strchr(bar, '|')) != NULL;)
        *bar = ' ';
    return true;
}

static void names_print(FILE *file) {
    for (size_t i = 0; commands[i] != NULL; i++)
        fprintf(file, "%s%s", i > 0 ? " " : "", commands[i]->name);
}

static void choices_print(FILE *file, const Field *row) {
    for (size_t i = 0; row->choices[i] != NULL; i++)
        fprintf(file, "%s%s", i > 0 ? " " : "", row->choices[i]);
}

// "run:--output | run:-o": every flag of the rows that `wanted` takes. Returns how many.
static size_t cases_print(FILE *file, const Command *command, const Field *row, size_t before) {
    char name[OPTION_NAME];
    const char letter = option_spell(command->options, row, name);
    fprintf(file, "%s%s:%s", before > 0 ? " | " : "", command->name, name);
    if (letter != '\0')
        fprintf(file, " | %s:-%c", command->name, letter);
    return before + 1;
}

void completion_bash(FILE *file) {
    fputs("# bash completion of impactd, printed from its tables.\n"
          "_impactd() {\n"
          "    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]}\n"
          "    COMPREPLY=()\n"
          "    if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
          "        mapfile -t COMPREPLY < <(compgen -W '",
          file);
    names_print(file);
    fputs(" --help --version' -- \"$cur\")\n"
          "        return\n"
          "    fi\n"
          "    case ${COMP_WORDS[1]}:$prev in\n",
          file);
    for (size_t i = 0; commands[i] != NULL; i++)
        for (const Field *row = commands[i]->options; row != NULL && row->kind != FIELD_KIND_END;
             row++)
            if (row->kind == FIELD_KIND_CHOICE) {
                fputs("    ", file);
                (void)cases_print(file, commands[i], row, 0);
                fputs(") mapfile -t COMPREPLY < <(compgen -W '", file);
                choices_print(file, row);
                fputs("' -- \"$cur\") && return ;;\n", file);
            }
    for (size_t i = 0; commands[i] != NULL; i++) {
        size_t count = 0;
        for (const Field *row = commands[i]->options; row != NULL && row->kind != FIELD_KIND_END;
             row++)
            if (row->kind != FIELD_KIND_CHOICE && row->kind != FIELD_KIND_FLAG) {
                fputs(count == 0 ? "    " : "", file);
                count = cases_print(file, commands[i], row, count);
            }
        fputs(count > 0 ? ") return ;;\n" : "", file);
    }
    fputs("    esac\n    case ${COMP_WORDS[1]}:$cur in\n", file);
    for (size_t i = 0; commands[i] != NULL; i++) {
        char name[OPTION_NAME], actions[ACTIONS_SIZE];
        fprintf(file, "    %s:-*) mapfile -t COMPREPLY < <(compgen -W '--help", commands[i]->name);
        for (const Field *row = commands[i]->options; row != NULL && row->kind != FIELD_KIND_END;
             row++) {
            (void)option_spell(commands[i]->options, row, name);
            fprintf(file, " %s", name);
        }
        fputs("' -- \"$cur\") ;;\n", file);
        if (has_operand(commands[i], "COMMAND")) {
            fprintf(file, "    %s:*) mapfile -t COMPREPLY < <(compgen -W '", commands[i]->name);
            names_print(file);
            fputs("' -- \"$cur\") ;;\n", file);
        } else if (has_operand(commands[i], "WHAT")) {
            fprintf(file,
                    "    %s:*) [ \"$COMP_CWORD\" -lt 3 ] || mapfile -t COMPREPLY < <(compgen -W "
                    "'%s' -- \"$cur\") ;;\n",
                    commands[i]->name, parts);
        } else if (actions_of(commands[i], actions)) {
            fprintf(file,
                    "    %s:*) [ \"$COMP_CWORD\" -ne 2 ] || mapfile -t COMPREPLY < <(compgen -W "
                    "'%s' -- \"$cur\") ;;\n",
                    commands[i]->name, actions);
        }
    }
    fputs("    esac\n"
          "}\n"
          "complete -o default -F _impactd impactd\n",
          file);
}

// Within single quotes of both shells; `special` are escaped by a backslash.
static void quoted(FILE *file, const char *text, const char *special, const char *quote) {
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '\'')
            fputs(quote, file);
        else if (strchr(special, *c) != NULL)
            fprintf(file, "\\%c", *c);
        else
            fputc(*c, file);
    }
}

static void zsh_option(FILE *file, const Command *command, const Field *row) {
    char name[OPTION_NAME];
    const char letter = option_spell(command->options, row, name);
    fputs("            ", file);
    if (letter != '\0')
        fprintf(file, "'(-%c %s)'{-%c,%s}", letter, name, letter, name);
    else
        fprintf(file, "%s", name);
    fputs("'[", file);
    quoted(file, row->doc, "[]:\\", "'\\''");
    fputs("]", file);
    if (row->kind == FIELD_KIND_CHOICE) {
        fputs(":value:(", file);
        choices_print(file, row);
        fputs(")", file);
    } else if (row->kind != FIELD_KIND_FLAG) {
        fputs(":value:_files", file);
    }
    fputs("' \\\n", file);
}

void completion_zsh(FILE *file) {
    fputs("#compdef impactd\n"
          "# zsh completion of impactd, printed from its tables.\n"
          "_impactd() {\n"
          "    local -a names\n"
          "    names=(\n",
          file);
    for (size_t i = 0; commands[i] != NULL; i++) {
        fprintf(file, "        '%s:", commands[i]->name);
        quoted(file, commands[i]->summary, ":\\", "'\\''");
        fputs("'\n", file);
    }
    fputs("    )\n"
          "    if ((CURRENT == 2)); then\n"
          "        _describe command names\n"
          "        return\n"
          "    fi\n"
          "    local chosen=$words[2]\n"
          "    shift words\n"
          "    ((CURRENT--))\n"
          "    case $chosen in\n",
          file);
    for (size_t i = 0; commands[i] != NULL; i++) {
        char actions[ACTIONS_SIZE];
        fprintf(file, "    %s)\n        _arguments \\\n", commands[i]->name);
        for (const Field *row = commands[i]->options; row != NULL && row->kind != FIELD_KIND_END;
             row++)
            zsh_option(file, commands[i], row);
        if (has_operand(commands[i], "COMMAND")) {
            fputs("            '1:command:(", file);
            names_print(file);
            fputs(")'\n", file);
        } else if (has_operand(commands[i], "WHAT")) {
            fprintf(file, "            '1:id:' '2:what:(%s)'\n", parts);
        } else if (actions_of(commands[i], actions)) {
            fprintf(file, "            '1:action:(%s)' '2:name:'\n", actions);
        } else {
            fputs("            '*:file:_files'\n", file);
        }
        fputs("        ;;\n", file);
    }
    fputs("    esac\n}\n_impactd \"$@\"\n", file);
}

void completion_fish(FILE *file) {
    fputs("# fish completion of impactd, printed from its tables.\n", file);
    for (size_t i = 0; commands[i] != NULL; i++) {
        const Command *command = commands[i];
        char actions[ACTIONS_SIZE];
        if (actions_of(command, actions))
            fprintf(file, "complete -c impactd -n '__fish_seen_subcommand_from %s' -f -a '%s'\n",
                    command->name, actions);
        fprintf(file, "complete -c impactd -n __fish_use_subcommand -f -a %s -d '", command->name);
        quoted(file, command->summary, "\\", "\\'");
        fputs("'\n", file);
        for (const Field *row = command->options; row != NULL && row->kind != FIELD_KIND_END;
             row++) {
            char name[OPTION_NAME];
            const char letter = option_spell(command->options, row, name);
            fprintf(file, "complete -c impactd -n '__fish_seen_subcommand_from %s' -l %s",
                    command->name, name + 2);
            if (letter != '\0')
                fprintf(file, " -s %c", letter);
            if (row->kind == FIELD_KIND_CHOICE) {
                fputs(" -x -a '", file);
                choices_print(file, row);
                fputs("'", file);
            } else if (row->kind != FIELD_KIND_FLAG) {
                fputs(" -r", file);
            }
            fputs(" -d '", file);
            quoted(file, row->doc, "\\", "\\'");
            fputs("'\n", file);
        }
    }
    fprintf(file, "complete -c impactd -n '__fish_seen_subcommand_from get' -f -a '%s'\n", parts);
}
