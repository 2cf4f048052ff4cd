// Each operation is a switch over the kind of a row. Members are accessed by offset; lists are
// copied with memcpy, because a typed list's pointer must not be read through another pointer type.
#include "core/base/field.h"

#include <stdlib.h>
#include <string.h>

const char *const field_flags[] = {"false", "true", NULL};

static void *field_member(const Field *field, const void *item) {
    return (char *)item + field->offset;
}

static List field_list(const void *member) {
    List list;
    memcpy(&list, member, sizeof list);
    return list;
}

// The rows of an element: those of a LIST, or one row for what an element of an array owns.
static const Field *field_element_rows(const Field *field) {
    static const Field number[] = {FIELD_END}, text[] = {{.kind = FIELD_KIND_TEXT}, FIELD_END};
    static const Field numbers[] = {{.kind = FIELD_KIND_REALS, .size = sizeof(double)}, FIELD_END};
    return field->kind == FIELD_KIND_REALS   ? number
           : field->kind == FIELD_KIND_ROWS  ? numbers
           : field->kind == FIELD_KIND_TEXTS ? text
                                             : field->fields;
}

static void *field_element(const Field *field, List list, size_t index) {
    return (char *)list.at + index * field->size;
}

// Of the members that own no other rows.
static const size_t field_sizes[] = {
    [FIELD_KIND_REAL] = sizeof(double),        [FIELD_KIND_COUNT] = sizeof(uint64_t),
    [FIELD_KIND_FLAG] = sizeof(bool),          [FIELD_KIND_TEXT] = sizeof(char *),
    [FIELD_KIND_CHOICE] = sizeof(int),         [FIELD_KIND_REALS] = sizeof(Reals),
    [FIELD_KIND_ROWS] = sizeof(Rows),          [FIELD_KIND_TEXTS] = sizeof(Texts),
    [FIELD_KIND_LIST] = sizeof(List),          [FIELD_KIND_VARIANT] = sizeof(Variant *),
    [FIELD_KIND_REFCOUNT] = sizeof(Refcount *)};

// Makes every member absent without freeing it.
static void fields_set_absent(const Field *fields, void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        void *member = field_member(field, item);
        switch (field->kind) {
        case FIELD_KIND_REAL:
            *(double *)member = (double)NAN;
            break;
        case FIELD_KIND_COUNT:
            *(uint64_t *)member = COUNT_ABSENT;
            break;
        case FIELD_KIND_CHOICE:
            *(int *)member = CHOICE_ABSENT;
            break;
        case FIELD_KIND_ITEM:
        case FIELD_KIND_BASE:
            fields_set_absent(field->fields, member);
            break;
        default: // false, NULL or no elements
            memset(member, 0, field_sizes[field->kind]);
            break;
        }
    }
}

static void fields_free(const Field *fields, void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        void *member = field_member(field, item);
        switch (field->kind) {
        case FIELD_KIND_TEXT:
            free(*(char **)member);
            break;
        case FIELD_KIND_REALS:
        case FIELD_KIND_ROWS:
        case FIELD_KIND_TEXTS:
        case FIELD_KIND_LIST: {
            const Field *rows = field_element_rows(field);
            const List list = field_list(member);
            for (size_t i = 0; i < list.count && rows->kind != FIELD_KIND_END; i++)
                fields_free(rows, field_element(field, list, i));
            free(list.at);
            break;
        }
        case FIELD_KIND_VARIANT:
            variant_free(*(Variant **)member);
            break;
        case FIELD_KIND_REFCOUNT:
            refcount_unref(*(Refcount **)member);
            break;
        case FIELD_KIND_ITEM:
        case FIELD_KIND_BASE:
            fields_free(field->fields, member);
            break;
        default:
            break;
        }
    }
}

void fields_clear(const Field *fields, void *item) {
    if (item == NULL)
        return;
    fields_free(fields, item);
    fields_set_absent(fields, item);
}

// All members of `item` are absent.
static Status fields_set_defaults(const Field *fields, void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind != FIELD_KIND_BASE && field->presence != PRESENCE_DEFAULT)
            continue;
        void *member = field_member(field, item);
        switch (field->kind) {
        case FIELD_KIND_REAL:
            *(double *)member = field->initial;
            break;
        case FIELD_KIND_COUNT:
            *(uint64_t *)member = (uint64_t)field->initial;
            break;
        case FIELD_KIND_FLAG:
            *(bool *)member = field->initial != 0;
            break;
        case FIELD_KIND_CHOICE:
            *(int *)member = (int)field->initial;
            break;
        case FIELD_KIND_TEXTS:
            for (const char *const *text = field->initial_texts; text != NULL && *text != NULL;
                 text++)
                TRY(texts_append(member, *text));
            break;
        case FIELD_KIND_VARIANT: {
            Variant *variant = variant_new(field->kinds->at(0));
            if (variant == NULL)
                return STATUS_NO_MEMORY;
            *(Variant **)member = variant;
            break;
        }
        case FIELD_KIND_ITEM:
        case FIELD_KIND_BASE:
            TRY(fields_set_defaults(field->fields, member));
            break;
        default:
            break;
        }
    }
    return STATUS_OK;
}

Status fields_default(const Field *fields, void *item) {
    fields_set_absent(fields, item);
    return fields_set_defaults(fields, item);
}

// All members of `target` are absent.
static Status fields_copy_members(const Field *fields, const void *source, void *target) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *from = field_member(field, source);
        void *to = field_member(field, target);
        switch (field->kind) {
        case FIELD_KIND_REAL:
        case FIELD_KIND_COUNT:
        case FIELD_KIND_FLAG:
        case FIELD_KIND_CHOICE:
            memcpy(to, from, field_sizes[field->kind]);
            break;
        case FIELD_KIND_TEXT: {
            const char *text = *(char *const *)from;
            if (text != NULL && (*(char **)to = strdup(text)) == NULL)
                return STATUS_NO_MEMORY;
            break;
        }
        case FIELD_KIND_REALS:
        case FIELD_KIND_ROWS:
        case FIELD_KIND_TEXTS:
        case FIELD_KIND_LIST: {
            const Field *rows = field_element_rows(field);
            const List list = field_list(from);
            if (list.count == 0)
                break;
            const List copy = {calloc(list.count, field->size), list.count};
            if (copy.at == NULL)
                return STATUS_NO_MEMORY;
            // First stored, so that it can be cleared after a failure.
            memcpy(to, &copy, sizeof copy);
            if (rows->kind == FIELD_KIND_END)
                memcpy(copy.at, list.at, list.count * field->size);
            for (size_t i = 0; i < copy.count && rows->kind != FIELD_KIND_END; i++)
                TRY(fields_copy(rows, field_element(field, list, i),
                                field_element(field, copy, i)));
            break;
        }
        case FIELD_KIND_VARIANT: {
            const Variant *variant = *(Variant *const *)from;
            if (variant == NULL)
                break;
            Variant *copy = calloc(1, variant->kind->size);
            if (copy == NULL)
                return STATUS_NO_MEMORY;
            *(Variant **)to = copy;
            copy->kind = variant->kind;
            TRY(fields_copy(copy->kind->fields, variant, copy));
            break;
        }
        case FIELD_KIND_REFCOUNT:
            *(Refcount **)to = refcount_ref(*(Refcount *const *)from);
            break;
        case FIELD_KIND_ITEM:
        case FIELD_KIND_BASE:
            TRY(fields_copy_members(field->fields, from, to));
            break;
        case FIELD_KIND_END:
            break;
        }
    }
    return STATUS_OK;
}

Status fields_copy(const Field *fields, const void *source, void *target) {
    fields_set_absent(fields, target);
    const Status status = fields_copy_members(fields, source, target);
    if (status != STATUS_OK)
        fields_clear(fields, target);
    return status;
}

static bool fields_are_empty(const Field *fields, const void *item);

// Whether the member has no value, regardless of its presence.
static bool field_is_empty(const Field *field, const void *member) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        return isnan(*(const double *)member);
    case FIELD_KIND_COUNT:
        return *(const uint64_t *)member == COUNT_ABSENT;
    case FIELD_KIND_TEXT:
        return *(char *const *)member == NULL;
    case FIELD_KIND_CHOICE:
        return *(const int *)member == CHOICE_ABSENT;
    case FIELD_KIND_REALS:
    case FIELD_KIND_ROWS:
    case FIELD_KIND_TEXTS:
    case FIELD_KIND_LIST:
        return field_list(member).count == 0;
    case FIELD_KIND_VARIANT:
        return *(Variant *const *)member == NULL;
    case FIELD_KIND_REFCOUNT:
        return *(Refcount *const *)member == NULL;
    case FIELD_KIND_ITEM:
    case FIELD_KIND_BASE:
        return fields_are_empty(field->fields, member);
    case FIELD_KIND_FLAG:
    case FIELD_KIND_END:
        break;
    }
    return true;
}

static bool fields_are_empty(const Field *fields, const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++)
        if ((field->flags & FIELD_HIDDEN) == 0 && !field_is_empty(field, field_member(field, item)))
            return false;
    return true;
}

bool field_is_absent(const Field *field, const void *item) {
    if ((field->flags & FIELD_HIDDEN) != 0)
        return true;
    switch (field->kind) {
    case FIELD_KIND_FLAG:
    case FIELD_KIND_BASE:
        return false;
    case FIELD_KIND_REALS:
    case FIELD_KIND_ROWS:
    case FIELD_KIND_TEXTS:
    case FIELD_KIND_LIST:
    case FIELD_KIND_ITEM:
        return field->presence != PRESENCE_DEFAULT &&
               field_is_empty(field, field_member(field, item));
    default:
        return field_is_empty(field, field_member(field, item));
    }
}

bool reals_allocate(Reals *reals, size_t count) {
    reals->at = calloc(count + 1, sizeof *reals->at);
    reals->count = reals->at != NULL ? count : 0;
    return reals->at != NULL;
}

static int reals_compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

bool reals_are_zero(const Reals *reals) {
    for (size_t i = 0; i < reals->count; i++)
        if (reals->at[i] != 0)
            return false;
    return true;
}

void reals_sort(double *values, size_t count) {
    if (count > 0)
        qsort(values, count, sizeof *values, reals_compare);
}

// With room for `room` elements; 0: there is room.
static void *list_append_within(void *list, size_t element_size, size_t room) {
    List grown = field_list(list);
    char *at = room == 0 ? grown.at : realloc(grown.at, room * element_size);
    if (at == NULL)
        return NULL;
    void *const element = memset(at + grown.count * element_size, 0, element_size);
    grown = (List){at, grown.count + 1};
    memcpy(list, &grown, sizeof grown);
    return element;
}

void *list_append(void *list, size_t element_size) {
    return list_append_within(list, element_size, field_list(list).count + 1);
}

void *list_grow(void *list, size_t element_size) {
    const size_t count = field_list(list).count;
    const bool is_full = (count & (count - 1)) == 0;
    return list_append_within(list, element_size, !is_full ? 0 : count == 0 ? 1 : 2 * count);
}

Status texts_append(Texts *texts, const char *text) {
    char *copy = strdup(text), **at = copy == NULL ? NULL : list_append(texts, sizeof *at);
    if (at == NULL) {
        free(copy);
        return STATUS_NO_MEMORY;
    }
    *at = copy;
    return STATUS_OK;
}

void texts_clear(Texts *texts) {
    for (size_t i = 0; i < texts->count; i++)
        free(texts->at[i]);
    free(texts->at);
    *texts = (Texts){NULL, 0};
}

Variant *variant_new(const Kind *kind) {
    Variant *variant = calloc(1, kind->size);
    if (variant == NULL)
        return NULL;
    variant->kind = kind;
    if (fields_default(kind->fields, variant) != STATUS_OK) {
        variant_free(variant);
        return NULL;
    }
    return variant;
}

void variant_free(Variant *variant) {
    if (variant == NULL)
        return;
    fields_free(variant->kind->fields, variant);
    free(variant);
}

const Kind *kind_find(const KindTable *table, const char *name) {
    const Kind *kind;
    for (size_t i = 0; (kind = table->at(i)) != NULL; i++)
        if (strcmp(kind->name, name) == 0)
            return kind;
    return NULL;
}

const Field *fields_find(const Field *fields, const char *name, size_t *offset) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE) {
            const Field *found = fields_find(field->fields, name, offset);
            if (found != NULL) {
                if (offset != NULL)
                    *offset += field->offset;
                return found;
            }
        } else if ((field->flags & FIELD_HIDDEN) == 0 && strcmp(field->name, name) == 0) {
            return field;
        }
    }
    return NULL;
}
