// man(7) source. Text from the tables is escaped: a backslash, and a point or quote that begins a
// line, mean something there.
#include <math.h>
#include <string.h>

#include "core/base/field.h"
#include "core/study/study.h"
#include "server/api/app.h"
#include "server/cli/command.h"
#include "server/install/pages.h"
#include "server/options.h"

static void escaped(FILE *file, const char *text, bool is_line_start) {
    if (is_line_start && (*text == '.' || *text == '\''))
        fputs("\\&", file);
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '\\')
            fputs("\\e", file);
        else if (*c == '-')
            fputs("\\-", file);
        else if (*c == '\'')
            fputs("\\(aq", file);
        else if (*c == '^')
            fputs("\\(ha", file);
        else if (*c == '~')
            fputs("\\(ti", file);
        else
            fputc(*c, file);
        if (*c == '\n' && (c[1] == '.' || c[1] == '\''))
            fputs("\\&", file);
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

static void option_print(FILE *file, const Field *fields, const Field *row) {
    char name[OPTION_NAME];
    const char letter = option_spell(fields, row, name);
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
    } else if (row->kind != FIELD_KIND_FLAG) {
        fputs(row->kind == FIELD_KIND_COUNT  ? " \\fIN\\fR"
              : row->kind == FIELD_KIND_REAL ? " \\fIX\\fR"
                                             : " \\fITEXT\\fR",
              file);
    }
    fputc('\n', file);
    escaped(file, row->doc, true);
    unit_print(file, row);
    fputc('\n', file);
}

// The examples a command's help begins with stand as they are typed; what follows is prose.
static void help_print(FILE *file, const char *help) {
    fputs(".PP\n.EX\n", file);
    char line[512];
    bool is_example = true;
    for (const char *at = help; *at != '\0';) {
        const size_t length = strcspn(at, "\n");
        snprintf(line, sizeof line, "%.*s", (int)length, at);
        at += length + (at[length] != '\0');
        if (length == 0) {
            if (is_example)
                fputs(".EE\n", file);
            fputs(*at != '\0' ? ".PP\n" : "", file);
            is_example = false;
            continue;
        }
        escaped(file, line, true);
        fputc('\n', file);
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
    "A free mass inside a structure that swings bounces between two stops and takes energy out of\n"
    "the motion. A scene, written in JSON, describes structure, masses, stops and excitation, see\n"
    ".BR impactd\\-scene (5);\n"
    "what comes back is the motion, every single impact, spectra and an energy balance. Commands\n"
    "work alone or ask a daemon, which is one of them.\n"
    ".SH COMMANDS\n";

static const char back[] =
    ".SH EXIT STATUS\n"
    ".TP\n0\nok\n.TP\n1\nthe job failed\n.TP\n2\nusage\n.TP\n3\nbad scene\n.TP\n4\nnot found\n"
    ".TP\n5\nnot allowed\n.TP\n7\nthe server cannot be reached, or is too busy\n"
    ".TP\n8\ntimed out while the job goes on\n.TP\n130\ninterrupted\n"
    ".SH ENVIRONMENT\n"
    ".TP\n.B IMPACTD_SERVER\nURL of the daemon that materials, submit, watch, get, cancel and "
    "compare ask.\n"
    ".TP\n.BR IMPACTD_TOKEN , \" IMPACTD_TOKEN_FILE\"\nThe bearer token they send, or a file with "
    "it that nobody else can read.\n"
    ".TP\n.B IMPACTD_CA_FILE\nCertificates they trust.\n"
    ".TP\n.BI IMPACTD_ NAME\nA setting of\n.BR \"impactd serve\" :\nIMPACTD_MAX_BODY is "
    "\\-\\-max\\-body.\n"
    ".SH FILES\n"
    ".TP\n.I $XDG_STATE_HOME/impactd\nThe daemon\\(aqs database, where \\-\\-data names no other "
    "folder; else under\n.IR \\(ti/.local/state .\n"
    ".TP\n.I /etc/default/impactd\nSettings of the system\\(aqs daemon, one IMPACTD_NAME=VALUE a "
    "line.\n"
    ".SH SEE ALSO\n"
    ".BR impactd\\-scene (5),\n.BR impactd.service (8)\n";

void manual_program(FILE *file) {
    head(file, "IMPACTD", "1");
    fputs(front, file);
    for (size_t i = 0; commands[i] != NULL; i++) {
        const Command *command = commands[i];
        fprintf(file, ".SS \"impactd %s%s%s\"\n", command->name,
                command->operands != NULL ? " " : "",
                command->operands != NULL ? command->operands : "");
        escaped(file, command->summary, true);
        fputs(".\n", file);
        help_print(file, command->help);
        for (const Field *row = command->options; row != NULL && row->kind != FIELD_KIND_END; row++)
            option_print(file, command->options, row);
    }
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
            fputs(i == 0 && !row->kinds->is_named ? " (taken where none is named)\n" : "\n", file);
            rows_print(file, kind->fields, inner);
        }
    }
}

static const char scene_front[] =
    ".SH NAME\n"
    "impactd\\-scene \\- what impactd simulates, as a JSON document\n"
    ".SH DESCRIPTION\n"
    "SI units. Unknown members are faults; all faults of a document are told at once. The same is\n"
    "printed as JSON Schema by the daemon under /schemas/scene.\n"
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

void manual_scene(FILE *file) {
    head(file, "IMPACTD\\-SCENE", "5");
    fputs(scene_front, file);
    rows_print(file, study_request_fields, "");
    fputs(scene_back, file);
}
