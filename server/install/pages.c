// print_pages DIRECTORY: the manual pages, the bash completion and parts of the guide, printed from
// the tables of the program. A tool of the build, not part of the program.
#include <ctype.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "core/solve/solver.h"
#include "core/study/study.h"
#include "server/api/app.h"
#include "server/cli/client.h"
#include "server/http/router.h"
#include "server/options.h"

// Text as source of man(7), in which a backslash, and a point or quote at the start of a line, are
// special.
static void escaped(FILE *file, const char *text, bool is_line_start) {
    static const char special[] = "\\-'^~";
    static const char *const escapes[] = {"\\e", "\\-", "\\(aq", "\\(ha", "\\(ti"};
    for (const char *c = text; *c != '\0'; c++) {
        const char *found = strchr(special, *c);
        if ((*c == '.' || *c == '\'') && (c > text ? c[-1] == '\n' : is_line_start))
            fputs("\\&", file);
        if (found != NULL)
            fputs(escapes[found - special], file);
        else
            fputc(*c, file);
    }
}

static void head(FILE *file, const char *name, const char *section) {
    fprintf(file, ".\\\" Printed from the program's tables.\n.TH %s %s \"\" \"impactd %s\"\n", name,
            section, program_version);
}

static void unit_print(FILE *file, const Field *row) {
    if (row->unit == NULL)
        return;
    fputs(" [", file);
    escaped(file, row->unit, false);
    fputs("]", file);
}

static void option_print(FILE *file, const Field *row) {
    char name[OPTION_NAME];
    const char letter = option_spell(row, name);
    fputs(".TP\n", file);
    if (letter != '\0')
        fprintf(file, "\\fB\\-%c\\fR, ", letter);
    fputs("\\fB", file);
    escaped(file, name, false);
    fputs("\\fR", file);
    if (row->kind == FIELD_KIND_CHOICE) {
        fputs(" \\fI", file);
        for (size_t i = 0; row->choices[i] != NULL; i++) {
            fputs(i > 0 ? "|" : "", file);
            escaped(file, row->choices[i], false);
        }
        fputs("\\fR", file);
    } else if (option_operand(row) != NULL) {
        fprintf(file, " \\fI%s\\fR", option_operand(row));
    }
    fputc('\n', file);
    escaped(file, row->doc, true);
    unit_print(file, row);
    fputc('\n', file);
}

// The lines before the first empty one are examples, the others are text.
static void help_print(FILE *file, const char *help) {
    fputs(".EX\n", file);
    bool is_example = true;
    for (; *help != '\0'; help += strcspn(help, "\n") + 1) {
        char line[512];
        snprintf(line, sizeof line, "%.*s", (int)strcspn(help, "\n"), help);
        if (line[0] == '\0') {
            fputs(is_example ? ".EE\n.PP\n" : ".PP\n", file);
            is_example = false;
        } else {
            escaped(file, line, true);
            fputc('\n', file);
        }
    }
    if (is_example)
        fputs(".EE\n", file);
}

static const char front[] =
    ".SH NAME\n"
    "impactd \\- simulate structures with impact dampers\n"
    ".SH SYNOPSIS\n"
    ".B impactd\n"
    ".I COMMAND\n"
    "[\\fIOPTION\\fR]... [\\fIOPERAND\\fR]...\n"
    ".SH DESCRIPTION\n"
    "An impact damper is a free mass that bounces between two stops inside a vibrating structure "
    "and\n"
    "dissipates its energy. A scene describes structure, masses, stops and excitation in JSON, "
    "see\n"
    ".BR impactd\\-scene (5).\n"
    "The results are the motion, all impacts, spectra and an energy balance. Some commands run\n"
    "simulations themselves, others send them to a server, which\n.B impactd serve\nstarts.\n"
    "Each command has a page of its own.\n"
    ".SH COMMANDS\n";

static const char exits[] =
    ".SH EXIT STATUS\n"
    ".TP\n0\nok\n.TP\n1\nfailed\n.TP\n2\nusage\n.TP\n3\nfaulty scene or file\n.TP\n4\nnot found\n"
    ".TP\n5\npermission denied\n.TP\n7\nthe server cannot be reached, or is too busy\n"
    ".TP\n8\nthe job has not finished after \\-\\-wait\n.TP\n130\ninterrupted\n";

static const char back[] =
    ".SH ENVIRONMENT\n"
    ".TP\n.B IMPACTD_SERVER\nURL of the server, for the commands that ask one.\n"
    ".TP\n.BR IMPACTD_TOKEN , \" IMPACTD_TOKEN_FILE\"\nThe bearer token for it, or a file with "
    "the token that only its owner can read.\n"
    ".TP\n.B IMPACTD_CA_FILE\nCertificates to trust.\n"
    ".TP\n.BI IMPACTD_ NAME\nA setting of\n.BR \"impactd serve\" :\nIMPACTD_MAX_BODY is "
    "\\-\\-max\\-body.\n"
    ".TP\n.B NO_COLOR\nNo colours on a terminal, if it is set.\n"
    ".SH FILES\n"
    ".TP\n.I $XDG_STATE_HOME/impactd\nThe database of the server, unless \\-\\-data names another "
    "directory; else under\n.IR \\(ti/.local/state .\n"
    ".TP\n.I /etc/default/impactd\nSettings of the service, one IMPACTD_NAME=VALUE per "
    "line.\n"
    ".SH SEE ALSO\n"
    ".BR impactd\\-scene (5),\n.BR impactd.service (8)\n";

static void manual_command(FILE *file, const Command *command) {
    char title[64] = "IMPACTD\\-";
    for (const char *c = command->name; *c != '\0'; c++)
        snprintf(strchr(title, '\0'), 4, "%s%c", *c == '-' ? "\\" : "", toupper((unsigned char)*c));
    head(file, title, "1");
    fputs(".SH NAME\nimpactd\\-", file);
    escaped(file, command->name, false);
    fputs(" \\- ", file);
    escaped(file, command->summary, false);
    fputs("\n.SH SYNOPSIS\n.B impactd ", file);
    escaped(file, command->name, false);
    fputs(command->options != NULL ? "\n[\\fIOPTION\\fR]...\n" : "\n", file);
    escaped(file, command->operands != NULL ? command->operands : "", true);
    fputs(command->operands != NULL ? "\n.SH EXAMPLES\n" : ".SH EXAMPLES\n", file);
    help_print(file, command->help);
    if (command->options != NULL)
        fputs(".SH OPTIONS\n", file);
    for (const Field *row = command->options; row != NULL && row->kind != FIELD_KIND_END; row++)
        option_print(file, row);
    fprintf(file, "%s.SH SEE ALSO\n.BR impactd (1),\n.BR impactd\\-scene (5)\n", exits);
}

static void manual_program(FILE *file) {
    head(file, "IMPACTD", "1");
    fputs(front, file);
    const OptionGroup *group = command_groups;
    for (size_t i = 0; commands[i] != NULL; i++) {
        if (group->first != NULL && strcmp(group->first, commands[i]->name) == 0)
            fprintf(file, ".SS %s\n", group++->title);
        fputs(".TP\n.BR impactd\\-", file);
        escaped(file, commands[i]->name, false);
        fputs(" (1)\n", file);
        escaped(file, commands[i]->summary, true);
        fputc('\n', file);
    }
    fputs(exits, file);
    fputs(back, file);
}

static const char *kind_name(const Field *row) {
    static const char *const names[] = {
        [FIELD_KIND_REAL] = "number",          [FIELD_KIND_COUNT] = "whole number",
        [FIELD_KIND_FLAG] = "true or false",   [FIELD_KIND_TEXT] = "text",
        [FIELD_KIND_CHOICE] = "text",          [FIELD_KIND_REALS] = "numbers",
        [FIELD_KIND_ROWS] = "rows of numbers", [FIELD_KIND_TEXTS] = "texts",
        [FIELD_KIND_ITEM] = "object",          [FIELD_KIND_LIST] = "objects",
        [FIELD_KIND_VARIANT] = "object"};
    return (size_t)row->kind < COUNT(names) && names[row->kind] != NULL ? names[row->kind] : "";
}

// "number [kg], above 0; required"
static void nature_print(FILE *file, const Field *row) {
    char least[32], most[32];
    fputs(kind_name(row), file);
    unit_print(file, row);
    const bool has_range = row->kind == FIELD_KIND_REAL || row->kind == FIELD_KIND_COUNT ||
                           row->kind == FIELD_KIND_REALS || row->kind == FIELD_KIND_ROWS;
    if (has_range && isfinite(row->range.min) && isfinite(row->range.max))
        fprintf(file, ", %s to %s", text_real(least, row->range.min),
                text_real(most, row->range.max));
    else if (has_range && isfinite(row->range.min))
        fprintf(file, ", %s %s", row->range.is_open_below ? "above" : "at least",
                text_real(least, row->range.min));
    for (size_t i = 0; row->choices != NULL && row->choices[i] != NULL; i++) {
        fputs(i > 0 ? ", " : ": ", file);
        escaped(file, row->choices[i], false);
    }
    if (row->presence == PRESENCE_REQUIRED)
        fputs("; required", file);
    else if (row->presence == PRESENCE_DEFAULT && row->kind == FIELD_KIND_CHOICE)
        fprintf(file, "; default %s", row->choices[(int)row->initial]);
    else if (row->presence == PRESENCE_DEFAULT &&
             (row->kind == FIELD_KIND_REAL || row->kind == FIELD_KIND_COUNT))
        fprintf(file, "; default %s", text_real(least, row->initial));
}

static void rows_print(FILE *file, const Field *fields, const char *place) {
    char inner[256];
    for (const Field *row = fields; row != NULL && row->kind != FIELD_KIND_END; row++) {
        if (row->kind == FIELD_KIND_BASE) {
            rows_print(file, row->fields, place);
            continue;
        }
        if ((row->flags & FIELD_HIDDEN) != 0)
            continue;
        snprintf(inner, sizeof inner, "%s%s%s%s", place, place[0] != '\0' ? "." : "", row->name,
                 row->kind == FIELD_KIND_LIST ? "[]" : "");
        fputs(".TP\n.B ", file);
        escaped(file, inner, false);
        fputc('\n', file);
        nature_print(file, row);
        fputs(".\n.br\n", file);
        escaped(file, row->doc != NULL ? row->doc : "", true);
        fputc('\n', file);
        if (row->fields != NULL)
            rows_print(file, row->fields, inner);
        for (size_t i = 0; row->kind == FIELD_KIND_VARIANT && row->kinds->at(i) != NULL; i++) {
            const Kind *kind = row->kinds->at(i);
            fputs(".TP\n.BI ", file);
            escaped(file, inner, false);
            fprintf(file, " \" with %s \" ", row->kinds->tag);
            fprintf(file, "\"%s\"\n", kind->name);
            escaped(file, kind->doc != NULL ? kind->doc : "", true);
            fputs(i == 0 && !row->kinds->is_named ? " (default)\n" : "\n", file);
            rows_print(file, kind->fields, inner);
        }
    }
}

static const char scene_front[] = ".SH NAME\n"
                                  "impactd\\-scene \\- JSON document that describes a simulation\n"
                                  ".SH DESCRIPTION\n"
                                  "Quantities are in SI units. Unknown members are faults; all "
                                  "faults are reported together. The\n"
                                  "server has the same as JSON Schema under /schemas/scene.\n"
                                  ".SH MEMBERS\n";
static const char scene_back[] =
    ".SH EXAMPLE\n"
    ".EX\n"
    "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},\n"
    " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],\n"
    " \"excitation\": {\"kind\": \"free\", \"displacement\": 0.015},\n"
    " \"duration\": 10, \"sample_rate\": 1000}\n"
    ".EE\n"
    ".SH SEE ALSO\n"
    ".BR impactd (1)\n";

static void manual_scene(FILE *file) {
    head(file, "IMPACTD\\-SCENE", "5");
    fputs(scene_front, file);
    rows_print(file, study_request_fields, "");
    fputs(scene_back, file);
}

// Parts of a result for `impactd get`.
static const char parts[] =
    "result series psd impacts energy manifest bundle job tradeoff ensemble compare sensitivity "
    "table calibration response optimum fragility";

static void names_print(FILE *file) {
    for (size_t i = 0; commands[i] != NULL; i++)
        fprintf(file, "%s%s", i > 0 ? " " : "", commands[i]->name);
}

// The kind of names that an operand is one of, for `impactd complete`; "file" or "file.json".
static const char *operand_names(const Command *command, char letter) {
    const bool is_scene = command->operands != NULL && strstr(command->operands, ".json") != NULL;
    return letter == 'i'                     ? "ids"
           : letter == 't'                   ? "records"
           : letter == 'p'                   ? "parts"
           : letter == 'f' || letter == '\0' ? is_scene ? "file.json" : "file"
                                             : "materials";
}

// Sets `kind` from the number of operands before the cursor and from the action.
static void completion_operands(FILE *file, const Command *command) {
    const char *operands = command->operands != NULL ? command->operands : "";
    const size_t length = strcspn(operands, " ");
    const ApiAction *action = command->actions;
    fputs("        [ -n \"$option\" ] || case $count.$action in\n", file);
    if (memchr(operands, '|', length) != NULL || (action != NULL && action->name != NULL)) {
        fputs("        0.*) words='", file);
        for (size_t i = 0; i < length && action == NULL; i++)
            fputc(operands[i] == '|' ? ' ' : operands[i], file);
        for (size_t i = 0; action != NULL && action[i].name != NULL; i++)
            fprintf(file, "%s ", action[i].name);
        fputs("' ;;\n", file);
    } else if (action == NULL && length > 0) {
        fprintf(file, "        0.*) kind=%s ;;\n",
                strstr(operands, "COMMAND") != NULL ? "commands"
                : strstr(operands, "NAME") != NULL  ? "examples"
                                                    : operand_names(command, '\0'));
    }
    for (; action != NULL; action = action->name != NULL ? action + 1 : NULL) {
        const bool is_alone = action == command->actions && action->name == NULL;
        if (action->name == NULL && !is_alone)
            break;
        for (size_t i = 0; api_operand_kind(action, i) != '\0'; i++)
            fprintf(file, "        %zu.%s) kind=%s ;;\n", is_alone ? i : i + 1,
                    is_alone ? "*" : action->name,
                    operand_names(command, api_operand_kind(action, i)));
    }
    fputs("        esac ;;\n", file);
}

// The words after an option that takes one of some texts, the options, and the operands.
static void completion_command(FILE *file, const Command *command) {
    char name[OPTION_NAME];
    fprintf(file, "    %s) options='--help", command->name);
    for (const Field *row = command->options; row != NULL && row->kind != FIELD_KIND_END; row++) {
        (void)option_spell(row, name);
        fprintf(file, " %s", name);
    }
    fputs("'\n        case $option in\n", file);
    for (const Field *row = command->options; row != NULL && row->kind != FIELD_KIND_END; row++) {
        const char letter = option_spell(row, name);
        if (row->kind == FIELD_KIND_FLAG)
            continue;
        fprintf(file, "        %s%s%.*s) kind=%s words='", name, letter != '\0' ? " | -" : "",
                letter != '\0' ? 1 : 0, &letter,
                strcmp(option_operand(row), "FILE") == 0 || strcmp(option_operand(row), "DIR") == 0
                    ? "file"
                    : "value");
        for (size_t i = 0; row->kind == FIELD_KIND_CHOICE && row->choices[i] != NULL; i++)
            fprintf(file, "%s ", row->choices[i]);
        for (size_t i = 0; strcmp(row->name, "solver") == 0 && solvers[i] != NULL; i++)
            if (solvers[i]->run != NULL) // not "auto"
                fprintf(file, "%s ", solvers[i]->kind.name);
        fputs("' ;;\n", file);
    }
    fputs("        esac\n", file);
    completion_operands(file, command);
}

// In bash, and in zsh after bashcompinit. The first pass over the words before the cursor counts
// operands: it needs to know which options take a value. Words may come from a server that is not
// trusted: they are never expanded (`compgen -W` would), and are quoted for the command line.
static void completion_bash(FILE *file) {
    fputs("# bash completion of impactd, printed from its tables.\n"
          "_impactd_command() {\n"
          "    kind= words=\n"
          "    case $1 in\n",
          file);
    for (size_t i = 0; commands[i] != NULL; i++)
        completion_command(file, commands[i]);
    fputs("    esac\n"
          "}\n"
          "_impactd() {\n"
          "    local kind= words= options= option= count=-1 action= word i\n"
          "    local cur=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]}\n"
          "    COMPREPLY=()\n"
          "    for ((i = 1; i < COMP_CWORD; i++)); do\n"
          "        word=${COMP_WORDS[i]}\n"
          "        if [ \"$word\" = = ]; then continue; fi\n"
          "        if [ -n \"$option\" ]; then option= && continue; fi\n"
          "        case $word in\n"
          "        -*) option=$word && _impactd_command \"$command\"\n"
          "            [ -n \"$kind\" ] || option= ;;\n"
          "        *) count=$((count + 1)) && [ \"$count\" -ne 1 ] || action=$word ;;\n"
          "        esac\n"
          "    done\n"
          "    [ \"$cur\" != = ] || cur=\n"
          "    _impactd_command \"$command\"\n"
          "    if [ \"$COMP_CWORD\" -eq 1 ]; then kind=commands words='--help --version'\n"
          "    elif [ -z \"$option\" ] && [ \"${cur:0:1}\" = - ]; then kind= words=$options; fi\n"
          "    case $kind in\n"
          "    '' | value) ;;\n"
          "    file) return ;;\n"
          "    file.*) while IFS= read -r word; do COMPREPLY+=(\"$word\"); done < <(\n"
          "            compgen -f -X \"!*.${kind#file.}\" -- \"$cur\"\n"
          "            compgen -d -S / -- \"$cur\")\n"
          "        compopt -o filenames 2>/dev/null\n"
          "        return ;;\n"
          "    parts) words='",
          file);
    fputs(parts, file);
    fputs("' ;;\n    commands) words=\"$words ", file);
    names_print(file);
    fputs("\" ;;\n"
          "    *) words=$(\"${COMP_WORDS[0]}\" complete \"$kind\" 2>/dev/null) ;;\n"
          "    esac\n"
          "    while IFS= read -r word; do\n"
          "        [ -z \"$word\" ] || [ \"${word:0:${#cur}}\" != \"$cur\" ] ||\n"
          "            COMPREPLY+=(\"$(printf %q \"$word\")\")\n"
          "    done < <(printf '%s\\n' \"$words\" | tr ' ' '\\n')\n"
          "}\n"
          "complete -o default -F _impactd impactd\n",
          file);
}

// --- parts of the guide, in Markdown ---

// Text in which no character is markup.
static void markdown_text(FILE *file, const char *text) {
    for (const char *c = text; *c != '\0'; c++) {
        if (strchr("\\`*_{}[]<>#|~&!", *c) != NULL)
            fputc('\\', file);
        fputc(*c, file);
    }
}

// A paragraph of one sentence, which has no capital and no point in the tables.
static void markdown_sentence(FILE *file, const char *text) {
    fputc(toupper((unsigned char)text[0]), file);
    markdown_text(file, text + (text[0] != '\0'));
    fputs(".\n\n", file);
}

// Blocks of indented lines are code: the first one has examples, others are JSON.
static void markdown_help(FILE *file, const char *help) {
    bool is_code = false;
    for (const char *at = help; *at != '\0'; at += strcspn(at, "\n") + 1) {
        char line[512];
        snprintf(line, sizeof line, "%.*s", (int)strcspn(at, "\n"), at);
        if (is_code && line[0] != ' ')
            fputs("```\n", file);
        if (!is_code && line[0] == ' ')
            fputs(at == help ? "```sh not-run\n" : "```json fragment\n", file);
        is_code = line[0] == ' ';
        if (is_code)
            fputs(line + 2, file);
        else
            markdown_text(file, line);
        fputc('\n', file);
    }
    fputs(is_code ? "```\n\n" : "\n", file);
}

static void markdown_option(FILE *file, const Field *row) {
    char name[OPTION_NAME];
    const char letter = option_spell(row, name);
    fputs("| ", file);
    if (letter != '\0')
        fprintf(file, "`-%c`, ", letter);
    fprintf(file, "`%s", name);
    if (row->kind == FIELD_KIND_CHOICE)
        for (size_t i = 0; row->choices[i] != NULL; i++)
            fprintf(file, "%s%s", i > 0 ? "\\|" : " ", row->choices[i]);
    else if (option_operand(row) != NULL)
        fprintf(file, " %s", option_operand(row));
    fputs("` | ", file);
    markdown_text(file, row->doc);
    if (row->unit != NULL) {
        fputs(" [", file);
        markdown_text(file, row->unit);
        fputs("]", file);
    }
    fputs(" |\n", file);
}

// Tables of the options, one below each heading.
static void markdown_options(FILE *file, const Command *command) {
    const OptionGroup *group = command->groups;
    for (const Field *row = command->options; row != NULL && row->kind != FIELD_KIND_END; row++) {
        const bool is_first =
            group != NULL && group->first != NULL && strcmp(group->first, row->name) == 0;
        if (is_first)
            fprintf(file, "\n**%s**\n", group++->title);
        if (is_first || row == command->options)
            fputs("\n| option | meaning |\n|---|---|\n", file);
        markdown_option(file, row);
    }
    fputc('\n', file);
}

static void part_commands(FILE *file) {
    const OptionGroup *group = command_groups;
    for (size_t i = 0; commands[i] != NULL; i++) {
        const Command *command = commands[i];
        if (group->first != NULL && strcmp(group->first, command->name) == 0)
            fprintf(file, "## %s\n\n", group++->title);
        fprintf(file, "### impactd %s\n\n", command->name);
        markdown_sentence(file, command->summary);
        fprintf(file, "```\nimpactd %s%s%s%s\n```\n\n", command->name,
                command->options != NULL ? " [OPTION]..." : "",
                command->operands != NULL ? " " : "",
                command->operands != NULL ? command->operands : "");
        markdown_help(file, command->help);
        markdown_options(file, command);
    }
}

// All calls of the API with their scopes.
static void part_paths(FILE *file) {
    fputs("| call | scope | meaning |\n|---|---|---|\n", file);
    for (const Route *route = routes; route->method != NULL; route++) {
        fprintf(file, "| [%s %s](#", route->method, route->pattern);
        for (const char *c = route->method; *c != '\0'; c++)
            fputc(tolower((unsigned char)*c), file);
        fputc('-', file);
        for (const char *c = route->pattern; *c != '\0'; c++)
            if (strchr("/{}@.", *c) == NULL)
                fputc(*c, file);
        fprintf(file, ") | %s | ", route->scope);
        markdown_text(file, route->doc);
        fputs(" |\n", file);
    }
}

static const struct {
    const char *name;
    void (*print)(FILE *file);
} pages[] = {
    {"impactd.1", manual_program},     {"impactd-scene.5", manual_scene},
    {"impactd.bash", completion_bash}, {"commands.md", part_commands},
    {"paths.md", part_paths},
};

// Writes one page, or that of a command.
static bool page_write(const char *folder, const char *name, void (*print)(FILE *file),
                       const Command *command) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s%s%s", folder, name, command != NULL ? command->name : "",
             command != NULL ? ".1" : "");
    FILE *file = fopen(path, "w");
    if (file != NULL && command != NULL)
        manual_command(file, command);
    else if (file != NULL)
        print(file);
    const bool is_written = file != NULL && fclose(file) == 0;
    if (!is_written)
        perror(path);
    return is_written;
}

int main(int argc, char **argv) {
    bool is_written = argc == 2;
    for (size_t i = 0; is_written && i < COUNT(pages); i++)
        is_written = page_write(argv[1], pages[i].name, pages[i].print, NULL);
    for (size_t i = 0; is_written && commands[i] != NULL; i++)
        is_written = page_write(argv[1], "impactd-", NULL, commands[i]);
    return argc != 2 ? 2 : is_written ? 0 : 1;
}
