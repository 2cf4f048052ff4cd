// The walk goes by the document's keys, so that every unknown one is met; what is missing is
// fields_validate's to say. What cannot be read leaves its member as it was.
#include "server/json/decode.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "server/json/decode_arrays.h"
#include "server/util/dtoa.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer), KINDS_SHOWN = 64 };

static void walk_members(Decoder *reader, const json_t *object, const Field *fields, void *item,
                         const char *pointer, const KindTable *kinds);

static void read_count(Decoder *reader, const json_t *value, const Field *field, uint64_t *target,
                       const char *pointer) {
    if (!json_is_number(value)) {
        decode_error_type(reader, pointer, value, field, "a whole number");
        return;
    }
    if (json_is_integer(value) && json_integer_value(value) >= 0) {
        *target = (uint64_t)json_integer_value(value);
        return;
    }
    const double number = decode_number(value);
    if (number >= 0 && number < 0x1p63 && floor(number) == number) {
        *target = (uint64_t)number;
        return;
    }
    char least[32], most[32], is[SHORTEST_SIZE + 1];
    text_real(least, field->range.min > 0 ? field->range.min : 0);
    text_real(most, field->range.max < 0x1p63 ? field->range.max : 0x1p63);
    decode_error_text(value, is, sizeof is);
    if (isinf(field->range.max))
        decode_error_value(reader, pointer, value, field->unit, NULL,
                           "must be a whole number of at least %s, is %s", least, is);
    else
        decode_error_value(reader, pointer, value, field->unit, NULL,
                           "must be a whole number within [%s, %s], is %s", least, most, is);
}

static void read_text(Decoder *reader, const json_t *value, const Field *field, char **target,
                      const char *pointer) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    if (!json_is_string(value) && !(takes_null && json_is_null(value))) {
        decode_error_type(reader, pointer, value, field,
                          takes_null ? "a string or null" : "a string");
        return;
    }
    const size_t length = json_string_length(value);
    if (field->max > 0 && length > field->max) {
        decode_error_value(reader, pointer, value, NULL, NULL,
                           "must have at most %zu bytes, has %zu", field->max, length);
        return;
    }
    char *text = strdup(json_is_null(value) ? "" : json_string_value(value));
    if (text == NULL) {
        decode_no_memory(reader);
        return;
    }
    free(*target);
    *target = text;
}

static void read_choice(Decoder *reader, const json_t *value, const Field *field, int *target,
                        const char *pointer) {
    if (!json_is_string(value)) {
        decode_error_type(reader, pointer, value, field, "a string");
        return;
    }
    for (int i = 0; field->choices[i] != NULL; i++) {
        if (strcmp(field->choices[i], json_string_value(value)) == 0) {
            *target = i;
            return;
        }
    }
    decode_error_name(reader, pointer, value, field->choices);
}

static void read_list(Decoder *reader, const json_t *value, const Field *field, void *target,
                      const char *pointer) {
    if (!json_is_array(value)) {
        decode_error_type(reader, pointer, value, field, "an array of objects");
        return;
    }
    const size_t count = json_array_size(value);
    if (count == 0 || !decode_allows(reader, value, field, count, "elements", pointer))
        return;
    List list = {calloc(count, field->size), 0};
    if (list.at == NULL) {
        decode_no_memory(reader);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        void *element = (char *)list.at + i * field->size;
        list.count = i + 1;
        if (fields_default(field->fields, element) != STATUS_OK) {
            decode_no_memory(reader);
            break;
        }
        char place[POINTER_SIZE];
        json_pointer_index(place, sizeof place, pointer, i);
        const json_t *object = json_array_get(value, i);
        if (json_is_object(object))
            decode_object(reader, object, field->fields, element, place);
        else
            decode_error_type(reader, place, object, NULL, "an object");
    }
    // A typed twin of List is written as bytes, as field.c reads it. Lists have no default elements
    // to free.
    memcpy(target, &list, sizeof list);
}

// A string under a shorthand is short for an object of that one member.
static void read_item(Decoder *reader, const json_t *value, const Field *field, void *target,
                      const char *pointer) {
    const bool takes_null = (field->flags & FIELD_NULL_IS_EMPTY) != 0;
    const bool is_short = json_is_string(value) && field->shorthand != NULL;
    if (json_is_null(value) && takes_null) {
        fields_clear(field->fields, target);
        return;
    }
    if (!json_is_object(value) && !is_short) {
        decode_error_type(reader, pointer, value, NULL,
                          takes_null                 ? "an object or null"
                          : field->shorthand != NULL ? "an object or a string"
                                                     : "an object");
        return;
    }
    // What stays absent as a whole has its members' defaults only once it is there.
    if (field->presence != PRESENCE_DEFAULT && fields_default(field->fields, target) != STATUS_OK) {
        decode_no_memory(reader);
    } else if (is_short) {
        size_t offset = 0;
        const Field *row = fields_find(field->fields, field->shorthand, &offset);
        read_text(reader, value, row, (char **)(void *)((char *)target + offset + row->offset),
                  pointer);
    } else {
        decode_object(reader, value, field->fields, target, pointer);
    }
}

// The kind that the tag names. Where it names none that is told, and *is_known false: the kind is
// then the nearest, or NULL where none is near.
static const Kind *read_kind(Decoder *reader, const json_t *object, const KindTable *kinds,
                             const char *pointer, bool *is_known) {
    const json_t *tag = json_object_get(object, kinds->tag);
    *is_known = true;
    if (tag == NULL && !kinds->is_named)
        return kinds->at(0);
    const Kind *kind = json_is_string(tag) ? kind_find(kinds, json_string_value(tag)) : NULL;
    if (kind != NULL)
        return kind;
    *is_known = false;
    char place[POINTER_SIZE];
    json_pointer_join(place, sizeof place, pointer, kinds->tag);
    const char *names[KINDS_SHOWN + 1] = {NULL};
    for (size_t i = 0; i < KINDS_SHOWN && kinds->at(i) != NULL; i++)
        names[i] = kinds->at(i)->name;
    if (tag == NULL) {
        decode_error_unnamed(reader, place, names);
        return NULL;
    }
    if (!json_is_string(tag)) {
        decode_error_type(reader, place, tag, NULL, "a string");
        return NULL;
    }
    const char *meant = decode_error_name(reader, place, tag, names);
    return meant != NULL ? kind_find(kinds, meant) : NULL;
}

// Under a kind that was not named rightly its members are read all the same, so that they are not
// said to be missing, but nothing is said against them.
static void read_variant(Decoder *reader, const json_t *value, const Field *field, Variant **target,
                         const char *pointer) {
    if (!json_is_object(value)) {
        decode_error_type(reader, pointer, value, NULL, "an object");
        return;
    }
    bool is_known;
    const Kind *kind = read_kind(reader, value, field->kinds, pointer, &is_known);
    Variant *variant = variant_new(kind != NULL ? kind : field->kinds->at(0));
    if (variant == NULL) {
        decode_no_memory(reader);
        return;
    }
    variant_free(*target);
    *target = variant;
    Decoder silent = {0};
    walk_members(is_known ? reader : &silent, value, variant->kind->fields, variant, pointer,
                 field->kinds);
    if (silent.is_out_of_memory)
        decode_no_memory(reader);
}

static void read_value(Decoder *reader, const json_t *value, const Field *field, void *member,
                       const char *pointer) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        if (json_is_number(value))
            *(double *)member = decode_number(value);
        else
            decode_error_type(reader, pointer, value, field, "a number");
        break;
    case FIELD_KIND_COUNT:
        read_count(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_FLAG:
        if (json_is_boolean(value))
            *(bool *)member = json_is_true(value);
        else
            decode_error_type(reader, pointer, value, field, "true or false");
        break;
    case FIELD_KIND_TEXT:
        read_text(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_CHOICE:
        read_choice(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_REALS:
        decode_reals(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_ROWS:
        decode_rows(reader, value, field, member, pointer);
        break;
    case FIELD_KIND_TEXTS:
        decode_texts(reader, value, field, member, pointer);
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
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
}

// Says which kinds have the key, where `own`, the default perhaps, has not.
static void refuse_key(Decoder *reader, const char *pointer, const json_t *value, const char *key,
                       const Field *fields, const KindTable *kinds, const Kind *own) {
    char others[sizeof((Fault){0}.detail)] = "";
    size_t length = 0;
    const Kind *kind;
    for (size_t i = 0; kinds != NULL && (kind = kinds->at(i)) != NULL; i++)
        if (length < sizeof others && fields_find(kind->fields, key, NULL) != NULL)
            length += (size_t)snprintf(others + length, sizeof others - length, "%s%s",
                                       length > 0 ? ", " : "", kind->name);
    if (length > 0) {
        decode_error_value(reader, pointer, value, NULL, NULL,
                           "unknown key of %s %s; it belongs to %s %s", kinds->tag, own->name,
                           kinds->tag, others);
        return;
    }
    const char *meant = spelling_nearest_field(fields, key);
    if (meant == NULL && kinds != NULL)
        meant = spelling_nearest((const char *const[]){kinds->tag, NULL}, key);
    decode_error_value(reader, pointer, value, NULL, meant, "unknown key");
}

// `kinds`: those of a variant, which `item` then is and whose tag is passed over; else NULL.
static void walk_members(Decoder *reader, const json_t *object, const Field *fields, void *item,
                         const char *pointer, const KindTable *kinds) {
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)object, key, value) {
        if (kinds != NULL && strcmp(kinds->tag, key) == 0)
            continue;
        size_t offset = 0;
        const Field *field = fields_find(fields, key, &offset);
        if (field == NULL && !decode_error_has_detail(reader))
            continue;
        char place[POINTER_SIZE];
        json_pointer_join(place, sizeof place, pointer, key);
        if (field == NULL)
            refuse_key(reader, place, value, key, fields, kinds,
                       kinds != NULL ? ((const Variant *)item)->kind : NULL);
        else
            read_value(reader, value, field, (char *)item + offset + field->offset, place);
    }
}

void decode_object(Decoder *reader, const json_t *object, const Field *fields, void *item,
                   const char *pointer) {
    walk_members(reader, object, fields, item, pointer, NULL);
}

void decode_value(Decoder *reader, const json_t *value, const Field *field, void *item,
                  const char *pointer) {
    read_value(reader, value, field, (char *)item + field->offset, pointer);
}
