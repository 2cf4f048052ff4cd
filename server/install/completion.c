// The words are written out: the completion does not run the program. Values without a list of
// their own are file names, which the shell completes by itself.
#include <stdbool.h>
#include <string.h>

#include "server/cli/command.h"
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
