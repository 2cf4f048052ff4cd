// Every row becomes a property, in the order of the table. The schema is written without layout and
// with a comma in front of each member; schema_indent drops the first commas and indents.
#include "server/json/schema.h"

#include "core/study/study.h"

enum { COMMENT_MAX = 2000 };

// clang-format off
const char *const material_verdicts[] = {"approved", "deprecated", NULL};

const Field new_material_fields[] = {
    FIELD_TEXT(MaterialBody, slug, MATERIAL_SLUG_MAX, PRESENCE_REQUIRED, 0, "its name in scenes, [a-z0-9_-]+; it cannot be changed later"),
    FIELD_BASE(MaterialBody, material, material_fields),
    FIELD_TEXT(MaterialBody, comment, COMMENT_MAX, PRESENCE_OPTIONAL, 0, "why it was added; \"new material\" by default"),
    FIELD_END
};

const Field material_revision_fields[] = {
    FIELD_BASE(MaterialBody, material, material_fields),
    FIELD_TEXT(MaterialBody, comment, COMMENT_MAX, PRESENCE_REQUIRED, 0, "what was changed, and why"),
    FIELD_END
};

const Field material_revert_fields[] = {
    FIELD_COUNT(MaterialRevertBody, to, NULL, WITHIN(1, 9007199254740992.0), REQUIRED, "revision whose contents the new one repeats"),
    FIELD_TEXT(MaterialRevertBody, comment, COMMENT_MAX, PRESENCE_REQUIRED, 0, "why the later revisions are undone"),
    FIELD_END
};

const Field material_review_fields[] = {
    FIELD_CHOICE(MaterialReviewBody, status, material_verdicts, REQUIRED, "verdict on the revision"),
    FIELD_TEXT(MaterialReviewBody, reason, COMMENT_MAX, PRESENCE_REQUIRED, 0, "reason of the verdict"),
    FIELD_END
};

const Field measurement_body_fields[] = {
    FIELD_BASE(MeasurementBody, test, drop_test_fields),
    FIELD_TEXT(MeasurementBody, comment, COMMENT_MAX, PRESENCE_OPTIONAL, 0, "purpose of the test; \"drop test\" by default"),
    FIELD_END
};

const SchemaDocument schema_documents[] = {
    {"scene", "A scene: the simulation that a job requests", study_request_fields, NULL},
    {"material", "A buffer material: the contents of one revision", material_fields, NULL},
    {"new_material", "A new material: its first revision", new_material_fields, NULL},
    {"material_revision", "A new revision of a material: its whole contents, and why", material_revision_fields, NULL},
    {"material_revert", "A revision to repeat", material_revert_fields, NULL},
    {"material_review", "A review of a revision", material_review_fields, NULL},
    {"measurement", "A drop test: its raw data", measurement_body_fields, NULL},
    {"tradeoff", "Answer of the study tradeoff", NULL, &study_tradeoff},
    {"ensemble", "Answer of the study ensemble", NULL, &study_ensemble},
    {"compare", "Answer of the study compare", NULL, &study_compare},
    {"sensitivity", "Answer of the study sensitivity", NULL, &study_sensitivity},
    {"fragility", "Answer of the study fragility", NULL, &study_fragility},
    {"calibrate", "Answer of the study calibrate", NULL, &study_calibrate},
    {"optimize", "Answer of the study optimize", NULL, &study_optimize},
    {"response", "Answer of the study response", NULL, &study_response},
    {NULL, NULL, NULL, NULL},
};
// clang-format on

// A document that is read: members that are required, ranges, defaults. One that is written: all
// members are there, and null where they are unknown.
typedef enum SchemaUse { SCHEMA_READ, SCHEMA_WRITTEN } SchemaUse;

static void schema_object(Bytes *bytes, SchemaUse use, const Field *fields, const KindTable *kinds,
                          const Kind *kind);

static void schema_text(Bytes *bytes, const char *name, const char *text) {
    bytes_json(bytes, ",\"%s\":%s", name, text);
}

static void schema_real(Bytes *bytes, const char *name, double value) {
    bytes_json(bytes, ",\"%s\":%g", name, value);
}

static void schema_texts(Bytes *bytes, const char *name, const char *const *texts) {
    bytes_format(bytes, ",\"%s\":[", name);
    for (size_t i = 0; texts != NULL && texts[i] != NULL; i++)
        bytes_json(bytes, ",%s", texts[i]);
    bytes_text(bytes, "]");
}

// A count is never negative, also where its row allows it.
static void schema_number(Bytes *bytes, SchemaUse use, const Field *field) {
    const bool is_count = field->kind == FIELD_KIND_COUNT;
    const Range *range = &field->range;
    const double min = is_count ? fmax(range->min, 0) : range->min;
    bytes_format(bytes, ",\"type\":\"%s\"", is_count ? "integer" : "number");
    if (use == SCHEMA_WRITTEN) // what was computed has no limits
        return;
    if (!isinf(min))
        schema_real(
            bytes, range->is_open_below && min == range->min ? "exclusiveMinimum" : "minimum", min);
    if (!isinf(range->max))
        schema_real(bytes, "maximum", range->max);
}

static void schema_length(Bytes *bytes, const Field *field) {
    if (field->presence == PRESENCE_REQUIRED)
        bytes_text(bytes, ",\"minItems\":1");
    if (field->max > 0)
        bytes_format(bytes, ",\"maxItems\":%zu", field->max);
}

// One of the choices; FIELD_NUMBERED allows a number behind it.
static void schema_choices(Bytes *bytes, const Field *field) {
    if (field->choices == NULL)
        return;
    if ((field->flags & FIELD_NUMBERED) == 0) {
        schema_texts(bytes, "enum", field->choices);
        return;
    }
    bytes_text(bytes, ",\"pattern\":\"^(");
    for (size_t i = 0; field->choices[i] != NULL; i++)
        bytes_format(bytes, "%s%s", i > 0 ? "|" : "", field->choices[i]);
    bytes_text(bytes, ")(_[1-9][0-9]*)?$\"");
}

static void schema_reals(Bytes *bytes, SchemaUse use, const Field *field) {
    bytes_text(bytes, ",\"type\":\"array\",\"items\":{");
    if (use == SCHEMA_WRITTEN)
        bytes_text(bytes, ",\"type\":[\"number\",\"null\"]");
    else
        schema_number(bytes, use, field);
    bytes_text(bytes, "}");
    schema_length(bytes, field);
}

static const char *schema_text_type(const Field *field) {
    return (field->flags & FIELD_SCALARS) != 0 ? "[\"number\",\"string\",\"boolean\"]"
                                               : "\"string\"";
}

static void schema_strings(Bytes *bytes, const Field *field) {
    const bool has_pairs = (field->flags & FIELD_PAIRS) != 0;
    bytes_text(bytes, has_pairs ? ",\"anyOf\":[{" : "");
    bytes_text(bytes, ",\"type\":\"array\",\"items\":{\"type\":");
    bytes_text(bytes, schema_text_type(field));
    schema_choices(bytes, field);
    bytes_text(bytes, "}");
    schema_length(bytes, field);
    if (has_pairs) {
        bytes_text(bytes, "},{\"type\":\"object\","
                          "\"additionalProperties\":{\"type\":\"string\"}");
        if (field->max > 0)
            bytes_format(bytes, ",\"maxProperties\":%zu", field->max);
        bytes_text(bytes, "}]");
    }
    if (field->presence == PRESENCE_DEFAULT)
        schema_texts(bytes, "default", field->initial_texts);
}

// An object; with a shorthand also the string or list of the row it stands for, and null where it
// is allowed.
static void schema_item(Bytes *bytes, SchemaUse use, const Field *field) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0 && use == SCHEMA_READ;
    const bool is_named = field->shorthand != NULL && use == SCHEMA_READ;
    const bool has_forms = is_named || takes_null;
    bytes_text(bytes, has_forms ? ",\"anyOf\":[{" : "");
    schema_object(bytes, use, field->fields, NULL, NULL);
    if (is_named) {
        const Field *row = fields_find(field->fields, field->shorthand, NULL);
        const bool is_list = row->kind == FIELD_KIND_REALS;
        bytes_text(bytes, is_list ? "},{" : "},{\"type\":\"string\"");
        if (is_list)
            schema_reals(bytes, use, row);
        else if (row->kind == FIELD_KIND_CHOICE)
            schema_texts(bytes, "enum", row->choices);
        else if (row->max > 0)
            bytes_format(bytes, ",\"maxLength\":%zu", row->max);
        schema_text(bytes, "description", row->doc);
    }
    bytes_text(bytes, takes_null ? "},{\"type\":\"null\"" : "");
    bytes_text(bytes, has_forms ? "}]" : "");
}

// One schema per kind. Only the default kind may be without its tag, so exactly one of them fits.
static void schema_variant(Bytes *bytes, SchemaUse use, const Field *field) {
    const Kind *kind;
    bytes_text(bytes, ",\"oneOf\":[");
    for (size_t i = 0; (kind = field->kinds->at(i)) != NULL; i++) {
        bytes_json(bytes, ",{\"title\":%s,\"description\":%s", kind->name, kind->doc);
        schema_object(bytes, use, kind->fields, field->kinds, kind);
        bytes_text(bytes, "}");
    }
    bytes_text(bytes, "]");
    if (field->presence == PRESENCE_DEFAULT)
        bytes_json(bytes, ",\"default\":{\"%s\":%s}", field->kinds->tag, field->kinds->at(0)->name);
}

static void schema_value(Bytes *bytes, SchemaUse use, const Field *field) {
    const bool has_default = field->presence == PRESENCE_DEFAULT && use == SCHEMA_READ;
    switch (field->kind) {
    case FIELD_KIND_REAL:
    case FIELD_KIND_COUNT:
        schema_number(bytes, use, field);
        if (has_default)
            schema_real(bytes, "default", field->initial);
        break;
    case FIELD_KIND_FLAG:
        bytes_text(bytes, ",\"type\":\"boolean\"");
        if (has_default)
            bytes_text(bytes, field->initial != 0 ? ",\"default\":true" : ",\"default\":false");
        break;
    case FIELD_KIND_TEXT:
        bytes_format(bytes, ",\"type\":%s", schema_text_type(field));
        if (field->max > 0)
            bytes_format(bytes, ",\"maxLength\":%zu", field->max);
        break;
    case FIELD_KIND_CHOICE:
        if ((field->flags & FIELD_SCALARS) != 0)
            bytes_text(bytes, ",\"type\":\"boolean\"");
        else
            schema_texts(bytes, "enum", field->choices);
        if (has_default)
            schema_text(bytes, "default", field->choices[(int)field->initial]);
        break;
    case FIELD_KIND_REALS:
        if ((field->flags & FIELD_LONE) != 0) {
            bytes_text(bytes, ",\"anyOf\":[{");
            schema_number(bytes, use, field);
            bytes_text(bytes, "},{");
        }
        schema_reals(bytes, use, field);
        bytes_text(bytes, (field->flags & FIELD_LONE) != 0 ? "}]" : "");
        break;
    case FIELD_KIND_ROWS:
        bytes_text(bytes, ",\"type\":\"array\",\"items\":{");
        schema_reals(bytes, use, field);
        bytes_text(bytes, "}");
        schema_length(bytes, field);
        break;
    case FIELD_KIND_TEXTS:
        schema_strings(bytes, field);
        break;
    case FIELD_KIND_ITEM:
        schema_item(bytes, use, field);
        bytes_text(bytes, has_default ? ",\"default\":{}" : "");
        break;
    case FIELD_KIND_LIST:
        bytes_text(bytes, ",\"type\":\"array\",\"items\":{");
        schema_item(bytes, use, field);
        bytes_text(bytes, "}");
        schema_length(bytes, field);
        bytes_text(bytes, has_default ? ",\"default\":[]" : "");
        break;
    case FIELD_KIND_VARIANT:
        schema_variant(bytes, use, field);
        break;
    case FIELD_KIND_BASE:
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
}

// Whether a written member can be unknown; lists are empty then.
static bool schema_is_nullable(const Field *field) {
    const bool is_list = field->kind == FIELD_KIND_REALS || field->kind == FIELD_KIND_ROWS ||
                         field->kind == FIELD_KIND_TEXTS || field->kind == FIELD_KIND_LIST;
    return field->presence == PRESENCE_OPTIONAL && field->kind != FIELD_KIND_FLAG &&
           (!is_list || (field->flags & FIELD_NULL_IS_EMPTY) != 0);
}

static void schema_properties(Bytes *bytes, SchemaUse use, const Field *fields) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE) {
            schema_properties(bytes, use, field->fields);
            continue;
        }
        if ((field->flags & FIELD_HIDDEN) != 0)
            continue;
        bytes_format(bytes, ",\"%s\":{", field->name);
        if (field->doc != NULL)
            schema_text(bytes, "description", field->doc);
        const bool may_be_null = use == SCHEMA_WRITTEN && schema_is_nullable(field);
        bytes_text(bytes, may_be_null ? ",\"anyOf\":[{" : "");
        schema_value(bytes, use, field);
        bytes_text(bytes, may_be_null ? "},{\"type\":\"null\"}]" : "");
        if (field->unit != NULL)
            schema_text(bytes, "x-unit", field->unit);
        bytes_text(bytes, "}");
    }
}

static void schema_required(Bytes *bytes, SchemaUse use, const Field *fields) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE)
            schema_required(bytes, use, field->fields);
        else if (use == SCHEMA_WRITTEN ? (field->flags & FIELD_HIDDEN) == 0
                                       : field->presence == PRESENCE_REQUIRED)
            bytes_format(bytes, ",\"%s\"", field->name);
    }
}

// The members of an object's schema; `kind` is NULL for a plain object, else one of `kinds`, which
// their tag names.
static void schema_object(Bytes *bytes, SchemaUse use, const Field *fields, const KindTable *kinds,
                          const Kind *kind) {
    bytes_text(bytes, ",\"type\":\"object\",\"properties\":{");
    if (kind != NULL)
        bytes_json(bytes, ",\"%s\":{\"const\":%s}", kinds->tag, kind->name);
    schema_properties(bytes, use, fields);
    bytes_text(bytes, "},\"required\":[");
    if (kind != NULL && (kinds->is_named || kind != kinds->at(0)))
        bytes_format(bytes, ",\"%s\"", kinds->tag);
    schema_required(bytes, use, fields);
    bytes_text(bytes, "],\"additionalProperties\":false");
}

static void schema_new_line(Bytes *bytes, int depth) {
    bytes_text(bytes, "\n");
    for (int i = 0; i < depth; i++)
        bytes_text(bytes, "  ");
}

// A member or object a line; a list of texts on one line.
static void schema_indent(Bytes *bytes, const char *text) {
    int depth = 0;
    bool is_in_text = false, is_in_line = false;
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '"')
            is_in_text = !is_in_text;
        if (is_in_text && *c == '\\')
            bytes_put(bytes, c++, 1);
        const bool is_open = !is_in_text && (*c == '{' || *c == '[');
        const bool is_close = !is_in_text && (*c == '}' || *c == ']');
        if (is_close && !is_in_line)
            schema_new_line(bytes, --depth);
        is_in_line = is_in_line && !is_close;
        bytes_put(bytes, c, 1);
        if (is_open) {
            const bool is_list = *c == '[';
            c += c[1] == ',' ? 1 : 0; // of the first member
            is_in_line = c[1] == '}' || c[1] == ']' || (is_list && c[1] != '{');
            if (!is_in_line)
                schema_new_line(bytes, ++depth);
        } else if (!is_in_text && *c == ',') {
            if (is_in_line)
                bytes_text(bytes, " ");
            else
                schema_new_line(bytes, depth);
        } else if (!is_in_text && *c == ':') {
            bytes_text(bytes, " ");
        }
    }
    bytes_text(bytes, "\n");
}

// An answer as its document: with the result and the scene it belongs to.
static void schema_answer(Bytes *bytes, const Kind *answer) {
    bytes_json(bytes,
               ",\"type\":\"object\",\"properties\":{,\"kind\":{\"const\":%s},"
               "\"result\":{\"type\":\"string\",\"description\":\"id of the result\"},"
               "\"scene\":{\"type\":\"object\",\"description\":\"the completed scene, with the "
               "request\"}",
               answer->name);
    schema_properties(bytes, SCHEMA_WRITTEN, answer->fields);
    bytes_text(bytes, "},\"required\":[,\"kind\",\"result\",\"scene\"");
    schema_required(bytes, SCHEMA_WRITTEN, answer->fields);
    bytes_text(bytes, "],\"additionalProperties\":false");
}

void schema_write_document(Bytes *bytes, const SchemaDocument *document) {
    Bytes text = {0};
    bytes_json(&text,
               "{,\"$schema\":\"https://json-schema.org/draft/2020-12/schema\","
               "\"$id\":\"/schemas/%s\",\"title\":%s",
               document->name, document->title);
    if (document->study != NULL)
        schema_answer(&text, document->study->answer);
    else
        schema_object(&text, SCHEMA_READ, document->fields, NULL, NULL);
    bytes_text(&text, "}");
    if (text.is_failed)
        bytes->is_failed = true;
    else
        schema_indent(bytes, text.at);
    bytes_clear(&text);
}
