// Rows to JSON Schema: every row becomes a property, in table order, so the same table prints the
// same bytes.
#include "server/json/schema.h"

#include <stdio.h>

#include "core/scene/material.h"
#include "core/study/study.h"
#include "server/json/material_bodies.h"

// clang-format off
const SchemaDocument schema_documents[] = {
    {"scene", "A scene: what impactd is asked to simulate", study_request_fields},
    {"material", "A buffer material: what one revision of it says", material_fields},
    {"new_material", "A new material: its first revision", new_material_fields},
    {"material_revision", "A new revision of a material: all that it says, and why", material_revision_fields},
    {"material_revert", "A revision to say again", material_revert_fields},
    {"material_review", "What becomes of a revision", material_review_fields},
    {"measurement", "A drop test as it was done: raw data", measurement_body_fields},
    {NULL, NULL, NULL},
};
// clang-format on

// Where the text stands: inside how many brackets, and whether the innermost one has a member yet.
typedef struct Printer {
    Bytes *bytes;
    int depth;
    bool has_member;
} Printer;

static void begin_line(Printer *printer) {
    bytes_text(printer->bytes, printer->has_member ? ",\n" : "\n");
    for (int i = 0; i < printer->depth; i++)
        bytes_text(printer->bytes, "  ");
    printer->has_member = true;
}

static void open_bracket(Printer *printer, const char *bracket) {
    bytes_text(printer->bytes, bracket);
    printer->depth++;
    printer->has_member = false;
}

static void close_bracket(Printer *printer, const char *bracket) {
    printer->depth--;
    if (printer->has_member) {
        printer->has_member = false;
        begin_line(printer);
    }
    bytes_text(printer->bytes, bracket);
    printer->has_member = true;
}

static void name_member(Printer *printer, const char *name) {
    begin_line(printer);
    bytes_json_string(printer->bytes, name);
    bytes_text(printer->bytes, ": ");
}

static void open_member(Printer *printer, const char *name, const char *bracket) {
    name_member(printer, name);
    open_bracket(printer, bracket);
}

static void text_member(Printer *printer, const char *name, const char *text) {
    name_member(printer, name);
    bytes_json_string(printer->bytes, text);
}

static void word_member(Printer *printer, const char *name, const char *word) {
    name_member(printer, name);
    bytes_text(printer->bytes, word);
}

static void real_member(Printer *printer, const char *name, double value) {
    name_member(printer, name);
    bytes_real(printer->bytes, value);
}

static void count_member(Printer *printer, const char *name, size_t value) {
    name_member(printer, name);
    bytes_format(printer->bytes, "%zu", value);
}

static void texts_member(Printer *printer, const char *name, const char *const *texts) {
    name_member(printer, name);
    bytes_text(printer->bytes, "[");
    for (size_t i = 0; texts != NULL && texts[i] != NULL; i++) {
        bytes_text(printer->bytes, i > 0 ? ", " : "");
        bytes_json_string(printer->bytes, texts[i]);
    }
    bytes_text(printer->bytes, "]");
}

static void print_object(Printer *printer, const Field *fields, const KindTable *kinds,
                         const Kind *kind);

static void print_range(Printer *printer, const Range *range) {
    if (!isinf(range->min))
        real_member(printer, range->is_open_below ? "exclusiveMinimum" : "minimum", range->min);
    if (!isinf(range->max))
        real_member(printer, "maximum", range->max);
}

static void print_length(Printer *printer, const Field *field) {
    if (field->presence == PRESENCE_REQUIRED)
        count_member(printer, "minItems", 1);
    if (field->max > 0)
        count_member(printer, "maxItems", field->max);
}

// A count is never negative, whatever its row says.
static Range count_range(const Field *field) {
    Range range = field->range;
    if (range.min < 0)
        range = (Range){0, range.max, false};
    return range;
}

// A text of the choices, or one with a number.
static void print_choices(Printer *printer, const Field *field) {
    if (field->choices == NULL)
        return;
    if ((field->flags & FIELD_NUMBERED) == 0) {
        texts_member(printer, "enum", field->choices);
        return;
    }
    name_member(printer, "pattern");
    bytes_text(printer->bytes, "\"^(");
    for (size_t i = 0; field->choices[i] != NULL; i++)
        bytes_format(printer->bytes, "%s%s", i > 0 ? "|" : "", field->choices[i]);
    bytes_text(printer->bytes, ")(_[1-9][0-9]*)?$\"");
}

static void print_reals(Printer *printer, const Field *field) {
    text_member(printer, "type", "array");
    open_member(printer, "items", "{");
    text_member(printer, "type", "number");
    print_range(printer, &field->range);
    close_bracket(printer, "}");
    print_length(printer, field);
}

static void print_lone(Printer *printer, const Field *field) {
    open_member(printer, "anyOf", "[");
    begin_line(printer);
    open_bracket(printer, "{");
    text_member(printer, "type", "number");
    print_range(printer, &field->range);
    close_bracket(printer, "}");
    begin_line(printer);
    open_bracket(printer, "{");
    print_reals(printer, field);
    close_bracket(printer, "}");
    close_bracket(printer, "]");
}

static void print_texts(Printer *printer, const Field *field) {
    const bool has_pairs = (field->flags & FIELD_PAIRS) != 0;
    if (has_pairs) {
        open_member(printer, "anyOf", "[");
        begin_line(printer);
        open_bracket(printer, "{");
    }
    text_member(printer, "type", "array");
    open_member(printer, "items", "{");
    if ((field->flags & FIELD_SCALARS) != 0)
        word_member(printer, "type", "[\"number\", \"string\", \"boolean\"]");
    else
        text_member(printer, "type", "string");
    print_choices(printer, field);
    close_bracket(printer, "}");
    print_length(printer, field);
    if (has_pairs) {
        close_bracket(printer, "}");
        begin_line(printer);
        open_bracket(printer, "{");
        text_member(printer, "type", "object");
        open_member(printer, "additionalProperties", "{");
        text_member(printer, "type", "string");
        close_bracket(printer, "}");
        if (field->max > 0)
            count_member(printer, "maxProperties", field->max);
        close_bracket(printer, "}");
        close_bracket(printer, "]");
    }
    if (field->presence == PRESENCE_DEFAULT)
        texts_member(printer, "default", field->initial_texts);
}

// An object, or in its place a string (of the row it stands for) or null.
static void print_item(Printer *printer, const Field *field) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    if (field->shorthand == NULL && !takes_null) {
        print_object(printer, field->fields, NULL, NULL);
        return;
    }
    open_member(printer, "anyOf", "[");
    begin_line(printer);
    open_bracket(printer, "{");
    print_object(printer, field->fields, NULL, NULL);
    close_bracket(printer, "}");
    if (field->shorthand != NULL) {
        const Field *row = fields_find(field->fields, field->shorthand, NULL);
        begin_line(printer);
        open_bracket(printer, "{");
        text_member(printer, "type", "string");
        if (row->max > 0)
            count_member(printer, "maxLength", row->max);
        text_member(printer, "description", row->doc);
        close_bracket(printer, "}");
    }
    if (takes_null) {
        begin_line(printer);
        open_bracket(printer, "{");
        text_member(printer, "type", "null");
        close_bracket(printer, "}");
    }
    close_bracket(printer, "]");
}

// One schema per kind. Only a default kind may stand without its tag, so exactly one of them fits.
static void print_variant(Printer *printer, const Field *field) {
    open_member(printer, "oneOf", "[");
    const Kind *kind;
    for (size_t i = 0; (kind = field->kinds->at(i)) != NULL; i++) {
        begin_line(printer);
        open_bracket(printer, "{");
        text_member(printer, "title", kind->name);
        text_member(printer, "description", kind->doc);
        print_object(printer, kind->fields, field->kinds, kind);
        close_bracket(printer, "}");
    }
    close_bracket(printer, "]");
    if (field->presence == PRESENCE_DEFAULT) {
        open_member(printer, "default", "{");
        text_member(printer, field->kinds->tag, field->kinds->at(0)->name);
        close_bracket(printer, "}");
    }
}

static void print_value(Printer *printer, const Field *field) {
    const bool has_default = field->presence == PRESENCE_DEFAULT;
    Range range;
    switch (field->kind) {
    case FIELD_KIND_REAL:
        text_member(printer, "type", "number");
        print_range(printer, &field->range);
        if (has_default)
            real_member(printer, "default", field->initial);
        break;
    case FIELD_KIND_COUNT:
        text_member(printer, "type", "integer");
        range = count_range(field);
        print_range(printer, &range);
        if (has_default)
            real_member(printer, "default", field->initial);
        break;
    case FIELD_KIND_FLAG:
        text_member(printer, "type", "boolean");
        if (has_default)
            word_member(printer, "default", field->initial != 0 ? "true" : "false");
        break;
    case FIELD_KIND_TEXT:
        text_member(printer, "type", "string");
        if (field->max > 0)
            count_member(printer, "maxLength", field->max);
        break;
    case FIELD_KIND_CHOICE:
        texts_member(printer, "enum", field->choices);
        if (has_default)
            text_member(printer, "default", field->choices[(int)field->initial]);
        break;
    case FIELD_KIND_REALS:
        if ((field->flags & FIELD_LONE) != 0)
            print_lone(printer, field);
        else
            print_reals(printer, field);
        break;
    case FIELD_KIND_ROWS:
        text_member(printer, "type", "array");
        open_member(printer, "items", "{");
        print_reals(printer, field);
        close_bracket(printer, "}");
        print_length(printer, field);
        break;
    case FIELD_KIND_TEXTS:
        print_texts(printer, field);
        break;
    case FIELD_KIND_ITEM:
        print_item(printer, field);
        if (has_default)
            word_member(printer, "default", "{}");
        break;
    case FIELD_KIND_LIST:
        text_member(printer, "type", "array");
        open_member(printer, "items", "{");
        print_object(printer, field->fields, NULL, NULL);
        close_bracket(printer, "}");
        print_length(printer, field);
        if (has_default)
            word_member(printer, "default", "[]");
        break;
    case FIELD_KIND_VARIANT:
        print_variant(printer, field);
        break;
    case FIELD_KIND_BASE:
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
}

static void print_properties(Printer *printer, const Field *fields) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE) {
            print_properties(printer, field->fields);
            continue;
        }
        if ((field->flags & FIELD_HIDDEN) != 0)
            continue;
        open_member(printer, field->name, "{");
        if (field->doc != NULL)
            text_member(printer, "description", field->doc);
        print_value(printer, field);
        if (field->unit != NULL)
            text_member(printer, "x-unit", field->unit);
        close_bracket(printer, "}");
    }
}

static void print_required(Printer *printer, const Field *fields, size_t *count) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE) {
            print_required(printer, field->fields, count);
        } else if (field->presence == PRESENCE_REQUIRED) {
            bytes_text(printer->bytes, (*count)++ > 0 ? ", " : "");
            bytes_json_string(printer->bytes, field->name);
        }
    }
}

// The members of an object's schema; `kind` is NULL for a plain object, else one of `kinds`, named
// by their tag.
static void print_object(Printer *printer, const Field *fields, const KindTable *kinds,
                         const Kind *kind) {
    text_member(printer, "type", "object");
    open_member(printer, "properties", "{");
    if (kind != NULL) {
        open_member(printer, kinds->tag, "{");
        text_member(printer, "const", kind->name);
        close_bracket(printer, "}");
    }
    print_properties(printer, fields);
    close_bracket(printer, "}");
    name_member(printer, "required");
    bytes_text(printer->bytes, "[");
    size_t count = 0;
    if (kind != NULL && (kinds->is_named || kind != kinds->at(0))) {
        bytes_json_string(printer->bytes, kinds->tag);
        count++;
    }
    print_required(printer, fields, &count);
    bytes_text(printer->bytes, "]");
    word_member(printer, "additionalProperties", "false");
}

void schema_write(Bytes *bytes, const char *id, const char *title, const Field *fields) {
    Printer printer = {.bytes = bytes};
    open_bracket(&printer, "{");
    text_member(&printer, "$schema", "https://json-schema.org/draft/2020-12/schema");
    text_member(&printer, "$id", id);
    text_member(&printer, "title", title);
    print_object(&printer, fields, NULL, NULL);
    close_bracket(&printer, "}");
    bytes_text(bytes, "\n");
}

void schema_write_document(Bytes *bytes, const SchemaDocument *document) {
    char id[64];
    snprintf(id, sizeof id, "/schemas/%s", document->name);
    schema_write(bytes, id, document->title, document->fields);
}
