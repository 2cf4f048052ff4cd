// Three steps: a scan that bounds what the parser is given, jansson's parser, and a walk over the
// tree by the Field rows. The tree takes at most some 25 times the memory of the text.
#include "server/json/parse.h"

#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "server/util/bytes.h"
#include "server/util/dtoa.h"
#include "server/util/units.h"

enum {
    POINTER_SIZE = sizeof((Fault){0}.pointer),
    KEY_SIZE = 2 * POINTER_SIZE,
    DETAIL_SIZE = sizeof((Fault){0}.detail),
    KINDS_SHOWN = 64,
    BUFFER_FIRST = 16, // bytes of the buffer of jansson's lexer before it grows
};

void *(*json_memory_source)(size_t size) = malloc;

// --- memory ---

// Jansson 2.14 ignores that its lexer's text buffer cannot grow, and then reads past its end. While
// a text is parsed a reserve, allocated before, serves the buffer when memory runs out: requests of
// a power of two, as the buffer doubles. All other requests fail from then on, so that the parser
// soon stops. Strings of an array may be served likewise, at most twice the bytes of the text.
static _Thread_local struct {
    char *at, *next, *end; // NULL: no text is being parsed
    bool has_failed;
} reserve;

static void *memory_allocate(size_t size) {
    char *block = reserve.has_failed ? NULL : json_memory_source(size);
    if (block != NULL || reserve.at == NULL)
        return block;
    reserve.has_failed = true;
    if (size <= BUFFER_FIRST || (size & (size - 1)) != 0 ||
        size > (size_t)(reserve.end - reserve.next))
        return NULL;
    block = reserve.next;
    reserve.next += size;
    return block;
}

static void memory_free(void *block) {
    const uintptr_t at = (uintptr_t)block;
    if (reserve.at == NULL || at < (uintptr_t)reserve.at || at >= (uintptr_t)reserve.end)
        free(block);
}

static void memory_install(void) {
    json_set_alloc_funcs(memory_allocate, memory_free);
}

static json_t *memory_load(const char *text, size_t size, size_t flags, json_error_t *error,
                           bool *is_out_of_memory) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, memory_install);
    const size_t room = 4 * size + 4096;
    reserve.at = reserve.next = json_memory_source(room);
    reserve.end = reserve.at != NULL ? reserve.at + room : NULL;
    json_t *root = reserve.at != NULL ? json_loadb(text, size, flags, error) : NULL;
    *is_out_of_memory = reserve.at == NULL || reserve.has_failed;
    if (*is_out_of_memory) {
        json_decref(root);
        root = NULL;
    }
    free(reserve.at);
    memset(&reserve, 0, sizeof reserve);
    return root;
}

// --- decode ---

// The walk follows the keys of the document, so that it meets every unknown one; missing members
// are for fields_validate to report. A value that cannot be read leaves its member as it was. An
// element that cannot be read is replaced by an allowed one, so that those behind it keep their
// places. Beyond PROBLEM_FAULTS faults are counted and not described: a document of a million
// faults costs no more than its parsing.
typedef struct Decoder {
    Problem *problem; // NULL: faults are not described
    bool is_faulty, is_out_of_memory;
} Decoder;

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

// "must be a number [kg], is a string"; `field` (NULL: none) knows the unit. A string that is a
// quantity, "10 g", gets the number to write in its place.
static void decode_wrong_type(Decoder *decoder, const char *pointer, const json_t *value,
                              const Field *field, const char *wanted) {
    const char *unit = field != NULL ? field->unit : NULL;
    char hint[48] = "", reason[QUANTITY_REASON];
    double number;
    const bool is_quantity = json_is_string(value) && strstr(wanted, "number") != NULL;
    if (is_quantity && quantity_read(json_string_value(value), unit, &number, reason))
        snprintf(hint, sizeof hint, ": write %s", real_text(number).at);
    decode_fault(decoder, pointer, value, unit, NULL, "must be %s%s%s%s, is %s%s", wanted,
                 unit != NULL ? " [" : "", unit != NULL ? unit : "", unit != NULL ? "]" : "",
                 type_name(value), hint);
}

// "must be one of a, b, c, is "x"". Returns the nearest of the names, NULL if none is near. `item`:
// of the object whose shorthand the name is; NULL: none.
static const char *decode_wrong_name(Decoder *decoder, const char *pointer, const json_t *value,
                                     const char *const *names, const Field *item) {
    const char *name = json_string_value(value), *meant = spelling_nearest(names, name);
    char list[DETAIL_SIZE] = "", members[DETAIL_SIZE / 2] = "", shown[64];
    for (size_t i = 0; names[i] != NULL; i++)
        text_list(list, sizeof list, names[i]);
    const Field *row = item != NULL ? item->fields : NULL;
    for (; row != NULL && row->kind != FIELD_KIND_END; row++)
        if (strcmp(row->name, item->shorthand) != 0)
            text_list(members, sizeof members, row->name);
    text_quote(shown, sizeof shown, name);
    decode_fault(decoder, pointer, value, NULL, meant, "must be one of %s%s%s, is %s", list,
                 item != NULL ? ", or an object with " : "", members, shown);
    return meant;
}

static void decode_real(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer) {
    if (json_is_number(value))
        *(double *)target = number_of(value);
    else
        decode_wrong_type(decoder, pointer, value, field, "a number");
}

static void decode_flag(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer) {
    if (json_is_boolean(value))
        *(bool *)target = json_is_true(value);
    else
        decode_wrong_type(decoder, pointer, value, field, "true or false");
}

static void decode_count(Decoder *decoder, const json_t *value, const Field *field, void *target,
                         const char *pointer) {
    if (!json_is_number(value)) {
        decode_wrong_type(decoder, pointer, value, field, "a whole number");
        return;
    }
    if (json_is_integer(value) && json_integer_value(value) >= 0) {
        *(uint64_t *)target = (uint64_t)json_integer_value(value);
        return;
    }
    const double number = number_of(value);
    if (number >= 0 && number < 0x1p63 && floor(number) == number) {
        *(uint64_t *)target = (uint64_t)number;
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

static void decode_text(Decoder *decoder, const json_t *value, const Field *field, void *target,
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
    free(*(char **)target);
    *(char **)target = text;
}

// `item`: as of decode_wrong_name.
static void decode_choice_of(Decoder *decoder, const json_t *value, const Field *field,
                             const Field *item, void *target, const char *pointer) {
    const bool is_flag = (field->flags & FIELD_SCALARS) != 0;
    if (is_flag && json_is_boolean(value)) {
        *(int *)target = json_is_true(value);
        return;
    }
    if (is_flag || !json_is_string(value)) {
        decode_wrong_type(decoder, pointer, value, field, is_flag ? "true or false" : "a string");
        return;
    }
    for (int i = 0; field->choices[i] != NULL; i++) {
        if (strcmp(field->choices[i], json_string_value(value)) == 0) {
            *(int *)target = i;
            return;
        }
    }
    (void)decode_wrong_name(decoder, pointer, value, field->choices, item);
}

static void decode_choice(Decoder *decoder, const json_t *value, const Field *field, void *target,
                          const char *pointer) {
    decode_choice_of(decoder, value, field, NULL, target, pointer);
}

// A number that the row allows: its range is not to report it a second time.
static double allowed_number(const Range *range) {
    if (!isinf(range->min))
        return range->is_open_below ? nextafter(range->min, (double)INFINITY) : range->min;
    return isinf(range->max) ? 0 : range->max;
}

// A text of a list: a string, with its key in front ("key=value") where it is a member of an
// object; under FIELD_SCALARS the JSON text of a string, number or boolean.
static void decode_list_text(Decoder *decoder, const json_t *value, const char *key,
                             const Field *field, char **target, const char *place) {
    Bytes text = {0};
    const bool is_scalar = (field->flags & FIELD_SCALARS) != 0, is_number = json_is_number(value);
    if (key != NULL) {
        bytes_text(&text, key);
        bytes_text(&text, "=");
    }
    if (json_is_string(value) && is_scalar)
        bytes_json_string(&text, json_string_value(value));
    else if (json_is_string(value))
        bytes_text(&text, json_string_value(value));
    else if (!is_scalar)
        bytes_text(&text, field->choices != NULL ? field->choices[0] : "");
    else if (json_is_boolean(value))
        bytes_text(&text, json_is_true(value) ? "true" : "false");
    else if (json_is_integer(value) && json_integer_value(value) > (json_int_t)1 << 53)
        bytes_format(&text, "%lld", (long long)json_integer_value(value));
    else
        bytes_real(&text, number_of(value));
    if (!json_is_string(value) && !(is_scalar && (is_number || json_is_boolean(value))))
        decode_wrong_type(decoder, place, value, NULL,
                          is_scalar ? "a number, a string, true or false" : "a string");
    *target = text.is_failed ? NULL : strdup(text.at); // less room than in `text`
    decoder->is_out_of_memory = decoder->is_out_of_memory || *target == NULL;
    bytes_clear(&text);
}

// A text under FIELD_SCALARS.
static void decode_scalar(Decoder *decoder, const json_t *value, const Field *field, char **target,
                          const char *place) {
    free(*target);
    decode_list_text(decoder, value, NULL, field, target, place);
}

static void decode_root(Decoder *decoder, const json_t *root, const Field *fields, void *item,
                        const char *pointer) {
    if (json_is_object(root))
        decode_members(decoder, root, fields, item, pointer, NULL);
    else
        decode_wrong_type(decoder, pointer, root, NULL, "an object");
}

static void decode_list(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer);

// Whether the shorthand of an item is a list of numbers.
static bool decode_has_short_list(const Field *field) {
    return field->shorthand != NULL &&
           fields_find(field->fields, field->shorthand, NULL)->kind == FIELD_KIND_REALS;
}

// A string, or a list of numbers, under a shorthand stands for an object with that member alone.
static bool decode_is_short(const json_t *value, const Field *field) {
    return field->shorthand != NULL &&
           (decode_has_short_list(field) ? json_is_array(value) : json_is_string(value));
}

static void decode_short(Decoder *decoder, const json_t *value, const Field *field, void *item,
                         const char *pointer) {
    size_t offset = 0;
    const Field *row = fields_find(field->fields, field->shorthand, &offset);
    char *member = (char *)item + offset + row->offset;
    if (row->kind == FIELD_KIND_CHOICE)
        decode_choice_of(decoder, value, row, field, member, pointer);
    else
        decode_field(decoder, value, row, member, pointer);
}

// `key`: NULL: an element of an array, else of an object.
static void decode_element(Decoder *decoder, const json_t *value, const char *key,
                           const Field *field, void *element, const char *place) {
    Field row = *field; // of the numbers of a row
    const bool is_unknown = json_is_null(value) && (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    switch (field->kind) {
    case FIELD_KIND_REALS:
        *(double *)element = json_is_number(value) ? number_of(value)
                             : is_unknown          ? (double)NAN
                                                   : allowed_number(&field->range);
        if (!json_is_number(value) && !is_unknown)
            decode_wrong_type(decoder, place, value, field, "a number");
        break;
    case FIELD_KIND_ROWS:
        row.kind = FIELD_KIND_REALS;
        row.size = sizeof(double);
        decode_list(decoder, value, &row, element, place);
        break;
    case FIELD_KIND_TEXTS:
        decode_list_text(decoder, value, key, field, element, place);
        break;
    default:
        if (fields_default(field->fields, element) != STATUS_OK)
            decoder->is_out_of_memory = true;
        else if (decode_is_short(value, field))
            decode_short(decoder, value, field, element, place);
        else
            decode_root(decoder, value, field->fields, element, place);
    }
}

// An array of any kind; under FIELD_LONE also a number, under FIELD_PAIRS also an object.
static void decode_list(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer) {
    static const struct {
        const char *wanted, *what;
    } kinds[] = {
        [FIELD_KIND_REALS] = {"an array of numbers", "numbers"},
        [FIELD_KIND_ROWS] = {"an array of rows of numbers", "rows"},
        [FIELD_KIND_TEXTS] = {"an array of strings", "texts"},
        [FIELD_KIND_LIST] = {"an array of objects", "elements"},
    };
    const bool takes_number = (field->flags & FIELD_LONE) != 0;
    const bool takes_object = (field->flags & FIELD_PAIRS) != 0;
    const bool is_null = json_is_null(value) && (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    const bool is_number = takes_number && json_is_number(value);
    const bool is_object = takes_object && json_is_object(value);
    if (!json_is_array(value) && !is_number && !is_object && !is_null) {
        decode_wrong_type(decoder, pointer, value, field,
                          takes_number               ? "a number or an array of numbers"
                          : takes_object             ? "an array or an object of strings"
                          : field->shorthand != NULL ? "an array of names"
                                                     : kinds[field->kind].wanted);
        return;
    }
    const size_t count = is_number   ? 1
                         : is_object ? json_object_size(value)
                                     : json_array_size(value);
    if (!is_number && field->max > 0 && count > field->max) {
        decode_fault(decoder, pointer, value, NULL, NULL, "must have at most %zu %s, has %zu",
                     field->max, kinds[field->kind].what, count);
        return;
    }
    // A typed list is written as bytes, as field.c reads it. An empty list of texts is not an
    // absent one.
    List list = {NULL, 0};
    Field old[] = {*field, FIELD_END};
    if (count > 0 || field->kind == FIELD_KIND_TEXTS)
        list.at = calloc(count + 1, field->size);
    decoder->is_out_of_memory = decoder->is_out_of_memory || (count > 0 && list.at == NULL);
    void *member = is_object ? json_object_iter((json_t *)value) : NULL;
    for (size_t i = 0; i < count && !decoder->is_out_of_memory; i++) {
        char place[POINTER_SIZE];
        const char *key = is_object ? json_object_iter_key(member) : NULL;
        const json_t *element = is_number   ? value
                                : is_object ? json_object_iter_value(member)
                                            : json_array_get(value, i);
        if (is_object)
            json_pointer_join(place, sizeof place, pointer, key);
        else
            json_pointer_index(place, sizeof place, pointer, i);
        list.count = i + 1;
        decode_element(decoder, element, key, field, (char *)list.at + i * field->size, place);
        member = is_object ? json_object_iter_next((json_t *)value, member) : NULL;
    }
    old[0].offset = 0;
    fields_clear(old, target);
    memcpy(target, &list, sizeof list);
}

static void decode_item(Decoder *decoder, const json_t *value, const Field *field, void *target,
                        const char *pointer) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    const bool is_short = decode_is_short(value, field);
    if (json_is_null(value) && takes_null) {
        fields_clear(field->fields, target);
        return;
    }
    if (!json_is_object(value) && !is_short) {
        decode_wrong_type(decoder, pointer, value, NULL,
                          takes_null                     ? "an object or null"
                          : decode_has_short_list(field) ? "an object or an array of numbers"
                          : field->shorthand != NULL     ? "an object or a string"
                                                         : "an object");
        return;
    }
    // An item that is absent gets the defaults of its members when it appears.
    if (field->presence != PRESENCE_DEFAULT && fields_default(field->fields, target) != STATUS_OK) {
        decoder->is_out_of_memory = true;
    } else if (is_short) {
        decode_short(decoder, value, field, target, pointer);
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
        const char *meant = decode_wrong_name(decoder, place, tag, names, NULL);
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
static void decode_variant(Decoder *decoder, const json_t *value, const Field *field, void *target,
                           const char *pointer) {
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
    variant_free(*(Variant **)target);
    *(Variant **)target = variant;
    Decoder silent = {0};
    decode_members(is_known ? decoder : &silent, value, variant->kind->fields, variant, pointer,
                   field->kinds);
    decoder->is_out_of_memory = decoder->is_out_of_memory || silent.is_out_of_memory;
}

static void decode_field(Decoder *decoder, const json_t *value, const Field *field, void *member,
                         const char *pointer) {
    static void (*const kinds[])(Decoder *, const json_t *, const Field *, void *, const char *) = {
        [FIELD_KIND_REAL] = decode_real,       [FIELD_KIND_COUNT] = decode_count,
        [FIELD_KIND_FLAG] = decode_flag,       [FIELD_KIND_TEXT] = decode_text,
        [FIELD_KIND_CHOICE] = decode_choice,   [FIELD_KIND_REALS] = decode_list,
        [FIELD_KIND_ROWS] = decode_list,       [FIELD_KIND_TEXTS] = decode_list,
        [FIELD_KIND_LIST] = decode_list,       [FIELD_KIND_ITEM] = decode_item,
        [FIELD_KIND_VARIANT] = decode_variant,
    };
    if (field->kind == FIELD_KIND_TEXT && (field->flags & FIELD_SCALARS) != 0)
        decode_scalar(decoder, value, field, member, pointer);
    else
        kinds[field->kind](decoder, value, field, member, pointer);
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

// --- scan ---

// The scan keeps a stack of frames, one per open bracket: the index in an array, the place of the
// last key in an object. It is no parser: it accepts any bytes, skips strings, and is right up to
// the first byte that is not JSON, which is enough for a pointer to that byte.
typedef struct Frame {
    bool is_array;
    size_t index;        // of the element or member
    size_t key, key_end; // the text between the quotes; 0: no key yet
} Frame;

typedef struct Scan {
    const char *text;
    size_t at;
    size_t depth, containers;
    bool is_key_next;
    Frame frames[JSON_DEPTH_MAX];
} Scan;

static bool scan_is_too_deep(const Scan *scan) {
    return scan->depth > JSON_DEPTH_MAX;
}

static Frame *scan_frame(Scan *scan) {
    return scan->depth > 0 && !scan_is_too_deep(scan) ? &scan->frames[scan->depth - 1] : NULL;
}

static void scan_string(Scan *scan, size_t stop) {
    Frame *frame = scan_frame(scan);
    const size_t start = ++scan->at;
    while (scan->at < stop && scan->text[scan->at] != '"')
        scan->at += scan->text[scan->at] == '\\' ? 2 : 1;
    if (scan->at > stop)
        scan->at = stop;
    if (scan->is_key_next && frame != NULL) {
        frame->key = start;
        frame->key_end = scan->at;
        scan->is_key_next = false;
    }
    if (scan->at < stop)
        scan->at++;
}

// Advances by one token, never beyond `stop`.
static void scan_step(Scan *scan, size_t stop) {
    const char c = scan->text[scan->at];
    Frame *frame = scan_frame(scan);
    if (c == '"') {
        scan_string(scan, stop);
        return;
    }
    if (c == '{' || c == '[') {
        if (scan->depth < JSON_DEPTH_MAX)
            scan->frames[scan->depth] = (Frame){.is_array = c == '['};
        scan->depth++;
        scan->containers++;
        scan->is_key_next = c == '{';
    } else if (c == '}' || c == ']') {
        scan->depth -= scan->depth > 0 ? 1 : 0;
        scan->is_key_next = false;
    } else if (c == ',' && frame != NULL) {
        frame->index++;
        frame->key = frame->key_end = 0;
        scan->is_key_next = !frame->is_array;
    }
    scan->at++;
}

// NULL if the text may be parsed, else why not; the place is then in *position.
static const char *scan_check(const char *text, size_t size, size_t *position) {
    const char *nul = memchr(text, '\0', size);
    if (nul != NULL) {
        *position = (size_t)(nul - text);
        return "there is a NUL byte; the text must be UTF-8";
    }
    Scan scan = {.text = text};
    while (scan.at < size) {
        scan_step(&scan, size);
        *position = scan.at - 1;
        const Frame *frame = scan_frame(&scan);
        if (scan_is_too_deep(&scan))
            return "objects and arrays are nested more than 32 deep";
        if (frame != NULL && !frame->is_array && frame->index >= JSON_MEMBERS_MAX)
            return "there are more than 4096 members in one object";
        if (scan.containers > JSON_CONTAINERS_MAX)
            return "there are more than 131072 objects and arrays";
    }
    return NULL;
}
_Static_assert(JSON_DEPTH_MAX == 32 && JSON_CONTAINERS_MAX == 131072 && JSON_MEMBERS_MAX == 4096,
               "the sentences name these numbers");

// The key with its escapes decoded, as far as they are valid.
static void scan_key(const Scan *scan, const Frame *frame, char name[KEY_SIZE]) {
    snprintf(name, KEY_SIZE, "%.*s", (int)(frame->key_end - frame->key), scan->text + frame->key);
    if (strchr(name, '\\') == NULL)
        return;
    char document[KEY_SIZE + 4];
    snprintf(document, sizeof document, "[\"%s\"]", name);
    json_t *parsed = json_loads(document, 0, NULL);
    const char *decoded = json_string_value(json_array_get(parsed, 0));
    if (decoded != NULL)
        text_fit(name, KEY_SIZE, decoded);
    json_decref(parsed);
}

// The pointer of text[position], below `base`.
static void scan_pointer(const char *text, size_t position, const char *base,
                         char pointer[POINTER_SIZE]) {
    Scan scan = {.text = text};
    while (scan.at < position && !scan_is_too_deep(&scan))
        scan_step(&scan, position);
    text_fit(pointer, POINTER_SIZE, base);
    for (size_t i = 0; i < scan.depth && i < JSON_DEPTH_MAX; i++) {
        const Frame *frame = &scan.frames[i];
        char parent[POINTER_SIZE], name[KEY_SIZE];
        memcpy(parent, pointer, sizeof parent);
        if (frame->is_array) {
            json_pointer_index(pointer, POINTER_SIZE, parent, frame->index);
        } else if (frame->key > 0) {
            scan_key(&scan, frame, name);
            json_pointer_join(pointer, POINTER_SIZE, parent, name);
        }
    }
}

bool scan_list(const char *text, size_t size, const char *name, ScanList *list) {
    Scan scan = {.text = text};
    char key[KEY_SIZE];
    bool is_inside = false;
    *list = (ScanList){.text = text, .end = size};
    while (scan.at < size && !scan_is_too_deep(&scan) && text[scan.at] != '\0') {
        const size_t at = scan.at, depth = scan.depth;
        const Frame outer = scan.frames[0];
        scan_step(&scan, size);
        if (is_inside && scan.depth < 2) {
            list->end = at;
            return true;
        }
        if (is_inside || depth != 1 || scan.depth != 2 || text[at] != '[' || outer.is_array ||
            outer.key == 0)
            continue;
        scan_key(&scan, &outer, key);
        is_inside = strcmp(key, name) == 0;
        list->begin = list->at = at + 1;
    }
    return is_inside && scan.at >= size;
}

static bool scan_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool scan_element(ScanList *list) {
    Scan scan = {.text = list->text, .at = list->at};
    size_t first = list->at;
    if (list->at > list->end)
        return false;
    while (scan.at < list->end && (scan.depth > 0 || list->text[scan.at] != ','))
        scan_step(&scan, list->end);
    size_t last = scan.at;
    const bool is_all = list->at == list->begin && last == list->end;
    list->at = last + 1; // behind the comma
    while (first < last && scan_is_blank(list->text[first]))
        first++;
    while (last > first && scan_is_blank(list->text[last - 1]))
        last--;
    list->first = first;
    list->count = last - first;
    return list->count > 0 || !is_all; // an empty array has no element
}

// A document within a text: text[first ... first + count - 1], which is at `pointer` of the whole.
typedef struct Part {
    const char *text;
    size_t first, count;
    const char *pointer;
    Status status; // of a part that is not JSON
} Part;

static Status part_error(const Part *part, size_t position, const char *sentence,
                         Problem *problem) {
    char pointer[POINTER_SIZE];
    size_t line = 1, column = 1; // of characters, not bytes
    for (size_t i = 0; i < part->first + position; i++) {
        if (part->text[i] == '\n') {
            line++;
            column = 1;
        } else if (((unsigned char)part->text[i] & 0xC0) != 0x80) {
            column++;
        }
    }
    scan_pointer(part->text + part->first, position, part->pointer, pointer);
    return problem_add(problem, part->status, pointer, "line %zu, column %zu: %s", line, column,
                       sentence);
}

static Status part_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
}

static Status part_syntax_error(const Part *part, const json_error_t *error, Problem *problem) {
    // jansson's position is behind the faulty token, ours is its last byte. Only a byte that is not
    // UTF-8 is not passed.
    size_t position = error->position > 0 ? (size_t)error->position : 0;
    if (position > 0 && json_error_code(error) != json_error_invalid_utf8)
        position--;
    if (position > part->count)
        position = part->count;
    static const struct {
        enum json_error_code code;
        const char *sentence;
    } sentences[] = {
        {json_error_duplicate_key, "the key occurs twice in its object"},
        {json_error_numeric_overflow,
         "the number is too large: reals go to 1.797e308, whole numbers to 9223372036854775807"},
        {json_error_premature_end_of_input, "the document ends before it is complete"},
        {json_error_end_of_input_expected,
         "the document is complete before this; nothing may follow"},
        {json_error_invalid_utf8, "the text is not UTF-8 here"},
        {json_error_null_character, "\\u0000 is not allowed"},
        {json_error_null_byte_in_key, "\\u0000 is not allowed in a key"},
    };
    const char *sentence = error->text;
    char token[sizeof error->text + 80];
    for (size_t i = 0; i < COUNT(sentences); i++)
        if (sentences[i].code == json_error_code(error))
            sentence = sentences[i].sentence;
    if (strncmp(sentence, "invalid token", 13) == 0) {
        snprintf(token, sizeof token,
                 "%s; a number is like 0.5 or 2e-3 (not NaN, .5 or 01), a text is in quotes",
                 error->text);
        sentence = token;
    }
    return part_error(part, position, sentence, problem);
}

static Status part_parse(const Part *part, json_t **root, Problem *problem) {
    const char *text = part->text + part->first;
    size_t position = 0;
    json_error_t error;
    *root = NULL;
    const char *sentence = scan_check(text, part->count, &position);
    if (sentence != NULL)
        return part_error(part, position, sentence, problem);
    bool is_out_of_memory;
    *root = memory_load(text, part->count, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error,
                        &is_out_of_memory);
    if (is_out_of_memory)
        return part_no_memory(problem);
    return *root != NULL ? STATUS_OK : part_syntax_error(part, &error, problem);
}

static Status part_status(const Decoder *decoder, json_t *root, Problem *problem) {
    json_decref(root);
    return decoder->is_out_of_memory ? part_no_memory(problem)
           : decoder->is_faulty      ? STATUS_INVALID
                                     : STATUS_OK;
}

size_t scan_mark(const char *text, size_t size) {
    static const char mark[] = "\xEF\xBB\xBF";
    const size_t count = sizeof mark - 1;
    return size >= count && memcmp(text, mark, count) == 0 ? count : 0;
}

Status json_parse_part(const char *text, size_t first, size_t count, const char *pointer,
                       const Field *fields, void *item, Problem *problem) {
    const Part part = {text, first, count, pointer, STATUS_UNREADABLE};
    Decoder decoder = {.problem = problem};
    json_t *root;
    if (fields_default(fields, item) != STATUS_OK)
        return part_no_memory(problem);
    TRY(part_parse(&part, &root, problem));
    decode_root(&decoder, root, fields, item, pointer);
    return part_status(&decoder, root, problem);
}

Status json_parse(const char *text, size_t size, const Field *fields, void *item,
                  Problem *problem) {
    if (size == 0)
        text = ""; // may be NULL
    const size_t mark = scan_mark(text, size);
    return json_parse_part(text + mark, 0, size - mark, "", fields, item, problem);
}

Status json_parse_value(const char *text, size_t size, const Field *field, void *item,
                        const char *pointer, Problem *problem) {
    Decoder decoder = {.problem = problem};
    json_t *root;
    TRY(part_parse(&(Part){text, 0, size, pointer, STATUS_INVALID}, &root, problem));
    decode_field(&decoder, root, field, (char *)item + field->offset, pointer);
    return part_status(&decoder, root, problem);
}

json_t *json_parse_stored(const char *text, bool *is_out_of_memory) {
    json_t *root = NULL;
    const Part part = {text, 0, strlen(text), "", STATUS_UNREADABLE};
    if (part_parse(&part, &root, NULL) == STATUS_NO_MEMORY)
        *is_out_of_memory = true;
    return root;
}

json_t *json_parse_tree(const char *text, size_t size) {
    json_t *root = NULL;
    if (size == 0) // `text` may be NULL
        return NULL;
    const size_t mark = scan_mark(text, size);
    const Part part = {text + mark, 0, size - mark, "", STATUS_UNREADABLE};
    if (part_parse(&part, &root, NULL) == STATUS_OK && json_is_object(root))
        return root;
    json_decref(root);
    return NULL;
}
