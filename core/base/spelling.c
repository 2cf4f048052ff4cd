// The distance of two names is the smallest number of letters inserted, deleted, changed or swapped
// with their neighbour (optimal string alignment), ignoring case.
#include "core/base/spelling.h"

#include <stdio.h>
#include <string.h>

enum { NAME_MAX = 48, FIELDS_MAX = 256 }; // longer names, and fields beyond, get no suggestion

static int spelling_lower(char c) {
    return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : (unsigned char)c;
}

static size_t spelling_min(size_t a, size_t b) {
    return a < b ? a : b;
}

static size_t spelling_distance(const char *a, size_t a_length, const char *b, size_t b_length) {
    size_t rows[3][NAME_MAX + 1];
    size_t *before = rows[0], *last = rows[1], *now = rows[2];
    for (size_t j = 0; j <= b_length; j++)
        last[j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        now[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            const bool is_same = spelling_lower(a[i - 1]) == spelling_lower(b[j - 1]);
            size_t d = last[j - 1] + (is_same ? 0 : 1);
            d = spelling_min(d, spelling_min(last[j], now[j - 1]) + 1);
            if (i > 1 && j > 1 && spelling_lower(a[i - 1]) == spelling_lower(b[j - 2]) &&
                spelling_lower(a[i - 2]) == spelling_lower(b[j - 1]))
                d = spelling_min(d, before[j - 2] + 1);
            now[j] = d;
        }
        size_t *spare = before;
        before = last;
        last = now;
        now = spare;
    }
    return last[b_length];
}

const char *spelling_nearest(const char *const *texts, const char *name) {
    const size_t length = strlen(name);
    const char *nearest = NULL;
    size_t least = SIZE_MAX;
    for (; *texts != NULL && length > 0 && length <= NAME_MAX; texts++) {
        const size_t other = strlen(*texts), longer = other > length ? other : length;
        if (other > NAME_MAX)
            continue;
        const size_t d = spelling_distance(name, length, *texts, other);
        if (d <= longer / 3 && d < least) {
            nearest = *texts;
            least = d;
        }
    }
    return nearest;
}

static size_t spelling_collect(const Field *fields, const char **names, size_t count) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++)
        if (field->kind == FIELD_KIND_BASE)
            count = spelling_collect(field->fields, names, count);
        else if ((field->flags & FIELD_HIDDEN) == 0 && count < FIELDS_MAX)
            names[count++] = field->name;
    return count;
}

const char *spelling_nearest_field(const Field *fields, const char *name) {
    const char *names[FIELDS_MAX + 1];
    names[spelling_collect(fields, names, 0)] = NULL;
    return spelling_nearest(names, name);
}

Status spelling_reject_numbered(const char *const *texts, const char *text, size_t length,
                                const char *pointer, Problem *problem) {
    Fault fault = {0};
    char list[2 * sizeof fault.detail] = "must be one of ", stem[NAME_MAX + 1];
    size_t used = strlen(list);
    for (size_t i = 0; texts[i] != NULL && used < sizeof list; i++)
        used +=
            (size_t)snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? ", " : "", texts[i]);
    text_fit(fault.detail, sizeof fault.detail, list);
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, text);
    if (length < sizeof stem) {
        memcpy(stem, text, length);
        stem[length] = '\0';
        const char *near = spelling_nearest(texts, stem);
        if (near != NULL)
            snprintf(fault.did_you_mean, sizeof fault.did_you_mean, "%s%s", near, text + length);
    }
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

Status spelling_reject(const char *const *texts, const char *text, const char *pointer,
                       Problem *problem) {
    return spelling_reject_numbered(texts, text, strlen(text), pointer, problem);
}
