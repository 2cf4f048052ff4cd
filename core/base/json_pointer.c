// A walk along the tokens: rows are found by name, elements by number, and the tag of a variant
// stands beside the members of its kind.
#include "core/base/json_pointer.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TOKEN = 64, NAMES = 64 };

// What a pointer leads to.
typedef struct Place {
    const Field *field;
    void *member;    // the row's member; of an array's element that double
    bool is_element; // of REALS or ROWS
    bool is_tag;     // `member` is the Variant *
    char **name;     // the shorthand's text of the item around it, or NULL
    void *around;    // that item
    const Field *item;
} Place;

// Takes the token behind the slash off the pointer. False where it is too long to be a name here.
static bool take_token(const char **pointer, char token[TOKEN]) {
    size_t length = 0;
    const char *at = *pointer + 1;
    for (; *at != '\0' && *at != '/'; at++) {
        char c = *at;
        if (c == '~') {
            c = at[1] == '0' ? '~' : at[1] == '1' ? '/' : '\0';
            if (c == '\0')
                return false;
            at++;
        }
        if (length + 1 >= TOKEN)
            return false;
        token[length++] = c;
    }
    token[length] = '\0';
    *pointer = at;
    return true;
}

static bool read_index(const char *token, size_t count, size_t *index) {
    if (token[0] < '0' || token[0] > '9' || (token[0] == '0' && token[1] != '\0') ||
        strlen(token) > 9)
        return false;
    char *end;
    *index = strtoul(token, &end, 10);
    return *end == '\0' && *index < count;
}

static bool refuse(char why[POINTER_SENTENCE], const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static bool refuse(char why[POINTER_SENTENCE], const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, POINTER_SENTENCE, format, arguments);
    va_end(arguments);
    return false;
}

static bool refuse_name(const Field *fields, const char *token, const char *of,
                        char why[POINTER_SENTENCE]) {
    const char *near = fields_nearest(fields, token);
    return refuse(why, "there is no \"%s\" in %s%s%s%s", token, of,
                  near != NULL ? ": perhaps " : "", near != NULL ? near : "",
                  near != NULL ? " is meant" : "");
}

static bool element(const Reals *reals, const char *token, const char *of, void **member,
                    char why[POINTER_SENTENCE]) {
    size_t index;
    if (!read_index(token, reals->count, &index))
        return refuse(why, "%s has elements 0 to %zu, \"%s\" is none of them", of,
                      reals->count > 0 ? reals->count - 1 : 0, token);
    *member = &reals->at[index];
    return true;
}

// Below a row that is no leaf; the place is what was reached so far.
static bool go_into(Place *place, const Field *field, void *member, const char *pointer,
                    char why[POINTER_SENTENCE]);

static bool go_on(Place *place, const Field *fields, void *item, const KindTable *kinds,
                  Variant **variant, const char *pointer, const char *of,
                  char why[POINTER_SENTENCE]) {
    char token[TOKEN];
    if (*pointer != '/')
        return refuse(why, "must begin with a slash, as in /dampers/0/clearance");
    if (!take_token(&pointer, token))
        return refuse(why, "a part of it is too long, or ~ stands without 0 or 1 behind it");
    if (kinds != NULL && strcmp(token, kinds->tag) == 0) {
        if (*pointer != '\0')
            return refuse(why, "%s is a name: nothing lies below it", token);
        place->is_tag = true;
        place->member = variant;
        return true;
    }
    size_t offset = 0;
    const Field *field = fields_find(fields, token, &offset);
    if (field == NULL)
        return refuse_name(fields, token, of, why);
    void *member = (char *)item + offset + field->offset;
    if (*pointer != '\0')
        return go_into(place, field, member, pointer, why);
    place->field = field;
    place->member = member;
    return true;
}

static bool go_into(Place *place, const Field *field, void *member, const char *pointer,
                    char why[POINTER_SENTENCE]) {
    char token[TOKEN];
    List list;
    size_t index;
    switch (field->kind) {
    case FIELD_KIND_ITEM: {
        size_t offset = 0;
        const Field *name =
            field->shorthand != NULL ? fields_find(field->fields, field->shorthand, &offset) : NULL;
        if (name != NULL) {
            place->name = (char **)(void *)((char *)member + offset + name->offset);
            place->around = member;
            place->item = field;
        }
        return go_on(place, field->fields, member, NULL, NULL, pointer, field->name, why);
    }
    case FIELD_KIND_VARIANT: {
        Variant **variant = member;
        if (*variant == NULL)
            return refuse(why, "the scene has no %s", field->name);
        place->field = field;
        return go_on(place, (*variant)->kind->fields, *variant, field->kinds, variant, pointer,
                     (*variant)->kind->name, why);
    }
    case FIELD_KIND_LIST:
        memcpy(&list, member, sizeof list);
        if (!take_token(&pointer, token) || !read_index(token, list.count, &index))
            return refuse(why, "the scene has %zu %s: \"%s\" is none of them", list.count,
                          field->name, token);
        if (*pointer == '\0')
            return refuse(why, "one value cannot replace an element of %s: name a member of it",
                          field->name);
        return go_on(place, field->fields, (char *)list.at + index * field->size, NULL, NULL,
                     pointer, field->name, why);
    case FIELD_KIND_ROWS: {
        const Rows *rows = member;
        if (!take_token(&pointer, token) || !read_index(token, rows->count, &index) ||
            *pointer == '\0')
            return refuse(why, "%s has %zu rows: name a row and a column, %s/0/0", field->name,
                          rows->count, field->name);
        member = &rows->at[index];
    } // fall through
    case FIELD_KIND_REALS:
        if (!take_token(&pointer, token) || *pointer != '\0')
            return refuse(why, "nothing lies below an element of %s", field->name);
        place->field = field;
        place->is_element = true;
        return element(member, token, field->name, &place->member, why);
    default:
        return refuse(why, "nothing lies below %s", field->name);
    }
}

// Whether one value can stand there.
static bool takes_value(const Place *place) {
    if (place->is_tag || place->is_element)
        return true;
    switch (place->field->kind) {
    case FIELD_KIND_REAL:
    case FIELD_KIND_COUNT:
    case FIELD_KIND_FLAG:
    case FIELD_KIND_TEXT:
    case FIELD_KIND_CHOICE:
        return (place->field->flags & FIELD_NOTE) == 0;
    case FIELD_KIND_REALS:
        return (place->field->flags & FIELD_LONE) != 0;
    case FIELD_KIND_ITEM:
        return place->field->shorthand != NULL;
    default:
        return false;
    }
}

static bool find(const Field *fields, const void *item, const char *pointer, Place *place,
                 char why[POINTER_SENTENCE]) {
    *place = (Place){0};
    if (!go_on(place, fields, (void *)item, NULL, NULL, pointer, "the scene", why))
        return false;
    if (takes_value(place))
        return true;
    return refuse(why, "one value cannot replace %s: name a member of it", place->field->name);
}

const Field *pointer_find(const Field *fields, const void *item, const char *pointer, bool *is_tag,
                          char why[POINTER_SENTENCE]) {
    Place place;
    const bool is_found = find(fields, item, pointer, &place, why);
    *is_tag = is_found && place.is_tag;
    return is_found ? place.field : NULL;
}

static const char *kind_name(const Scalar *value) {
    static const char *const names[] = {"a number", "a text", "true or false"};
    return names[value->kind];
}

static Status refuse_kind(const char *wanted, const Field *field, const Scalar *value,
                          char why[POINTER_SENTENCE]) {
    refuse(why, "must be %s%s%s%s, is %s", wanted, field->unit != NULL ? " [" : "",
           field->unit != NULL ? field->unit : "", field->unit != NULL ? "]" : "",
           kind_name(value));
    return STATUS_INVALID;
}

// The names of choices or kinds, as far as they fit.
static Status refuse_text(const char *const *names, const char *text, char why[POINTER_SENTENCE]) {
    char list[POINTER_SENTENCE / 2] = "";
    for (size_t i = 0, length = 0; names[i] != NULL && length < sizeof list; i++)
        length += (size_t)snprintf(list + length, sizeof list - length, "%s%s", i > 0 ? ", " : "",
                                   names[i]);
    refuse(why, "must be one of %s, is \"%.40s\"", list, text);
    return STATUS_INVALID;
}

static Status set_text(char **target, const char *text) {
    char *copy = strdup(text);
    if (copy == NULL)
        return STATUS_NO_MEMORY;
    free(*target);
    *target = copy;
    return STATUS_OK;
}

// Members of the same name and kind stay as they are.
static Status take_over(const Variant *source, Variant *target) {
    for (const Field *field = target->kind->fields; field->kind != FIELD_KIND_END; field++) {
        const Field *at = field->kind == FIELD_KIND_BASE ? field->fields : field;
        const size_t base = field->kind == FIELD_KIND_BASE ? field->offset : 0;
        for (; at->kind != FIELD_KIND_END; at++) {
            size_t offset = 0;
            const Field *from = fields_find(source->kind->fields, at->name, &offset);
            if (from != NULL && from->kind == at->kind && from->fields == at->fields &&
                from->kinds == at->kinds && from->choices == at->choices) {
                Field one[] = {*at, FIELD_END};
                one[0].offset = 0;
                char *to = (char *)target + base + at->offset;
                fields_clear(one, to);
                TRY(fields_copy(one, (const char *)source + offset + from->offset, to));
            }
            if (field->kind != FIELD_KIND_BASE)
                break;
        }
    }
    return STATUS_OK;
}

static Status set_kind(const KindTable *kinds, Variant **variant, const Scalar *value,
                       const Field *field, char why[POINTER_SENTENCE]) {
    if (value->kind != SCALAR_TEXT)
        return refuse_kind("the name of a kind", field, value, why);
    const Kind *kind = kind_find(kinds, value->text);
    if (kind == NULL) {
        const char *names[NAMES + 1] = {NULL};
        for (size_t i = 0; i < NAMES && kinds->at(i) != NULL; i++)
            names[i] = kinds->at(i)->name;
        return refuse_text(names, value->text, why);
    }
    if (kind == (*variant)->kind)
        return STATUS_OK;
    Variant *made = variant_new(kind);
    if (made == NULL || take_over(*variant, made) != STATUS_OK) {
        variant_free(made);
        return STATUS_NO_MEMORY;
    }
    variant_free(*variant);
    *variant = made;
    return STATUS_OK;
}

// The whole item is what its name says from now on.
static Status set_name(const Field *field, void *item, char **name, const Scalar *value,
                       char why[POINTER_SENTENCE]) {
    if (value->kind != SCALAR_TEXT)
        return refuse_kind("a name", field, value, why);
    if (fields_default(field->fields, item) != STATUS_OK)
        return STATUS_NO_MEMORY;
    return set_text(name, value->text);
}

static Status set_member(const Field *field, void *member, const Scalar *value,
                         char why[POINTER_SENTENCE]) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        if (value->kind != SCALAR_NUMBER)
            return refuse_kind("a number", field, value, why);
        *(double *)member = value->number;
        return STATUS_OK;
    case FIELD_KIND_COUNT:
        if (value->kind != SCALAR_NUMBER || value->whole == COUNT_ABSENT) {
            char is[32];
            if (value->kind != SCALAR_NUMBER)
                return refuse_kind("a whole number", field, value, why);
            refuse(why, "must be a whole number of at least 0, is %s",
                   text_real(is, value->number));
            return STATUS_INVALID;
        }
        *(uint64_t *)member = value->whole;
        return STATUS_OK;
    case FIELD_KIND_FLAG:
        if (value->kind != SCALAR_FLAG)
            return refuse_kind("true or false", field, value, why);
        *(bool *)member = value->flag;
        return STATUS_OK;
    case FIELD_KIND_TEXT:
        return value->kind != SCALAR_TEXT ? refuse_kind("a text", field, value, why)
                                          : set_text(member, value->text);
    case FIELD_KIND_CHOICE:
        if (value->kind != SCALAR_TEXT)
            return refuse_kind("a name", field, value, why);
        for (int i = 0; field->choices[i] != NULL; i++)
            if (strcmp(field->choices[i], value->text) == 0) {
                *(int *)member = i;
                return STATUS_OK;
            }
        return refuse_text(field->choices, value->text, why);
    case FIELD_KIND_REALS: {
        Reals *reals = member;
        if (value->kind != SCALAR_NUMBER)
            return refuse_kind("a number", field, value, why);
        double *at = malloc(sizeof *at);
        if (at == NULL)
            return STATUS_NO_MEMORY;
        *at = value->number;
        free(reals->at);
        *reals = (Reals){at, 1};
        return STATUS_OK;
    }
    default:
        return STATUS_INTERNAL;
    }
}

Status pointer_set(const Field *fields, void *item, const char *pointer, const Scalar *value,
                   char why[POINTER_SENTENCE]) {
    Place place;
    why[0] = '\0';
    if (!find(fields, item, pointer, &place, why))
        return STATUS_INVALID;
    if (place.is_tag)
        return set_kind(place.field->kinds, place.member, value, place.field, why);
    if (place.is_element) {
        if (value->kind != SCALAR_NUMBER)
            return refuse_kind("a number", place.field, value, why);
        *(double *)place.member = value->number;
        return STATUS_OK;
    }
    if (place.field->kind == FIELD_KIND_ITEM) {
        size_t offset = 0;
        const Field *name = fields_find(place.field->fields, place.field->shorthand, &offset);
        char **text = (char **)(void *)((char *)place.member + offset + name->offset);
        if (value->kind == SCALAR_TEXT)
            fields_clear(place.field->fields, place.member);
        return set_name(place.field, place.member, text, value, why);
    }
    if (place.name != NULL && place.member == (void *)place.name) {
        if (value->kind == SCALAR_TEXT)
            fields_clear(place.item->fields, place.around);
        return set_name(place.item, place.around, place.name, value, why);
    }
    TRY(set_member(place.field, place.member, value, why));
    if (place.name != NULL) {
        free(*place.name);
        *place.name = NULL;
    }
    return STATUS_OK;
}
