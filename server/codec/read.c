// Three steps: a scan that bounds what the parser may be given, jansson's parse, and a walk over
// the tree by the rows. The walk goes by the document's keys, so every unknown one is met; what is
// missing is fields_check's to say.
#include "server/codec/read.h"

#include <jansson.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/shortest.h"
#include "server/codec/scan.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer), KINDS_SHOWN = 64 };

typedef struct Reader {
    Problem *problem; // NULL: what is wrong is not worth telling
    bool is_faulty, is_out_of_memory;
} Reader;

static const char *type_name(const json_t *value) {
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "an array";
    case JSON_STRING:
        return "a string";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
        return "true";
    case JSON_FALSE:
        return "false";
    case JSON_NULL:
        break;
    }
    return "null";
}

// The value as JSON text, cut to fit; "" for what would be long.
static void value_text(const json_t *value, char *target, size_t size) {
    char digits[SHORTEST_SIZE + 1];
    switch (json_typeof(value)) {
    case JSON_STRING:
        text_quote(target, size, json_string_value(value));
        break;
    case JSON_INTEGER:
        snprintf(target, size, "%lld", (long long)json_integer_value(value));
        break;
    case JSON_REAL:
        digits[shortest_write(digits, json_real_value(value))] = '\0';
        text_fit(target, size, digits);
        break;
    case JSON_OBJECT:
    case JSON_ARRAY:
        target[0] = '\0';
        break;
    default:
        text_fit(target, size, type_name(value));
        break;
    }
}

// False where a fault need not be spelt out: nobody listens, or there are so many that it is only
// counted.
static bool wants_detail(Reader *reader) {
    reader->is_faulty = true;
    if (reader->problem != NULL && reader->problem->count < PROBLEM_FAULTS)
        return true;
    problem_add(reader->problem, STATUS_INVALID, "", "one of many");
    return false;
}

__attribute__((format(printf, 6, 7))) static void refuse(Reader *reader, const char *pointer,
                                                         const json_t *value, const char *unit,
                                                         const char *meant, const char *format,
                                                         ...) {
    if (!wants_detail(reader))
        return;
    Fault fault = {0};
    char text[2 * sizeof fault.detail];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_fit(fault.detail, sizeof fault.detail, text);
    value_text(value, fault.value, sizeof fault.value);
    text_fit(fault.unit, sizeof fault.unit, unit != NULL ? unit : "");
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, meant != NULL ? meant : "");
    problem_put(reader->problem, STATUS_INVALID, &fault);
}

static void refuse_type(Reader *reader, const char *pointer, const json_t *value,
                        const Field *field, const char *wanted) {
    const char *unit = field != NULL ? field->unit : NULL;
    refuse(reader, pointer, value, unit, NULL, "must be %s%s%s%s, is %s", wanted,
           unit != NULL ? " [" : "", unit != NULL ? unit : "", unit != NULL ? "]" : "",
           type_name(value));
}

// "must be one of a, b, c, is "x"", with the nearest of them, which is returned (NULL if none is
// near).
static const char *refuse_name(Reader *reader, const char *pointer, const json_t *value,
                               const char *const *names) {
    const char *name = json_string_value(value);
    const char *meant = texts_nearest(names, name);
    if (!wants_detail(reader))
        return meant;
    char list[sizeof((Fault){0}.detail)] = "", shown[64];
    size_t length = 0;
    for (size_t i = 0; names[i] != NULL && length < sizeof list; i++)
        length += (size_t)snprintf(list + length, sizeof list - length, "%s%s", i > 0 ? ", " : "",
                                   names[i]);
    text_quote(shown, sizeof shown, name);
    refuse(reader, pointer, value, NULL, meant, "must be one of %s, is %s", list, shown);
    return meant;
}

static void out_of_memory(Reader *reader) {
    reader->is_out_of_memory = true;
}

static void read_object(Reader *reader, const json_t *object, const Field *fields, void *item,
                        const char *pointer, const char *tag, const char *const *extra);

// --- one value
// -------------------------------------------------------------------------------------------

static double number_of(const json_t *value) {
    return json_number_value(value) + 0.0; // -0 becomes 0
}

static void read_count(Reader *reader, const json_t *value, const Field *field, uint64_t *target,
                       const char *pointer) {
    if (!json_is_number(value)) {
        refuse_type(reader, pointer, value, field, "a whole number");
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
    char least[32], most[32], is[SHORTEST_SIZE + 1];
    text_real(least, field->range.least > 0 ? field->range.least : 0);
    text_real(most, field->range.most < 0x1p63 ? field->range.most : 0x1p63);
    value_text(value, is, sizeof is);
    if (isinf(field->range.most))
        refuse(reader, pointer, value, field->unit, NULL,
               "must be a whole number of at least %s, is %s", least, is);
    else
        refuse(reader, pointer, value, field->unit, NULL,
               "must be a whole number within [%s, %s], is %s", least, most, is);
}

static void read_text(Reader *reader, const json_t *value, const Field *field, char **target,
                      const char *pointer) {
    if (!json_is_string(value)) {
        refuse_type(reader, pointer, value, field, "a string");
        return;
    }
    const size_t length = json_string_length(value);
    if (field->most > 0 && length > field->most) {
        refuse(reader, pointer, value, NULL, NULL, "must have at most %zu bytes, has %zu",
               field->most, length);
        return;
    }
    char *text = strdup(json_string_value(value));
    if (text == NULL) {
        out_of_memory(reader);
        return;
    }
    free(*target);
    *target = text;
}

static void read_choice(Reader *reader, const json_t *value, const Field *field, int *target,
                        const char *pointer) {
    if (!json_is_string(value)) {
        refuse_type(reader, pointer, value, field, "a string");
        return;
    }
    for (int i = 0; field->choices[i] != NULL; i++) {
        if (strcmp(field->choices[i], json_string_value(value)) == 0) {
            *target = i;
            return;
        }
    }
    refuse_name(reader, pointer, value, field->choices);
}

// --- many values
// -----------------------------------------------------------------------------------------

static bool allows_length(Reader *reader, const json_t *value, const Field *field, size_t has,
                          const char *what, const char *pointer) {
    if (field->most == 0 || has <= field->most)
        return true;
    refuse(reader, pointer, value, NULL, NULL, "must have at most %zu %s, has %zu", field->most,
           what, has);
    return false;
}

// A number that the row allows, in place of one that could not be read, so that it is not judged a
// second time.
static double allowed_number(const Range *range) {
    if (!isinf(range->least))
        return range->is_open_below ? nextafter(range->least, (double)INFINITY) : range->least;
    if (!isinf(range->most))
        return range->is_open_above ? nextafter(range->most, -(double)INFINITY) : range->most;
    return 0;
}

static void read_reals(Reader *reader, const json_t *value, const Field *field, Reals *target,
                       const char *pointer) {
    if (!json_is_array(value)) {
        refuse_type(reader, pointer, value, field, "an array of numbers");
        return;
    }
    const size_t count = json_array_size(value);
    if (!allows_length(reader, value, field, count, "numbers", pointer))
        return;
    double *at = count > 0 ? malloc(count * sizeof *at) : NULL;
    if (at == NULL && count > 0) {
        out_of_memory(reader);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        const json_t *element = json_array_get(value, i);
        if (json_is_number(element)) {
            at[i] = number_of(element);
            continue;
        }
        char place[POINTER_SIZE];
        pointer_index(place, sizeof place, pointer, i);
        refuse_type(reader, place, element, field, "a number");
        at[i] = allowed_number(&field->range);
    }
    free(target->at);
    *target = (Reals){at, count};
}

// "key=value", or `value` alone without a key.
static char *pair_text(const char *key, const char *value) {
    if (key == NULL)
        return strdup(value);
    const size_t size = strlen(key) + 1 + strlen(value) + 1;
    char *text = malloc(size);
    if (text != NULL)
        snprintf(text, size, "%s=%s", key, value);
    return text;
}

// What is no string is told and its place kept by an allowed text, so that those behind it keep
// theirs.
static void add_text(Reader *reader, const json_t *value, const char *key, const Field *field,
                     Texts *texts, const char *place) {
    const char *content = json_string_value(value);
    if (content == NULL) {
        refuse_type(reader, place, value, NULL, "a string");
        content = field->choices != NULL ? field->choices[0] : "";
    }
    char *text = pair_text(key, content);
    if (text == NULL)
        out_of_memory(reader);
    else
        texts->at[texts->count++] = text;
}

static void read_texts(Reader *reader, const json_t *value, const Field *field, Texts *target,
                       const char *pointer) {
    const bool is_pairs = json_is_object(value) && (field->flags & FIELD_PAIRS) != 0;
    if (!json_is_array(value) && !is_pairs) {
        refuse_type(reader, pointer, value, field,
                    (field->flags & FIELD_PAIRS) != 0 ? "an array or an object of strings"
                                                      : "an array of strings");
        return;
    }
    const size_t count = is_pairs ? json_object_size(value) : json_array_size(value);
    if (!allows_length(reader, value, field, count, "texts", pointer))
        return;
    Texts texts = {count > 0 ? calloc(count, sizeof *texts.at) : NULL, 0};
    if (texts.at == NULL && count > 0) {
        out_of_memory(reader);
        return;
    }
    char place[POINTER_SIZE];
    if (is_pairs) {
        const char *key;
        json_t *element;
        json_object_foreach((json_t *)value, key, element) {
            pointer_join(place, sizeof place, pointer, key);
            add_text(reader, element, key, field, &texts, place);
        }
    } else {
        for (size_t i = 0; i < count; i++) {
            pointer_index(place, sizeof place, pointer, i);
            add_text(reader, json_array_get(value, i), NULL, field, &texts, place);
        }
    }
    for (size_t i = 0; i < target->count; i++)
        free(target->at[i]);
    free(target->at);
    *target = texts;
}

static void read_list(Reader *reader, const json_t *value, const Field *field, void *target,
                      const char *pointer) {
    if (!json_is_array(value)) {
        refuse_type(reader, pointer, value, field, "an array of objects");
        return;
    }
    const size_t count = json_array_size(value);
    if (count == 0 || !allows_length(reader, value, field, count, "elements", pointer))
        return;
    List list = {calloc(count, field->size), 0};
    if (list.at == NULL) {
        out_of_memory(reader);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        void *element = (char *)list.at + i * field->size;
        list.count = i + 1;
        if (fields_default(field->fields, element) != STATUS_OK) {
            out_of_memory(reader);
            break;
        }
        char place[POINTER_SIZE];
        pointer_index(place, sizeof place, pointer, i);
        const json_t *object = json_array_get(value, i);
        if (json_is_object(object))
            read_object(reader, object, field->fields, element, place, NULL, NULL);
        else
            refuse_type(reader, place, object, NULL, "an object");
    }
    // A typed twin of List is written as bytes, as field.c reads it. Lists have no default elements
    // to free.
    memcpy(target, &list, sizeof list);
}

// --- objects
// ---------------------------------------------------------------------------------------------

// A string under a shorthand is short for an object of that one member.
static void read_item(Reader *reader, const json_t *value, const Field *field, void *target,
                      const char *pointer) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    const bool is_short = json_is_string(value) && field->shorthand != NULL;
    if (json_is_null(value) && takes_null) {
        fields_clear(field->fields, target);
        return;
    }
    if (!json_is_object(value) && !is_short) {
        refuse_type(reader, pointer, value, NULL,
                    takes_null                 ? "an object or null"
                    : field->shorthand != NULL ? "an object or a string"
                                               : "an object");
        return;
    }
    // What stays absent as a whole has its members' defaults only once it is there.
    if (field->presence != PRESENCE_DEFAULT && fields_default(field->fields, target) != STATUS_OK) {
        out_of_memory(reader);
    } else if (is_short) {
        size_t offset = 0;
        const Field *row = fields_find(field->fields, field->shorthand, &offset);
        read_text(reader, value, row, (char **)(void *)((char *)target + offset + row->offset),
                  pointer);
    } else {
        read_object(reader, value, field->fields, target, pointer, NULL, NULL);
    }
}

// The kind that the tag names. Where it names none that is told, and *is_known false: the kind is
// then the nearest, or NULL where none is near.
static const Kind *read_kind(Reader *reader, const json_t *object, const KindTable *kinds,
                             const char *pointer, bool *is_known) {
    const json_t *tag = json_object_get(object, kinds->tag);
    *is_known = true;
    if (tag == NULL)
        return kinds->at(0);
    const Kind *kind = json_is_string(tag) ? kind_find(kinds, json_string_value(tag)) : NULL;
    if (kind != NULL)
        return kind;
    *is_known = false;
    char place[POINTER_SIZE];
    pointer_join(place, sizeof place, pointer, kinds->tag);
    if (!json_is_string(tag)) {
        refuse_type(reader, place, tag, NULL, "a string");
        return NULL;
    }
    const char *names[KINDS_SHOWN + 1] = {NULL};
    for (size_t i = 0; i < KINDS_SHOWN && kinds->at(i) != NULL; i++)
        names[i] = kinds->at(i)->name;
    const char *meant = refuse_name(reader, place, tag, names);
    return meant != NULL ? kind_find(kinds, meant) : NULL;
}

// Under a kind that was not named rightly its members are read all the same, so that they are not
// said to be missing, but nothing is said against them.
static void read_variant(Reader *reader, const json_t *value, const Field *field, Variant **target,
                         const char *pointer) {
    if (!json_is_object(value)) {
        refuse_type(reader, pointer, value, NULL, "an object");
        return;
    }
    bool is_known;
    const Kind *kind = read_kind(reader, value, field->kinds, pointer, &is_known);
    Variant *variant = variant_new(kind != NULL ? kind : field->kinds->at(0));
    if (variant == NULL) {
        out_of_memory(reader);
        return;
    }
    variant_free(*target);
    *target = variant;
    Reader silent = {0};
    read_object(is_known ? reader : &silent, value, variant->kind->fields, variant, pointer,
                field->kinds->tag, NULL);
    if (silent.is_out_of_memory)
        out_of_memory(reader);
}

static void read_value(Reader *reader, const json_t *value, const Field *field, void *member,
                       const char *pointer) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        if (json_is_number(value))
            *(double *)member = number_of(value);
        else
            refuse_type(reader, pointer, value, field, "a number");
        break;
    case FIELD_KIND_COUNT:
        read_count(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_FLAG:
        if (json_is_boolean(value))
            *(bool *)member = json_is_true(value);
        else
            refuse_type(reader, pointer, value, field, "true or false");
        break;
    case FIELD_KIND_TEXT:
        read_text(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_CHOICE:
        read_choice(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_REALS:
        read_reals(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_TEXTS:
        read_texts(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_LIST:
        read_list(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_ITEM:
        read_item(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_VARIANT:
        read_variant(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_BASE:
    case FIELD_KIND_END:
        break;
    }
}

static bool texts_hold(const char *const *texts, const char *text) {
    for (; texts != NULL && *texts != NULL; texts++)
        if (strcmp(*texts, text) == 0)
            return true;
    return false;
}

// The nearest row's name, else the tag if that is near.
static const char *nearest_key(const Field *fields, const char *tag, const char *key) {
    const char *meant = fields_nearest(fields, key);
    return meant != NULL || tag == NULL ? meant
                                        : texts_nearest((const char *const[]){tag, NULL}, key);
}

// Keys equal to `tag` and those in `extra` are passed over; both may be NULL.
static void read_object(Reader *reader, const json_t *object, const Field *fields, void *item,
                        const char *pointer, const char *tag, const char *const *extra) {
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)object, key, value) {
        if ((tag != NULL && strcmp(tag, key) == 0) || texts_hold(extra, key))
            continue;
        size_t offset = 0;
        const Field *field = fields_find(fields, key, &offset);
        if (field == NULL &&
            !(reader->problem != NULL && reader->problem->count < PROBLEM_FAULTS)) {
            wants_detail(reader);
            continue;
        }
        char place[POINTER_SIZE];
        pointer_join(place, sizeof place, pointer, key);
        if (field == NULL)
            refuse(reader, place, value, NULL, nearest_key(fields, tag, key), "unknown key");
        else
            read_value(reader, value, field, (char *)item + offset + field->offset, place);
    }
}

// --- the document
// ----------------------------------------------------------------------------------------

static Status unreadable(Problem *problem, const char *text, size_t size, size_t position,
                         const char *sentence) {
    ScanPlace place;
    scan_place(text, size, position, &place);
    return problem_add(problem, STATUS_UNREADABLE, place.pointer, "line %zu, column %zu: %s",
                       place.line, place.column, sentence);
}

static Status refuse_parse(Problem *problem, const char *text, size_t size,
                           const json_error_t *error) {
    // The parser's position is behind the token it stumbled over; ours is the token's last byte. A
    // byte that is no UTF-8 it does not get to pass.
    size_t position = error->position > 0 ? (size_t)error->position : 0;
    if (position > 0 && json_error_code(error) != json_error_invalid_utf8)
        position--;
    const char *sentence = error->text;
    switch (json_error_code(error)) {
    case json_error_out_of_memory:
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
    case json_error_duplicate_key:
        sentence = "the key stands twice in its object";
        break;
    case json_error_numeric_overflow:
        sentence = "the number is too large: reals go to 1.797e308, whole numbers to "
                   "9223372036854775807";
        break;
    case json_error_premature_end_of_input:
        sentence = "the document ends before it is complete";
        break;
    case json_error_end_of_input_expected:
        sentence = "the document is complete before this; nothing may follow";
        break;
    case json_error_invalid_utf8:
        sentence = "the text is not UTF-8 here";
        break;
    case json_error_null_character:
        sentence = "\\u0000 is not allowed";
        break;
    case json_error_null_byte_in_key:
        sentence = "\\u0000 is not allowed in a key";
        break;
    default:
        break;
    }
    return unreadable(problem, text, size, position, sentence);
}

Status read_json_beside(const char *text, size_t size, const Field *fields, void *item,
                        const char *const *extra, Problem *problem) {
    if (fields_default(fields, item) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
    size_t position;
    const char *sentence;
    if (!scan_allows(text, size, &position, &sentence))
        return unreadable(problem, text, size, position, sentence);
    json_error_t error;
    json_t *root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    if (root == NULL)
        return refuse_parse(problem, text, size, &error);
    Reader reader = {.problem = problem};
    if (json_is_object(root))
        read_object(&reader, root, fields, item, "", NULL, extra);
    else
        unreadable(problem, text, size, 0, "the document must be an object, is an array");
    const bool is_object = json_is_object(root);
    json_decref(root);
    if (reader.is_out_of_memory)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
    return !is_object ? STATUS_UNREADABLE : reader.is_faulty ? STATUS_INVALID : STATUS_OK;
}

Status read_json(const char *text, size_t size, const Field *fields, void *item, Problem *problem) {
    return read_json_beside(text, size, fields, item, NULL, problem);
}
