// The walk follows the keys of the document, so that it meets every unknown one; missing members
// are for fields_validate to report. A value that cannot be read leaves its member as it was. An
// element that cannot be read is replaced by an allowed one, so that those behind it keep their
// places. Beyond PROBLEM_FAULTS faults are counted and not described: a document of a million
// faults costs no more than its parsing.
#include "server/json/decode.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "server/util/bytes.h"
#include "server/util/dtoa.h"

enum {
    POINTER_SIZE = sizeof((Fault){0}.pointer),
    DETAIL_SIZE = sizeof((Fault){0}.detail),
    KINDS_SHOWN = 64
};

static void decode_members(Decoder *decoder, const json_t *object, const Field *fields, void *item,
                           const char *pointer, const KindTable *kinds);
static void decode_field(Decoder *decoder, const json_t *value, const Field *field, void *member,
                         const char *pointer);

static const char *type_name(const json_t *value) {
    static const char *const names[] = {
        [JSON_OBJECT] = "an object", [JSON_ARRAY] = "an array", [JSON_STRING] = "a string",
        [JSON_INTEGER] = "a number", [JSON_REAL] = "a number",  [JSON_TRUE] = "true",
        [JSON_FALSE] = "false",      [JSON_NULL] = "null",
    };
    return names[json_typeof(value)];
}

static double number_of(const json_t *value) {
    return json_number_value(value) + 0.0; // -0 becomes 0
}

// The value as JSON text, cut to fit; "" for arrays and objects, which may be long.
static void value_text(const json_t *value, char *target, size_t size) {
    char digits[SHORTEST_SIZE + 1];
    if (json_is_string(value)) {
        text_quote(target, size, json_string_value(value));
    } else if (json_is_integer(value)) {
        snprintf(target, size, "%lld", (long long)json_integer_value(value));
    } else if (json_is_real(value)) {
        digits[dtoa_write(digits, json_real_value(value))] = '\0';
        text_fit(target, size, digits);
    } else {
        const bool is_container = json_is_object(value) || json_is_array(value);
        text_fit(target, size, is_container ? "" : type_name(value));
    }
}

// Whether a fault is to be described; one that is not is counted here.
static bool decode_describes(Decoder *decoder) {
    decoder->is_faulty = true;
    if (decoder->problem != NULL && decoder->problem->count < PROBLEM_FAULTS)
        return true;
    (void)problem_add(decoder->problem, STATUS_INVALID, "", "one of many");
    return false;
}

// A fault of `value` at `pointer`; `unit` and `meant` may be NULL.
__attribute__((format(printf, 6, 7))) static void
decode_fault(Decoder *decoder, const char *pointer, const json_t *value, const char *unit,
             const char *meant, const char *format, ...) {
    if (!decode_describes(decoder))
        return;
    Fault fault = {0};
    va_list arguments;
    va_start(arguments, format);
    text_fit_format(fault.detail, sizeof fault.detail, format, arguments);
    va_end(arguments);
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    value_text(value, fault.value, sizeof fault.value);
    text_fit(fault.unit, sizeof fault.unit, unit != NULL ? unit : "");
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, meant != NULL ? meant : "");
    (void)problem_add_fault(decoder->problem, STATUS_INVALID, &fault);
}

// "must be a number [kg], is a string"; `field` (NULL: none) knows the unit.
static void decode_wrong_type(Decoder *decoder, const char *pointer, const json_t *value,
                              const Field *field, const char *wanted) {
    const char *unit = field != NULL ? field->unit : NULL;
    decode_fault(decoder, pointer, value, unit, NULL, "must be %s%s%s%s, is %s", wanted,
                 unit != NULL ? " [" : "", unit != NULL ? unit : "", unit != NULL ? "]" : "",
                 type_name(value));
}

// "must be one of a, b, c, is "x"". Returns the nearest of the names, NULL if none is near.
static const char *decode_wrong_name(Decoder *decoder, const char *pointer, const json_t *value,
                                     const char *const *names) {
    const char *name = json_string_value(value), *meant = spelling_nearest(names, name);
    char list[DETAIL_SIZE] = "", shown[64];
    for (size_t i = 0; names[i] != NULL; i++)
        text_list(list, sizeof list, names[i]);
    text_quote(shown, sizeof shown, name);
    decode_fault(decoder, pointer, value, NULL, meant, "must be one of %s, is %s", list, shown);
    return meant;
}

// Whether an array is within the limit of its row.
static bool decode_fits(Decoder *decoder, const json_t *value, const Field *field, size_t count,
                        const char *what, const char *pointer) {
    if (field->max == 0 || count <= field->max)
        return true;
    decode_fault(decoder, pointer, value, NULL, NULL, "must have at most %zu %s, has %zu",
                 field->max, what, count);
    return false;
}

static void decode_count(Decoder *decoder, const json_t *value, const Field *field,
                         uint64_t *target, const char *pointer) {
    if (!json_is_number(value)) {
        decode_wrong_type(decoder, pointer, value, field, "a whole number");
        return;
    }
    if (json_is_integer(value) && json_integer_value(value) >= 0) {
        *target = (uint64_t)json_integer_value(value);
        return;
    }
    const double number = number_of(value);
    if (number >= 0 && number < 0x1p63 && floor(number) == number) {
        *target = (uint64_t)number;
        return;
    }
    const Range *range = &field->range;
    const RealText min = real_text(range->min > 0 ? range->min : 0);
    char is[SHORTEST_SIZE + 1];
    value_text(value, is, sizeof is);
    if (isinf(range->max))
        decode_fault(decoder, pointer, value, field->unit, NULL,
                     "must be a whole number of at least %s, is %s", min.at, is);
    else
        decode_fault(decoder, pointer, value, field->unit, NULL,
                     "must be a whole number within [%s, %s], is %s", min.at,
                     real_text(range->max < 0x1p63 ? range->max : 0x1p63).at, is);
}

static void decode_text(Decoder *decoder, const json_t *value, const Field *field, char **target,
                        const char *pointer) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    if (!json_is_string(value) && !(takes_null && json_is_null(value))) {
        decode_wrong_type(decoder, pointer, value, field,
                          takes_null ? "a string or null" : "a string");
        return;
    }
    const size_t length = json_string_length(value);
    if (field->max > 0 && length > field->max) {
        decode_fault(decoder, pointer, value, NULL, NULL, "must have at most %zu bytes, has %zu",
                     field->max, length);
        return;
    }
    char *text = strdup(json_is_null(value) ? "" : json_string_value(value));
    if (text == NULL) {
        decoder->is_out_of_memory = true;
        return;
    }
    free(*target);
    *target = text;
}

static void decode_choice(Decoder *decoder, const json_t *value, const Field *field, int *target,
                          const char *pointer) {
    if (!json_is_string(value)) {
        decode_wrong_type(decoder, pointer, value, field, "a string");
        return;
    }
    for (int i = 0; field->choices[i] != NULL; i++) {
        if (strcmp(field->choices[i], json_string_value(value)) == 0) {
            *target = i;
            return;
        }
    }
    (void)decode_wrong_name(decoder, pointer, value, field->choices);
}

// A number that the row allows: its range is not to report it a second time.
static double allowed_number(const Range *range) {
    if (!isinf(range->min))
        return range->is_open_below ? nextafter(range->min, (double)INFINITY) : range->min;
    return isinf(range->max) ? 0 : range->max;
}

static void decode_reals(Decoder *decoder, const json_t *value, const Field *field, Reals *target,
                         const char *pointer) {
    const bool takes_number = (field->flags & FIELD_LONE) != 0;
    const bool is_number = takes_number && json_is_number(value);
    if (!json_is_array(value) && !is_number) {
        decode_wrong_type(decoder, pointer, value, field,
                          takes_number ? "a number or an array of numbers" : "an array of numbers");
        return;
    }
    const size_t count = is_number ? 1 : json_array_size(value);
    Reals reals = {NULL, 0};
    if (!is_number && !decode_fits(decoder, value, field, count, "numbers", pointer))
        return;
    if (count > 0 && !reals_allocate(&reals, count)) {
        decoder->is_out_of_memory = true;
        return;
    }
    for (size_t i = 0; i < count; i++) {
        const json_t *element = is_number ? value : json_array_get(value, i);
        char place[POINTER_SIZE];
        if (json_is_number(element)) {
            reals.at[i] = number_of(element);
            continue;
        }
        reals.at[i] = allowed_number(&field->range);
        json_pointer_index(place, sizeof place, pointer, i);
        decode_wrong_type(decoder, place, element, field, "a number");
    }
    free(target->at);
    *target = reals;
}

static void decode_rows(Decoder *decoder, const json_t *value, const Field *field, Rows *target,
                        const char *pointer) {
    if (!json_is_array(value)) {
        decode_wrong_type(decoder, pointer, value, field, "an array of rows of numbers");
        return;
    }
    const size_t count = json_array_size(value);
    if (!decode_fits(decoder, value, field, count, "rows", pointer))
        return;
    Reals *rows = count > 0 ? calloc(count, sizeof *rows) : NULL;
    if (rows == NULL && count > 0) {
        decoder->is_out_of_memory = true;
        return;
    }
    for (size_t i = 0; i < count; i++) {
        char place[POINTER_SIZE];
        json_pointer_index(place, sizeof place, pointer, i);
        decode_reals(decoder, json_array_get(value, i), field, &rows[i], place);
    }
    for (size_t i = 0; i < target->count; i++)
        free(target->at[i].at);
    free(target->at);
    *target = (Rows){rows, count};
}

// An element of a list of texts: a string, with its key in front ("key=value") where it is a member
// of an object; under FIELD_SCALARS the JSON text of a string, number or boolean.
static void decode_element(Decoder *decoder, const json_t *value, const char *key,
                           const Field *field, Bytes *text, const char *place) {
    if ((field->flags & FIELD_SCALARS) != 0) {
        if (json_is_string(value)) {
            bytes_json_string(text, json_string_value(value));
        } else if (json_is_boolean(value)) {
            bytes_text(text, json_is_true(value) ? "true" : "false");
        } else if (json_is_integer(value) && json_integer_value(value) > (json_int_t)1 << 53) {
            bytes_format(text, "%lld", (long long)json_integer_value(value));
        } else {
            bytes_real(text, number_of(value));
            if (!json_is_number(value))
                decode_wrong_type(decoder, place, value, NULL, "a number, a string, true or false");
        }
        return;
    }
    if (key != NULL) {
        bytes_text(text, key);
        bytes_text(text, "=");
    }
    if (json_is_string(value)) {
        bytes_text(text, json_string_value(value));
        return;
    }
    bytes_text(text, field->choices != NULL ? field->choices[0] : "");
    decode_wrong_type(decoder, place, value, NULL, "a string");
}

static void decode_texts(Decoder *decoder, const json_t *value, const Field *field, Texts *target,
                         const char *pointer) {
    const bool takes_pairs = (field->flags & FIELD_PAIRS) != 0;
    const bool is_pairs = takes_pairs && json_is_object(value);
    if (!json_is_array(value) && !is_pairs) {
        decode_wrong_type(decoder, pointer, value, field,
                          takes_pairs ? "an array or an object of strings" : "an array of strings");
        return;
    }
    const size_t count = is_pairs ? json_object_size(value) : json_array_size(value);
    if (!decode_fits(decoder, value, field, count, "texts", pointer))
        return;
    Texts texts = {calloc(1, sizeof *texts.at), 0}; // an empty array is not an absent one
    Bytes text = {0};
    decoder->is_out_of_memory = decoder->is_out_of_memory || texts.at == NULL;
    void *member = is_pairs ? json_object_iter((json_t *)value) : NULL;
    for (size_t i = 0; i < count && !decoder->is_out_of_memory; i++) {
        const char *key = is_pairs ? json_object_iter_key(member) : NULL;
        const json_t *element =
            is_pairs ? json_object_iter_value(member) : json_array_get(value, i);
        char place[POINTER_SIZE];
        if (is_pairs)
            json_pointer_join(place, sizeof place, pointer, key);
        else
            json_pointer_index(place, sizeof place, pointer, i);
        text.count = 0;
        decode_element(decoder, element, key, field, &text, place);
        decoder->is_out_of_memory =
            !bytes_reserve(&text, 0) || texts_append(&texts, text.at) != STATUS_OK;
        member = is_pairs ? json_object_iter_next((json_t *)value, member) : NULL;
    }
    bytes_clear(&text);
    texts_clear(target);
    *target = texts;
}

static void decode_list(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer) {
    if (!json_is_array(value)) {
        decode_wrong_type(decoder, pointer, value, field, "an array of objects");
        return;
    }
    const size_t count = json_array_size(value);
    if (count == 0 || !decode_fits(decoder, value, field, count, "elements", pointer))
        return;
    List list = {calloc(count, field->size), 0};
    decoder->is_out_of_memory = decoder->is_out_of_memory || list.at == NULL;
    for (size_t i = 0; i < count && list.at != NULL; i++) {
        void *element = (char *)list.at + i * field->size;
        char place[POINTER_SIZE];
        list.count = i + 1;
        if (fields_default(field->fields, element) != STATUS_OK) {
            decoder->is_out_of_memory = true;
            break;
        }
        json_pointer_index(place, sizeof place, pointer, i);
        decode_root(decoder, json_array_get(value, i), field->fields, element, place);
    }
    // A typed list is written as bytes, as field.c reads it. Lists have no default elements to
    // free.
    memcpy(target, &list, sizeof list);
}

// A string under a shorthand stands for an object with that member alone.
static void decode_item(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    const bool is_short = json_is_string(value) && field->shorthand != NULL;
    if (json_is_null(value) && takes_null) {
        fields_clear(field->fields, target);
        return;
    }
    if (!json_is_object(value) && !is_short) {
        decode_wrong_type(decoder, pointer, value, NULL,
                          takes_null                 ? "an object or null"
                          : field->shorthand != NULL ? "an object or a string"
                                                     : "an object");
        return;
    }
    // An item that is absent gets the defaults of its members when it appears.
    if (field->presence != PRESENCE_DEFAULT && fields_default(field->fields, target) != STATUS_OK) {
        decoder->is_out_of_memory = true;
    } else if (is_short) {
        size_t offset = 0;
        const Field *row = fields_find(field->fields, field->shorthand, &offset);
        decode_field(decoder, value, row, (char *)target + offset + row->offset, pointer);
    } else {
        decode_members(decoder, value, field->fields, target, pointer, NULL);
    }
}

// The kind that the tag names. If it names none, that is a fault and *is_known false; the result is
// then the nearest kind, NULL if none is near.
static const Kind *decode_kind(Decoder *decoder, const json_t *object, const KindTable *kinds,
                               const char *pointer, bool *is_known) {
    const json_t *tag = json_object_get(object, kinds->tag);
    const Kind *kind = NULL;
    if (tag == NULL && !kinds->is_named)
        kind = kinds->at(0);
    else if (json_is_string(tag))
        kind = kind_find(kinds, json_string_value(tag));
    *is_known = kind != NULL;
    if (kind != NULL)
        return kind;
    char place[POINTER_SIZE], list[DETAIL_SIZE] = "";
    const char *names[KINDS_SHOWN + 1] = {NULL};
    json_pointer_join(place, sizeof place, pointer, kinds->tag);
    for (size_t i = 0; i < KINDS_SHOWN && kinds->at(i) != NULL; i++) {
        names[i] = kinds->at(i)->name;
        text_list(list, sizeof list, names[i]);
    }
    if (json_is_string(tag)) {
        const char *meant = decode_wrong_name(decoder, place, tag, names);
        return meant != NULL ? kind_find(kinds, meant) : NULL;
    }
    if (tag != NULL)
        decode_wrong_type(decoder, place, tag, NULL, "a string");
    else if (decode_describes(decoder))
        (void)problem_add(decoder->problem, STATUS_INVALID, place, "is required, one of %s", list);
    return NULL;
}

// Members of an unknown kind are read, so that they are not reported as missing, but their faults
// are not reported.
static void decode_variant(Decoder *decoder, const json_t *value, const Field *field,
                           Variant **target, const char *pointer) {
    if (!json_is_object(value)) {
        decode_wrong_type(decoder, pointer, value, NULL, "an object");
        return;
    }
    bool is_known;
    const Kind *kind = decode_kind(decoder, value, field->kinds, pointer, &is_known);
    Variant *variant = variant_new(kind != NULL ? kind : field->kinds->at(0));
    if (variant == NULL) {
        decoder->is_out_of_memory = true;
        return;
    }
    variant_free(*target);
    *target = variant;
    Decoder silent = {0};
    decode_members(is_known ? decoder : &silent, value, variant->kind->fields, variant, pointer,
                   field->kinds);
    decoder->is_out_of_memory = decoder->is_out_of_memory || silent.is_out_of_memory;
}

static void decode_field(Decoder *decoder, const json_t *value, const Field *field, void *member,
                         const char *pointer) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        if (json_is_number(value))
            *(double *)member = number_of(value);
        else
            decode_wrong_type(decoder, pointer, value, field, "a number");
        break;
    case FIELD_KIND_COUNT:
        decode_count(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_FLAG:
        if (json_is_boolean(value))
            *(bool *)member = json_is_true(value);
        else
            decode_wrong_type(decoder, pointer, value, field, "true or false");
        break;
    case FIELD_KIND_TEXT:
        decode_text(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_CHOICE:
        decode_choice(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_REALS:
        decode_reals(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_ROWS:
        decode_rows(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_TEXTS:
        decode_texts(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_LIST:
        decode_list(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_ITEM:
        decode_item(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_VARIANT:
        decode_variant(decoder, value, field, member, pointer);
        break;
    case FIELD_KIND_BASE:
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
}

// Names the kinds that have the key, if `own` kind has not.
static void decode_unknown_key(Decoder *decoder, const char *pointer, const json_t *value,
                               const char *key, const Field *fields, const KindTable *kinds,
                               const Kind *own) {
    char others[DETAIL_SIZE] = "";
    const Kind *kind;
    for (size_t i = 0; kinds != NULL && (kind = kinds->at(i)) != NULL; i++)
        if (fields_find(kind->fields, key, NULL) != NULL)
            text_list(others, sizeof others, kind->name);
    if (others[0] != '\0') {
        decode_fault(decoder, pointer, value, NULL, NULL,
                     "unknown key of %s %s; it belongs to %s %s", kinds->tag, own->name, kinds->tag,
                     others);
        return;
    }
    const char *meant = spelling_nearest_field(fields, key);
    if (meant == NULL && kinds != NULL)
        meant = spelling_nearest((const char *const[]){kinds->tag, NULL}, key);
    decode_fault(decoder, pointer, value, NULL, meant, "unknown key");
}

// `kinds`: those of a variant, which `item` then is, and whose tag is skipped; else NULL.
static void decode_members(Decoder *decoder, const json_t *object, const Field *fields, void *item,
                           const char *pointer, const KindTable *kinds) {
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)object, key, value) {
        if (kinds != NULL && strcmp(kinds->tag, key) == 0)
            continue;
        size_t offset = 0;
        const Field *field = fields_find(fields, key, &offset);
        char place[POINTER_SIZE];
        json_pointer_join(place, sizeof place, pointer, key);
        if (field != NULL)
            decode_field(decoder, value, field, (char *)item + offset + field->offset, place);
        else if (decode_describes(decoder))
            decode_unknown_key(decoder, place, value, key, fields, kinds,
                               kinds != NULL ? ((const Variant *)item)->kind : NULL);
    }
}

void decode_root(Decoder *decoder, const json_t *root, const Field *fields, void *item,
                 const char *pointer) {
    if (json_is_object(root))
        decode_members(decoder, root, fields, item, pointer, NULL);
    else
        decode_wrong_type(decoder, pointer, root, NULL, "an object");
}

void decode_value(Decoder *decoder, const json_t *value, const Field *field, void *item,
                  const char *pointer) {
    decode_field(decoder, value, field, (char *)item + field->offset, pointer);
}
