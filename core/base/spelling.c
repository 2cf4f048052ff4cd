// "Did you mean": the least number of letters put in, taken out, changed or swapped with their
// neighbour (optimal string alignment), whatever their case. And the pointers that say where a
// fault is.
#include <string.h>

#include "core/base/field.h"

enum { NAME_MAX = 48 }; // longer ones are no slips of the pen

static int lower(char c) {
    return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : (unsigned char)c;
}

static size_t least(size_t a, size_t b) {
    return a < b ? a : b;
}

static size_t distance(const char *a, size_t a_length, const char *b, size_t b_length) {
    size_t rows[3][NAME_MAX + 1];
    size_t *before = rows[0], *last = rows[1], *now = rows[2];
    for (size_t j = 0; j <= b_length; j++)
        last[j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        now[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            const bool is_same = lower(a[i - 1]) == lower(b[j - 1]);
            size_t d = last[j - 1] + (is_same ? 0 : 1);
            d = least(d, least(last[j], now[j - 1]) + 1);
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                lower(a[i - 2]) == lower(b[j - 1]))
                d = least(d, before[j - 2] + 1);
            now[j] = d;
        }
        size_t *spare = before;
        before = last;
        last = now;
        now = spare;
    }
    return last[b_length];
}

typedef struct Nearest {
    const char *meant; // what was written
    size_t length;
    const char *name; // the nearest so far, NULL if none is near enough
    size_t distance;
} Nearest;

static bool nearest_start(Nearest *nearest, const char *meant) {
    *nearest = (Nearest){meant, strlen(meant), NULL, SIZE_MAX};
    return nearest->length > 0 && nearest->length <= NAME_MAX;
}

static void nearest_try(Nearest *nearest, const char *name) {
    const size_t length = strlen(name);
    if (length > NAME_MAX)
        return;
    const size_t d = distance(nearest->meant, nearest->length, name, length);
    const size_t longer = length > nearest->length ? length : nearest->length;
    if (d <= longer / 3 && d < nearest->distance) {
        nearest->name = name;
        nearest->distance = d;
    }
}

static void nearest_try_fields(Nearest *nearest, const Field *fields) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++)
        if (field->kind == FIELD_KIND_BASE)
            nearest_try_fields(nearest, field->fields);
        else if ((field->flags & FIELD_HIDDEN) == 0)
            nearest_try(nearest, field->name);
}

const char *fields_nearest(const Field *fields, const char *name) {
    Nearest nearest;
    if (nearest_start(&nearest, name))
        nearest_try_fields(&nearest, fields);
    return nearest.name;
}

const char *texts_nearest(const char *const *texts, const char *name) {
    Nearest nearest;
    if (nearest_start(&nearest, name))
        for (; *texts != NULL; texts++)
            nearest_try(&nearest, *texts);
    return nearest.name;
}

// Every member of every scene is judged at its pointer, so these are plain loops, not printf.
void pointer_join(char *target, size_t size, const char *pointer, const char *name) {
    // Room for a pointer as long as any, and a name too long is cut all the same.
    char whole[3 * sizeof((Fault){0}.pointer)];
    const size_t room = sizeof whole - 3, own = strlen(pointer);
    size_t length = own < room / 2 ? own : room / 2;
    memcpy(whole, pointer, length);
    whole[length++] = '/';
    for (; *name != '\0' && length < room; name++) {
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

void pointer_index(char *target, size_t size, const char *pointer, size_t index) {
    char digits[24], *name = digits + sizeof digits - 1;
    *name = '\0';
    do
        *--name = (char)('0' + index % 10);
    while ((index /= 10) > 0);
    pointer_join(target, size, pointer, name);
}
