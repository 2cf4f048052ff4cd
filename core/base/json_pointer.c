// The tokens of a pointer are resolved in turn: rows by name, elements by number. The tag of a
// variant is a name among the members of its kind.
#include "core/base/json_pointer.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"

enum { TOKEN = 64, NAMES = 64 };

// The member that a pointer designates.
typedef struct PointerTarget {
    const Field *field;
    void *member;    // the row's member, or the double of an array
    bool is_element; // element of REALS or ROWS
    bool is_tag;     // `member` is the Variant *
    char **name;     // shorthand text of the enclosing item, or NULL
    void *around;    // the enclosing item
    const Field *item;
} PointerTarget;

// Reads the token after the slash and advances the pointer. False if it is longer than any name.
static bool json_pointer_next_token(const char **pointer, char token[TOKEN]) {
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

static bool json_pointer_read_index(const char *token, size_t count, size_t *index) {
    if (token[0] < '0' || token[0] > '9' || (token[0] == '0' && token[1] != '\0') ||
        strlen(token) > 9)
        return false;
    char *end;
    *index = strtoul(token, &end, 10);
    return *end == '\0' && *index < count;
}

static bool json_pointer_fail(char message[JSON_POINTER_MESSAGE_MAX], const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static bool json_pointer_fail(char message[JSON_POINTER_MESSAGE_MAX], const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, JSON_POINTER_MESSAGE_MAX, format, arguments);
    va_end(arguments);
    return false;
}

static bool json_pointer_fail_name(const Field *fields, const char *token, const char *of,
                                   char message[JSON_POINTER_MESSAGE_MAX]) {
    const char *near = spelling_nearest_field(fields, token);
    return json_pointer_fail(message, "there is no \"%s\" in %s%s%s%s", token, of,
                             near != NULL ? " (did you mean " : "", near != NULL ? near : "",
                             near != NULL ? "?)" : "");
}

static void json_pointer_note_shorthand(PointerTarget *target, const Field *field, void *member) {
    size_t offset = 0;
    const Field *name =
        field->shorthand != NULL ? fields_find(field->fields, field->shorthand, &offset) : NULL;
    if (name == NULL)
        return;
    target->name = (char **)(void *)((char *)member + offset + name->offset);
    target->around = member;
    target->item = field;
}

// Resolves the last one or two tokens, below an array.
static bool json_pointer_element(PointerTarget *target, const Field *field, void *member,
                                 const char *pointer, char message[JSON_POINTER_MESSAGE_MAX]) {
    char token[TOKEN];
    size_t index;
    if (field->kind == FIELD_KIND_ROWS) {
        const Rows *rows = member;
        if (!json_pointer_next_token(&pointer, token) ||
            !json_pointer_read_index(token, rows->count, &index) || *pointer == '\0')
            return json_pointer_fail(message, "%s has %zu rows: name a row and a column, %s/0/0",
                                     field->name, rows->count, field->name);
        member = &rows->at[index];
    }
    const Reals *reals = member;
    if (!json_pointer_next_token(&pointer, token) || *pointer != '\0')
        return json_pointer_fail(message, "there is nothing below an element of %s", field->name);
    if (!json_pointer_read_index(token, reals->count, &index))
        return json_pointer_fail(message, "%s has elements 0 to %zu, \"%s\" is none of them",
                                 field->name, reals->count > 0 ? reals->count - 1 : 0, token);
    target->field = field;
    target->is_element = true;
    target->member = &reals->at[index];
    return true;
}

static bool json_pointer_walk(PointerTarget *target, const Field *fields, void *item,
                              const char *pointer, char message[JSON_POINTER_MESSAGE_MAX]) {
    const char *of = "the scene";
    Variant **variant = NULL; // that `item` is, of target->field
    for (;;) {
        char token[TOKEN];
        size_t offset = 0, index;
        List list;
        if (*pointer != '/')
            return json_pointer_fail(message,
                                     "must begin with a slash, as in /dampers/0/clearance");
        if (!json_pointer_next_token(&pointer, token))
            return json_pointer_fail(message,
                                     "a part of it is too long, or ~ is not followed by 0 or 1");
        if (variant != NULL && strcmp(token, target->field->kinds->tag) == 0) {
            if (*pointer != '\0')
                return json_pointer_fail(message, "%s is a name: there is nothing below it", token);
            target->is_tag = true;
            target->member = variant;
            return true;
        }
        const Field *field = fields_find(fields, token, &offset);
        if (field == NULL)
            return json_pointer_fail_name(fields, token, of, message);
        void *member = (char *)item + offset + field->offset;
        if (field->kind == FIELD_KIND_ITEM)
            json_pointer_note_shorthand(target, field, member);
        target->field = field;
        target->member = member;
        if (*pointer == '\0')
            return true;
        fields = field->fields;
        item = member;
        of = field->name;
        variant = NULL;
        switch (field->kind) {
        case FIELD_KIND_ITEM:
            break;
        case FIELD_KIND_VARIANT:
            variant = member;
            if (*variant == NULL)
                return json_pointer_fail(message, "the scene has no %s", field->name);
            fields = (*variant)->kind->fields;
            item = *variant;
            of = (*variant)->kind->name;
            break;
        case FIELD_KIND_LIST:
            memcpy(&list, member, sizeof list);
            if (!json_pointer_next_token(&pointer, token) ||
                !json_pointer_read_index(token, list.count, &index))
                return json_pointer_fail(message, "the scene has %zu %s: \"%s\" is none of them",
                                         list.count, field->name, token);
            if (*pointer == '\0')
                return json_pointer_fail(
                    message, "one value cannot replace an element of %s: name a member of it",
                    field->name);
            item = (char *)list.at + index * field->size;
            break;
        case FIELD_KIND_REALS:
        case FIELD_KIND_ROWS:
            return json_pointer_element(target, field, member, pointer, message);
        default:
            return json_pointer_fail(message, "there is nothing below %s", field->name);
        }
    }
}

// The kinds of members that one scalar can replace, by which; `wanted` NULL: none can.
static const struct {
    JsonScalarKind scalar;
    const char *wanted;
} json_pointer_scalars[] = {
    [FIELD_KIND_REAL] = {JSON_SCALAR_NUMBER, "a number"},
    [FIELD_KIND_REALS] = {JSON_SCALAR_NUMBER, "a number"},
    [FIELD_KIND_COUNT] = {JSON_SCALAR_NUMBER, "a whole number"},
    [FIELD_KIND_FLAG] = {JSON_SCALAR_FLAG, "true or false"},
    [FIELD_KIND_TEXT] = {JSON_SCALAR_TEXT, "a text"},
    [FIELD_KIND_CHOICE] = {JSON_SCALAR_TEXT, "a name"},
    [FIELD_KIND_REFCOUNT] = {0}, // the last kind
};

static bool json_pointer_is_settable(const PointerTarget *target) {
    if (target->is_tag || target->is_element)
        return true;
    const Field *field = target->field;
    if (field->kind == FIELD_KIND_ITEM)
        return field->shorthand != NULL;
    if (field->kind == FIELD_KIND_REALS)
        return (field->flags & FIELD_LONE) != 0;
    return json_pointer_scalars[field->kind].wanted != NULL && (field->flags & FIELD_NOTE) == 0;
}

static bool json_pointer_resolve(const Field *fields, const void *item, const char *pointer,
                                 PointerTarget *target, char message[JSON_POINTER_MESSAGE_MAX]) {
    *target = (PointerTarget){0};
    if (!json_pointer_walk(target, fields, (void *)item, pointer, message))
        return false;
    if (json_pointer_is_settable(target))
        return true;
    return json_pointer_fail(message, "one value cannot replace %s: name a member of it",
                             target->field->name);
}

const Field *json_pointer_find(const Field *fields, const void *item, const char *pointer,
                               bool *is_tag, char message[JSON_POINTER_MESSAGE_MAX]) {
    PointerTarget target;
    const bool is_found = json_pointer_resolve(fields, item, pointer, &target, message);
    *is_tag = is_found && target.is_tag;
    return is_found ? target.field : NULL;
}

const Field *json_pointer_row(const Field *fields, const void *item, const char *pointer,
                              bool *is_tag, char message[JSON_POINTER_MESSAGE_MAX]) {
    PointerTarget target = {0};
    const bool is_found = json_pointer_walk(&target, fields, (void *)item, pointer, message);
    *is_tag = is_found && target.is_tag;
    return is_found ? target.field : NULL;
}

static Status json_pointer_fail_kind(const char *wanted, const Field *field,
                                     const JsonScalar *value,
                                     char message[JSON_POINTER_MESSAGE_MAX]) {
    static const char *const kinds[] = {"a number", "a text", "true or false"};
    json_pointer_fail(message, "must be %s%s%s%s, is %s", wanted, field->unit != NULL ? " [" : "",
                      field->unit != NULL ? field->unit : "", field->unit != NULL ? "]" : "",
                      kinds[value->kind]);
    return STATUS_INVALID;
}

// Lists the names of choices or kinds, as many as fit.
static Status json_pointer_fail_choice(const char *const *names, const char *text,
                                       char message[JSON_POINTER_MESSAGE_MAX]) {
    char list[JSON_POINTER_MESSAGE_MAX / 2] = "";
    for (size_t i = 0; names[i] != NULL; i++)
        text_list(list, sizeof list, names[i]);
    json_pointer_fail(message, "must be one of %s, is \"%.40s\"", list, text);
    return STATUS_INVALID;
}

static Status json_pointer_set_text(char **target, const char *text) {
    char *copy = strdup(text);
    if (copy == NULL)
        return STATUS_NO_MEMORY;
    free(*target);
    *target = copy;
    return STATUS_OK;
}

// Copies the members that have the same name and type in both kinds; `fields` are those of the
// target, or of a BASE of it.
static Status json_pointer_copy_common(const Variant *source, const Field *fields, void *target) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        void *to = (char *)target + field->offset;
        size_t offset = 0;
        const Field *from = fields_find(source->kind->fields, field->name, &offset);
        if (field->kind == FIELD_KIND_BASE)
            TRY(json_pointer_copy_common(source, field->fields, to));
        if (from == NULL || from->kind != field->kind || from->fields != field->fields ||
            from->kinds != field->kinds || from->choices != field->choices)
            continue;
        Field one[] = {*field, FIELD_END};
        one[0].offset = 0;
        fields_clear(one, to);
        TRY(fields_copy(one, (const char *)source + offset + from->offset, to));
    }
    return STATUS_OK;
}

static Status json_pointer_set_kind(const KindTable *kinds, Variant **variant,
                                    const JsonScalar *value, const Field *field,
                                    char message[JSON_POINTER_MESSAGE_MAX]) {
    if (value->kind != JSON_SCALAR_TEXT)
        return json_pointer_fail_kind("the name of a kind", field, value, message);
    const Kind *kind = kind_find(kinds, value->text);
    if (kind == NULL) {
        const char *names[NAMES + 1] = {NULL};
        for (size_t i = 0; i < NAMES && kinds->at(i) != NULL; i++)
            names[i] = kinds->at(i)->name;
        return json_pointer_fail_choice(names, value->text, message);
    }
    if (kind == (*variant)->kind)
        return STATUS_OK;
    Variant *made = variant_new(kind);
    if (made == NULL || json_pointer_copy_common(*variant, kind->fields, made) != STATUS_OK) {
        variant_free(made);
        return STATUS_NO_MEMORY;
    }
    variant_free(*variant);
    *variant = made;
    return STATUS_OK;
}

// Replaces the whole item by its shorthand name.
static Status json_pointer_set_name(const PointerTarget *target, const JsonScalar *value,
                                    char message[JSON_POINTER_MESSAGE_MAX]) {
    const Field *item = target->item;
    if (value->kind != JSON_SCALAR_TEXT)
        return json_pointer_fail_kind("a name", item, value, message);
    fields_clear(item->fields, target->around);
    if (fields_default(item->fields, target->around) != STATUS_OK)
        return STATUS_NO_MEMORY;
    return json_pointer_set_text(target->name, value->text);
}

static Status json_pointer_set_member(const Field *field, void *member, const JsonScalar *value,
                                      char message[JSON_POINTER_MESSAGE_MAX]) {
    if (value->kind != json_pointer_scalars[field->kind].scalar)
        return json_pointer_fail_kind(json_pointer_scalars[field->kind].wanted, field, value,
                                      message);
    switch (field->kind) {
    case FIELD_KIND_REAL:
        *(double *)member = value->number;
        return STATUS_OK;
    case FIELD_KIND_COUNT:
        if (value->whole == COUNT_ABSENT) {
            json_pointer_fail(message, "must be a whole number of at least 0, is %s",
                              real_text(value->number).at);
            return STATUS_INVALID;
        }
        *(uint64_t *)member = value->whole;
        return STATUS_OK;
    case FIELD_KIND_FLAG:
        *(bool *)member = value->flag;
        return STATUS_OK;
    case FIELD_KIND_TEXT:
        return json_pointer_set_text(member, value->text);
    case FIELD_KIND_CHOICE:
        for (int i = 0; field->choices[i] != NULL; i++)
            if (strcmp(field->choices[i], value->text) == 0) {
                *(int *)member = i;
                return STATUS_OK;
            }
        return json_pointer_fail_choice(field->choices, value->text, message);
    default: { // FIELD_KIND_REALS
        Reals *reals = member;
        free(reals->at);
        if (!reals_allocate(reals, 1))
            return STATUS_NO_MEMORY;
        reals->at[0] = value->number;
        return STATUS_OK;
    }
    }
}

Status json_pointer_set(const Field *fields, void *item, const char *pointer,
                        const JsonScalar *value, char message[JSON_POINTER_MESSAGE_MAX]) {
    PointerTarget target;
    message[0] = '\0';
    if (!json_pointer_resolve(fields, item, pointer, &target, message))
        return STATUS_INVALID;
    if (target.is_tag)
        return json_pointer_set_kind(target.field->kinds, target.member, value, target.field,
                                     message);
    if (target.is_element) {
        if (value->kind != JSON_SCALAR_NUMBER)
            return json_pointer_fail_kind("a number", target.field, value, message);
        *(double *)target.member = value->number;
        return STATUS_OK;
    }
    if (target.name != NULL &&
        (target.field == target.item || target.member == (void *)target.name))
        return json_pointer_set_name(&target, value, message);
    TRY(json_pointer_set_member(target.field, target.member, value, message));
    if (target.name != NULL) {
        free(*target.name);
        *target.name = NULL;
    }
    return STATUS_OK;
}

// Called for every member of every scene, hence plain loops instead of printf.
void json_pointer_join(char *target, size_t size, const char *pointer, const char *name) {
    // Longer than any pointer of a Fault; a name that is too long is truncated.
    char whole[3 * sizeof((Fault){0}.pointer)];
    const size_t buffer = sizeof whole - 3, own = strlen(pointer);
    size_t length = own < buffer / 2 ? own : buffer / 2;
    memcpy(whole, pointer, length);
    whole[length++] = '/';
    for (; *name != '\0' && length < buffer; name++) {
        if (*name == '~' || *name == '/') {
            whole[length++] = '~';
            whole[length++] = *name == '~' ? '0' : '1';
        } else {
            whole[length++] = *name;
        }
    }
    whole[length] = '\0';
    text_fit(target, size, whole);
}

void json_pointer_index(char *target, size_t size, const char *pointer, size_t index) {
    char digits[24], *name = digits + sizeof digits - 1;
    *name = '\0';
    do
        *--name = (char)('0' + index % 10);
    while ((index /= 10) > 0);
    json_pointer_join(target, size, pointer, name);
}

bool json_pointer_overlaps(const char *a, const char *b) {
    const size_t length = strlen(a) < strlen(b) ? strlen(a) : strlen(b);
    return strncmp(a, b, length) == 0 && (a[length] == '\0' || a[length] == '/') &&
           (b[length] == '\0' || b[length] == '/');
}

JsonPointer json_pointer_of(const char *pointer, const char *name) {
    JsonPointer place;
    json_pointer_join(place.at, sizeof place.at, pointer, name);
    return place;
}

JsonPointer json_pointer_at(const char *pointer, size_t index) {
    JsonPointer place;
    json_pointer_index(place.at, sizeof place.at, pointer, index);
    return place;
}

Status json_pointer_fault(Problem *problem, const char *pointer, const char *name,
                          const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    problem_add_arguments(problem, STATUS_INVALID, json_pointer_of(pointer, name).at, (double)NAN,
                          NULL, format, arguments);
    va_end(arguments);
    return STATUS_INVALID;
}

Status json_pointer_fault_real(Problem *problem, const char *pointer, const char *name,
                               double value, const char *unit, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    problem_add_arguments(problem, STATUS_INVALID, json_pointer_of(pointer, name).at, value, unit,
                          format, arguments);
    va_end(arguments);
    return STATUS_INVALID;
}

bool json_pointer_concerns(const Problem *problem, const char *pointer, const char *name) {
    return problem_concerns(problem, json_pointer_of(pointer, name).at);
}

JsonScalar json_scalar_number(double number) {
    const bool is_whole = number >= 0 && number < 0x1p63 && floor(number) == number;
    return (JsonScalar){.kind = JSON_SCALAR_NUMBER,
                        .number = number,
                        .whole = is_whole ? (uint64_t)number : COUNT_ABSENT};
}

static bool json_scalar_read_hex(const char *at, unsigned *code) {
    char digits[5] = "";
    memcpy(digits, at, strnlen(at, 4));
    char *end;
    *code = (unsigned)strtoul(digits, &end, 16);
    return end == digits + 4;
}

// Decodes the escape after a backslash. Returns its length in bytes, 0 if it is invalid.
static size_t json_scalar_read_escape(const char *json, char **to) {
    static const char from[] = "\"\\/bfnrt", meant[] = "\"\\/\b\f\n\r\t";
    const char *found = *json != '\0' ? strchr(from, *json) : NULL;
    unsigned code;
    if (found != NULL) {
        *(*to)++ = meant[found - from];
        return 1;
    }
    // The writer escapes only control characters this way.
    if (*json != 'u' || !json_scalar_read_hex(json + 1, &code) || code == 0 || code >= 0x80)
        return 0;
    *(*to)++ = (char)code;
    return 5;
}

static bool json_scalar_read_text(const char *json, char *buffer) {
    for (json++; *json != '"'; json++) {
        if (*json == '\0')
            return false;
        if (*json != '\\') {
            *buffer++ = *json;
            continue;
        }
        const size_t taken = json_scalar_read_escape(json + 1, &buffer);
        if (taken == 0)
            return false;
        json += taken;
    }
    *buffer = '\0';
    return json[1] == '\0';
}

bool json_scalar_read(const char *json, JsonScalar *value, char *buffer) {
    char *end;
    *value = (JsonScalar){.kind = JSON_SCALAR_FLAG, .flag = *json == 't'};
    if (strcmp(json, "true") == 0 || strcmp(json, "false") == 0)
        return true;
    if (*json == '"') {
        *value = (JsonScalar){.kind = JSON_SCALAR_TEXT, .text = buffer};
        return json_scalar_read_text(json, buffer);
    }
    const double number = strtod(json, &end);
    if (end == json || *end != '\0' || !isfinite(number))
        return false;
    *value = json_scalar_number(number);
    // Above 2^53 a double cannot represent every integer.
    if (value->whole != COUNT_ABSENT && strspn(json, "0123456789") == strlen(json))
        value->whole = strtoull(json, NULL, 10);
    return true;
}
