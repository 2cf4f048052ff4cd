// Judging rows: what is said of a value that its row does not allow. One sentence per fault: what
// is wrong, what would be right, the unit.
#include <stdio.h>
#include <string.h>

#include "core/base/field.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

static bool range_holds(const Range *range, double value) {
    return (range->is_open_below ? value > range->least : value >= range->least) &&
           value <= range->most;
}

static Status check_number(const Field *field, double value, const char *pointer,
                           Problem *problem) {
    const Range *range = &field->range;
    if (!isfinite(value))
        return problem_add_real(problem, STATUS_INVALID, pointer, value, field->unit,
                                "must be finite");
    if (range_holds(range, value))
        return STATUS_OK;
    char least[32], most[32], is[32];
    text_real(least, range->least);
    text_real(most, range->most);
    text_real(is, value);
    const char *space = field->unit != NULL ? " " : "";
    const char *unit = field->unit != NULL ? field->unit : "";
    const char *below = range->is_open_below ? "above" : "at least";
    if (isinf(range->most))
        return problem_add_real(problem, STATUS_INVALID, pointer, value, field->unit,
                                "must be %s %s%s%s, is %s", below, least, space, unit, is);
    return problem_add_real(problem, STATUS_INVALID, pointer, value, field->unit,
                            "must be within [%s, %s]%s%s, is %s", least, most, space, unit, is);
}

static Status check_length(size_t most, size_t has, const char *what, const char *pointer,
                           Problem *problem) {
    if (most == 0 || has <= most)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, pointer, "must have at most %zu, has %zu %s", most,
                       has, what);
}

static Status check_missing(const Field *field, const char *pointer, Problem *problem) {
    const bool is_many = field->kind == FIELD_KIND_REALS || field->kind == FIELD_KIND_ROWS ||
                         field->kind == FIELD_KIND_TEXTS || field->kind == FIELD_KIND_LIST;
    const char *unit = field->unit != NULL ? field->unit : "";
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_fit(fault.unit, sizeof fault.unit, unit);
    char text[2 * sizeof fault.detail];
    snprintf(text, sizeof text, "is required%s: %s%s%s%s", is_many ? ", with at least one" : "",
             field->doc != NULL ? field->doc : field->name, unit[0] != '\0' ? " [" : "", unit,
             unit[0] != '\0' ? "]" : "");
    text_fit(fault.detail, sizeof fault.detail, text);
    return problem_put(problem, STATUS_INVALID, &fault);
}

// `suffix` is what the suggestion ends with.
static Status refuse(const char *const *texts, const char *text, const char *near,
                     const char *suffix, const char *pointer, Problem *problem) {
    Fault fault = {0};
    char list[2 * sizeof fault.detail] = "must be one of ";
    size_t length = strlen(list);
    for (size_t i = 0; texts[i] != NULL && length < sizeof list; i++)
        length += (size_t)snprintf(list + length, sizeof list - length, "%s%s", i > 0 ? ", " : "",
                                   texts[i]);
    text_fit(fault.detail, sizeof fault.detail, list);
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, text);
    if (near != NULL)
        snprintf(fault.did_you_mean, sizeof fault.did_you_mean, "%s%s", near, suffix);
    return problem_put(problem, STATUS_INVALID, &fault);
}

Status texts_refuse(const char *const *texts, const char *text, const char *pointer,
                    Problem *problem) {
    return refuse(texts, text, texts_nearest(texts, text), "", pointer, problem);
}

size_t name_number(const char *name, size_t *length) {
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

static bool texts_have(const char *const *texts, const char *text) {
    for (; *texts != NULL; texts++)
        if (strcmp(*texts, text) == 0)
            return true;
    return false;
}

// A text that is none of the choices, or one of them with a number.
static Status check_numbered(const char *const *texts, const char *text, const char *pointer,
                             Problem *problem) {
    char stem[64], suffix[64];
    size_t length;
    (void)name_number(text, &length);
    if (length >= sizeof stem)
        return texts_refuse(texts, text, pointer, problem);
    memcpy(stem, text, length);
    stem[length] = '\0';
    text_fit(suffix, sizeof suffix, text + length);
    return texts_have(texts, stem)
               ? STATUS_OK
               : refuse(texts, text, texts_nearest(texts, stem), suffix, pointer, problem);
}

static Status check_texts(const Field *field, const Texts *texts, const char *pointer,
                          Problem *problem) {
    Status status = check_length(field->most, texts->count, "texts", pointer, problem);
    if (status != STATUS_OK || field->choices == NULL)
        return status;
    for (size_t i = 0; i < texts->count; i++) {
        if (texts_have(field->choices, texts->at[i]))
            continue;
        char place[POINTER_SIZE];
        pointer_index(place, sizeof place, pointer, i);
        const Status found = (field->flags & FIELD_NUMBERED) != 0
                                 ? check_numbered(field->choices, texts->at[i], place, problem)
                                 : texts_refuse(field->choices, texts->at[i], place, problem);
        status = found != STATUS_OK ? found : status;
    }
    return status;
}

static Status check_reals(const Field *field, const Reals *reals, const char *pointer,
                          Problem *problem) {
    Status status = check_length(field->most, reals->count, "numbers", pointer, problem);
    if (status != STATUS_OK)
        return status;
    for (size_t i = 0; i < reals->count; i++) {
        const double value = reals->at[i];
        if (isfinite(value) && range_holds(&field->range, value))
            continue;
        char place[POINTER_SIZE];
        pointer_index(place, sizeof place, pointer, i);
        status = check_number(field, value, place, problem);
    }
    return status;
}

static Status check_member(const Field *field, const void *item, const char *pointer,
                           Problem *problem) {
    const void *member = (const char *)item + field->offset;
    Status status = STATUS_OK;
    char place[POINTER_SIZE];
    switch (field->kind) {
    case FIELD_KIND_REAL:
        return check_number(field, *(const double *)member, pointer, problem);
    case FIELD_KIND_COUNT:
        return check_number(field, (double)*(const uint64_t *)member, pointer, problem);
    case FIELD_KIND_TEXT: {
        const char *text = *(char *const *)member;
        return text == NULL ? STATUS_OK
                            : check_length(field->most, strlen(text), "bytes", pointer, problem);
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
        return check_reals(field, member, pointer, problem);
    case FIELD_KIND_ROWS: {
        const Rows *rows = member;
        status = check_length(field->most, rows->count, "rows", pointer, problem);
        if (status != STATUS_OK)
            return status;
        for (size_t i = 0; i < rows->count; i++) {
            pointer_index(place, sizeof place, pointer, i);
            if (check_reals(field, &rows->at[i], place, problem) != STATUS_OK)
                status = STATUS_INVALID;
        }
        return status;
    }
    case FIELD_KIND_TEXTS:
        return check_texts(field, member, pointer, problem);
    case FIELD_KIND_LIST: {
        List list;
        memcpy(&list, member, sizeof list);
        status = check_length(field->most, list.count, "elements", pointer, problem);
        if (status != STATUS_OK)
            return status;
        for (size_t i = 0; i < list.count; i++) {
            pointer_index(place, sizeof place, pointer, i);
            if (fields_check(field->fields, (const char *)list.at + i * field->size, place,
                             problem) != STATUS_OK)
                status = STATUS_INVALID;
        }
        return status;
    }
    case FIELD_KIND_VARIANT: {
        const Variant *variant = *(Variant *const *)member;
        return variant == NULL ? STATUS_OK
                               : fields_check(variant->kind->fields, variant, pointer, problem);
    }
    case FIELD_KIND_ITEM:
    case FIELD_KIND_BASE:
        return fields_check(field->fields, member, pointer, problem);
    case FIELD_KIND_FLAG:
    case FIELD_KIND_SHARED:
    case FIELD_KIND_END:
        break;
    }
    return STATUS_OK;
}

// Whether an absent member is a fault. A default leaves nothing absent but what may be empty (texts
// and lists) or was erased because it is not used (a choice).
static bool must_be_there(const Field *field) {
    if (field->presence == PRESENCE_REQUIRED)
        return true;
    return field->presence == PRESENCE_DEFAULT &&
           (field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT ||
            field->kind == FIELD_KIND_VARIANT);
}

// Whether there is nothing to say of a member, not even where it stands: of most.
static bool is_plainly_right(const Field *field, const void *item) {
    const void *member = (const char *)item + field->offset;
    if (field_is_absent(field, item))
        return !must_be_there(field);
    switch (field->kind) {
    case FIELD_KIND_FLAG:
        return true;
    case FIELD_KIND_REAL:
        return isfinite(*(const double *)member) &&
               range_holds(&field->range, *(const double *)member);
    case FIELD_KIND_COUNT:
        return range_holds(&field->range, (double)*(const uint64_t *)member);
    default:
        return false;
    }
}

Status fields_check(const Field *fields, const void *item, const char *pointer, Problem *problem) {
    Status status = STATUS_OK;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (is_plainly_right(field, item))
            continue;
        char place[POINTER_SIZE];
        if (field->kind == FIELD_KIND_BASE)
            text_fit(place, sizeof place, pointer);
        else
            pointer_join(place, sizeof place, pointer, field->name);
        Status found = STATUS_OK;
        if (!field_is_absent(field, item))
            found = check_member(field, item, place, problem);
        else if (must_be_there(field))
            found = check_missing(field, place, problem);
        if (found != STATUS_OK)
            status = STATUS_INVALID;
    }
    return status;
}
