// Validation of a struct against its rows. Each fault has one message: what is wrong, what is
// allowed, and the unit.
#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/json_pointer.h"
#include "core/base/spelling.h"

static bool field_range_contains(const Range *range, double value) {
    return (range->is_open_below ? value > range->min : value >= range->min) && value <= range->max;
}

static Status field_check_number(const Field *field, double value, const char *pointer,
                                 Problem *problem) {
    const Range *range = &field->range;
    if (!isfinite(value))
        return problem_add_real(problem, STATUS_INVALID, pointer, value, field->unit,
                                "must be finite");
    if (field_range_contains(range, value))
        return STATUS_OK;
    const RealText min = real_text(range->min), is = real_text(value);
    const char *space = field->unit != NULL ? " " : "";
    const char *unit = field->unit != NULL ? field->unit : "";
    const char *below = range->is_open_below ? "above" : "at least";
    if (isinf(range->max))
        return problem_add_real(problem, STATUS_INVALID, pointer, value, field->unit,
                                "must be %s %s%s%s, is %s", below, min.at, space, unit, is.at);
    return problem_add_real(problem, STATUS_INVALID, pointer, value, field->unit,
                            "must be within [%s, %s]%s%s, is %s", min.at, real_text(range->max).at,
                            space, unit, is.at);
}

static Status field_check_length(size_t max, size_t has, const char *what, const char *pointer,
                                 Problem *problem) {
    if (max == 0 || has <= max)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, pointer, "must have at most %zu, has %zu %s", max,
                       has, what);
}

static Status field_check_missing(const Field *field, const char *pointer, Problem *problem) {
    const bool is_many = field->kind == FIELD_KIND_REALS || field->kind == FIELD_KIND_ROWS ||
                         field->kind == FIELD_KIND_TEXTS || field->kind == FIELD_KIND_LIST;
    const char *unit = field->unit != NULL ? field->unit : "";
    return problem_add_real(problem, STATUS_INVALID, pointer, (double)NAN, unit,
                            "is required%s: %s%s%s%s", is_many ? ", with at least one" : "",
                            field->doc != NULL ? field->doc : field->name,
                            unit[0] != '\0' ? " [" : "", unit, unit[0] != '\0' ? "]" : "");
}

size_t field_name_number(const char *name, size_t *length) {
    *length = strlen(name);
    const char *mark = strrchr(name, '_');
    if (mark == NULL || mark[1] < '1' || mark[1] > '9')
        return 0;
    size_t number = 0;
    for (const char *digit = mark + 1; *digit != '\0'; digit++) {
        if (*digit < '0' || *digit > '9' || number > 99999999)
            return 0;
        number = 10 * number + (size_t)(*digit - '0');
    }
    *length = (size_t)(mark - name);
    return number;
}

static bool field_allows_text(const char *const *texts, const char *text, size_t length) {
    for (; *texts != NULL; texts++)
        if (strncmp(*texts, text, length) == 0 && (*texts)[length] == '\0')
            return true;
    return false;
}

static Status field_check_texts(const Field *field, const Texts *texts, const char *pointer,
                                Problem *problem) {
    Status status = field_check_length(field->max, texts->count, "texts", pointer, problem);
    if (status != STATUS_OK || field->choices == NULL || (field->flags & FIELD_NUMBERED) != 0)
        return status;
    for (size_t i = 0; i < texts->count; i++) {
        const char *text = texts->at[i];
        if (field_allows_text(field->choices, text, strlen(text)))
            continue;
        status = spelling_reject(field->choices, text, json_pointer_at(pointer, i).at, problem);
    }
    return status;
}

static Status field_check_reals(const Field *field, const Reals *reals, const char *pointer,
                                Problem *problem) {
    Status status = field_check_length(field->max, reals->count, "numbers", pointer, problem);
    if (status != STATUS_OK)
        return status;
    for (size_t i = 0; i < reals->count; i++) {
        const double value = reals->at[i];
        if (isfinite(value) && field_range_contains(&field->range, value))
            continue;
        const JsonPointer place = json_pointer_at(pointer, i);
        status = field_check_number(field, value, place.at, problem);
    }
    return status;
}

static Status field_check_member(const Field *field, const void *item, const char *pointer,
                                 Problem *problem) {
    const void *member = (const char *)item + field->offset;
    Status status = STATUS_OK;
    switch (field->kind) {
    case FIELD_KIND_REAL:
        return field_check_number(field, *(const double *)member, pointer, problem);
    case FIELD_KIND_COUNT:
        return field_check_number(field, (double)*(const uint64_t *)member, pointer, problem);
    case FIELD_KIND_TEXT: {
        const char *text = *(char *const *)member;
        return text == NULL
                   ? STATUS_OK
                   : field_check_length(field->max, strlen(text), "bytes", pointer, problem);
    }
    case FIELD_KIND_CHOICE: {
        int choices = 0;
        while (field->choices[choices] != NULL)
            choices++;
        const int choice = *(const int *)member;
        if (choice >= choices || choice < CHOICE_ABSENT)
            return problem_add(problem, STATUS_INVALID, pointer, "is none of the choices");
        return STATUS_OK;
    }
    case FIELD_KIND_REALS:
        return field_check_reals(field, member, pointer, problem);
    case FIELD_KIND_ROWS: {
        const Rows *rows = member;
        status = field_check_length(field->max, rows->count, "rows", pointer, problem);
        if (status != STATUS_OK)
            return status;
        for (size_t i = 0; i < rows->count; i++) {
            const JsonPointer place = json_pointer_at(pointer, i);
            if (field_check_reals(field, &rows->at[i], place.at, problem) != STATUS_OK)
                status = STATUS_INVALID;
        }
        return status;
    }
    case FIELD_KIND_TEXTS:
        return field_check_texts(field, member, pointer, problem);
    case FIELD_KIND_LIST: {
        List list;
        memcpy(&list, member, sizeof list);
        status = field_check_length(field->max, list.count, "elements", pointer, problem);
        if (status != STATUS_OK)
            return status;
        for (size_t i = 0; i < list.count; i++) {
            const JsonPointer place = json_pointer_at(pointer, i);
            if (fields_validate(field->fields, (const char *)list.at + i * field->size, place.at,
                                problem) != STATUS_OK)
                status = STATUS_INVALID;
        }
        return status;
    }
    case FIELD_KIND_VARIANT: {
        const Variant *variant = *(Variant *const *)member;
        return variant == NULL ? STATUS_OK
                               : fields_validate(variant->kind->fields, variant, pointer, problem);
    }
    case FIELD_KIND_ITEM:
    case FIELD_KIND_BASE:
        return fields_validate(field->fields, member, pointer, problem);
    case FIELD_KIND_FLAG:
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
    return STATUS_OK;
}

// Whether an absent member is a fault. Under PRESENCE_DEFAULT texts and lists may be empty and a
// choice may be unused.
static bool field_is_required(const Field *field) {
    if (field->presence == PRESENCE_REQUIRED)
        return true;
    return field->presence == PRESENCE_DEFAULT &&
           (field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT ||
            field->kind == FIELD_KIND_VARIANT);
}

// Quick check without making a pointer: true for most members.
static bool field_is_clearly_valid(const Field *field, const void *item) {
    const void *member = (const char *)item + field->offset;
    if (field_is_absent(field, item))
        return !field_is_required(field);
    switch (field->kind) {
    case FIELD_KIND_FLAG:
        return true;
    case FIELD_KIND_REAL:
        return isfinite(*(const double *)member) &&
               field_range_contains(&field->range, *(const double *)member);
    case FIELD_KIND_COUNT:
        return field_range_contains(&field->range, (double)*(const uint64_t *)member);
    default:
        return false;
    }
}

Status fields_validate(const Field *fields, const void *item, const char *pointer,
                       Problem *problem) {
    Status status = STATUS_OK;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field_is_clearly_valid(field, item))
            continue;
        char place[sizeof((Fault){0}.pointer)];
        if (field->kind == FIELD_KIND_BASE)
            text_fit(place, sizeof place, pointer);
        else
            json_pointer_join(place, sizeof place, pointer, field->name);
        Status found = STATUS_OK;
        if (!field_is_absent(field, item))
            found = field_check_member(field, item, place, problem);
        else if (field_is_required(field))
            found = field_check_missing(field, place, problem);
        if (found != STATUS_OK)
            status = STATUS_INVALID;
    }
    return status;
}
