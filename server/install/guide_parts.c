#include "server/install/guide_parts.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "core/study/study.h"
#include "server/cli/command.h"
#include "server/http/router.h"

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

void nature_write(const Field *row, Bytes *bytes) {
    char least[32], most[32];
    bytes_text(bytes, kind_name(row));
    if (row->unit != NULL)
        bytes_format(bytes, " [%s]", row->unit);
    const bool has_range = row->kind == FIELD_KIND_REAL || row->kind == FIELD_KIND_COUNT ||
                           row->kind == FIELD_KIND_REALS || row->kind == FIELD_KIND_ROWS;
    if (has_range && isfinite(row->range.min) && isfinite(row->range.max))
        bytes_format(bytes, ", %s to %s", text_real(least, row->range.min),
                     text_real(most, row->range.max));
    else if (has_range && isfinite(row->range.min))
        bytes_format(bytes, ", %s %s", row->range.is_open_below ? "above" : "at least",
                     text_real(least, row->range.min));
    for (size_t i = 0; row->choices != NULL && row->choices[i] != NULL; i++)
        bytes_format(bytes, "%s%s", i > 0 ? ", " : ": ", row->choices[i]);
}

void default_write(const Field *row, Bytes *bytes) {
    char text[32];
    if (row->presence == PRESENCE_REQUIRED)
        bytes_text(bytes, "required");
    else if (row->presence == PRESENCE_DEFAULT && row->kind == FIELD_KIND_CHOICE)
        bytes_text(bytes, row->choices[(int)row->initial]);
    else if (row->presence == PRESENCE_DEFAULT &&
             (row->kind == FIELD_KIND_REAL || row->kind == FIELD_KIND_COUNT))
        bytes_text(bytes, text_real(text, row->initial));
}

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

void part_commands(FILE *file) {
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

// The section of the members of a scene that have members themselves is named by their place:
// "dampers: buffer". Places with the same table share the section of the first.
enum { PART_PLACES = 400, PART_NAME = 160 };
static struct {
    const void *table; // Field or KindTable
    char name[PART_NAME];
} part_places[PART_PLACES];

static void place_join(const char *place, const char *member, char name[PART_NAME]) {
    text_fit(name, PART_NAME, place);
    const size_t used = strlen(name);
    snprintf(name + used, PART_NAME - used, "%s%s", used > 0 ? ": " : "", member);
}

// The name of the section of a table; *is_new: it is this place's.
static const char *place_name(const void *table, const char *place, const char *member,
                              bool is_kinds, bool *is_new) {
    size_t i = 0;
    while (i + 1 < PART_PLACES && part_places[i].table != NULL && part_places[i].table != table)
        i++;
    char name[PART_NAME];
    if (place[0] != '\0')
        place_join(place, member, name);
    else
        place_join(member, is_kinds ? "kinds" : "members", name);
    if (part_places[i].table == NULL) {
        part_places[i].table = table;
        memcpy(part_places[i].name, name, sizeof name);
    }
    *is_new = strcmp(part_places[i].name, name) == 0;
    return part_places[i].name;
}

static void part_link(FILE *file, const char *text, const char *name) {
    fprintf(file, "[%s](#", text);
    for (const char *c = name; *c != '\0'; c++)
        if (*c != ':')
            fputc(*c == ' ' ? '-' : *c, file);
    fputs(")", file);
}

static void part_rows(FILE *file, const Field *fields, const char *place) {
    bool is_new;
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        if (row->kind == FIELD_KIND_BASE)
            part_rows(file, row->fields, place);
        if (row->kind == FIELD_KIND_BASE || (row->flags & FIELD_HIDDEN) != 0)
            continue;
        const void *table = row->kinds != NULL ? (const void *)row->kinds : row->fields;
        Bytes nature = {.most = 0}, initial = {.most = 0};
        nature_write(row, &nature);
        default_write(row, &initial);
        fprintf(file, "| `%s` | ", row->name);
        if (table != NULL)
            part_link(file, nature.at,
                      place_name(table, place, row->name, row->kinds != NULL, &is_new));
        else
            markdown_text(file, nature.at);
        if (row->shorthand != NULL)
            fprintf(file, ", or its `%s` alone", row->shorthand);
        fputs(" | ", file);
        markdown_text(file, initial.count > 0 ? initial.at : "");
        fputs(" | ", file);
        markdown_text(file, row->doc != NULL ? row->doc : "");
        fputs(" |\n", file);
        bytes_clear(&nature);
        bytes_clear(&initial);
    }
}

static void part_heading(FILE *file, int level, const char *name, const char *doc) {
    fprintf(file, "%.*s %s\n\n", level, "######", name);
    if (doc != NULL)
        markdown_sentence(file, doc);
}

static void part_members(FILE *file, const Field *fields, const char *place, int level);

static void part_kinds(FILE *file, const KindTable *kinds, const char *place, int level) {
    bool is_shared = true;
    for (size_t i = 0; kinds->at(i) != NULL; i++)
        is_shared = is_shared && kinds->at(i)->fields == kinds->at(0)->fields;
    fprintf(file, "| %s | meaning |\n|---|---|\n", kinds->tag);
    for (size_t i = 0; kinds->at(i) != NULL; i++) {
        const Kind *kind = kinds->at(i);
        char name[PART_NAME];
        place_join(place, kind->name, name);
        fputs("| ", file);
        if (is_shared)
            fprintf(file, "`%s`", kind->name);
        else
            part_link(file, kind->name, name);
        fputs(" | ", file);
        markdown_text(file, kind->doc);
        fputs(i == 0 && !kinds->is_named ? " (default) |\n" : " |\n", file);
    }
    fputc('\n', file);
    if (is_shared) {
        part_members(file, kinds->at(0)->fields, place, level);
        return;
    }
    for (size_t i = 0; kinds->at(i) != NULL; i++) {
        char name[PART_NAME];
        place_join(place, kinds->at(i)->name, name);
        part_heading(file, level + 1, name, kinds->at(i)->doc);
        part_members(file, kinds->at(i)->fields, name, level + 1);
    }
}

// The sections of the members that have members.
static void part_sections(FILE *file, const Field *fields, const char *place, int level) {
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        const void *table = row->kinds != NULL ? (const void *)row->kinds : row->fields;
        if (row->kind == FIELD_KIND_BASE)
            part_sections(file, row->fields, place, level);
        if (row->kind == FIELD_KIND_BASE || (row->flags & FIELD_HIDDEN) != 0 || table == NULL)
            continue;
        char inner[PART_NAME];
        place_join(place, row->name, inner);
        bool is_new;
        const char *name = place_name(table, place, row->name, row->kinds != NULL, &is_new);
        if (!is_new)
            continue;
        part_heading(file, level, name, row->doc);
        if (row->kinds != NULL)
            part_kinds(file, row->kinds, inner, level);
        else
            part_members(file, row->fields, inner, level);
    }
}

static void part_members(FILE *file, const Field *fields, const char *place, int level) {
    if (fields == NULL || fields->kind == FIELD_KIND_END)
        return;
    fputs("| member | type | default | meaning |\n|---|---|---|---|\n", file);
    part_rows(file, fields, place);
    fputc('\n', file);
    part_sections(file, fields, place, level < 6 && place[0] != '\0' ? level + 1 : level);
}

void part_scene(FILE *file) {
    part_heading(file, 2, "All members", NULL);
    part_members(file, study_request_fields, "", 2);
}

void part_paths(FILE *file) {
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
