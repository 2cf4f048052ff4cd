// Two trees walked together. Lists differ place by place; one that is longer has members the other
// lacks.
#include "server/codec/differ.h"

#include <stdio.h>
#include <string.h>

#include <jansson.h>

#include "core/base/field.h"

static void put_value(char target[128], const json_t *value) {
    enum { MOST = 127 };
    target[0] = '\0';
    if (value == NULL)
        return;
    const size_t size = json_dumpb(value, target, MOST, JSON_ENCODE_ANY | JSON_COMPACT);
    if (size <= MOST)
        target[size] = '\0';
    else
        snprintf(target, 128, "\"%zu bytes of JSON\"", size);
}

static void add(Differences *differences, const char *pointer, const json_t *here,
                const json_t *there) {
    if (differences->count++ >= DIFFER_MOST)
        return;
    Difference *one = &differences->at[differences->count - 1];
    text_fit(one->pointer, sizeof one->pointer, pointer);
    put_value(one->here, here);
    put_value(one->there, there);
}

static void walk(json_t *here, json_t *there, const char *pointer, Differences *differences) {
    char place[256];
    if (json_is_object(here) && json_is_object(there)) {
        const char *name;
        json_t *value;
        json_object_foreach(here, name, value) {
            pointer_join(place, sizeof place, pointer, name);
            walk(value, json_object_get(there, name), place, differences);
        }
        json_object_foreach(there, name, value) {
            pointer_join(place, sizeof place, pointer, name);
            if (json_object_get(here, name) == NULL)
                add(differences, place, NULL, value);
        }
    } else if (json_is_array(here) && json_is_array(there)) {
        const size_t count = json_array_size(here), other = json_array_size(there);
        for (size_t i = 0; i < count || i < other; i++) {
            char number[24];
            snprintf(number, sizeof number, "%zu", i);
            pointer_join(place, sizeof place, pointer, number);
            walk(i < count ? json_array_get(here, i) : NULL,
                 i < other ? json_array_get(there, i) : NULL, place, differences);
        }
    } else if (here == NULL || there == NULL || !json_equal(here, there)) {
        add(differences, pointer, here, there);
    }
}

Status differ_json(const char *here, const char *there, Differences *differences) {
    differences->count = 0;
    json_t *a = json_loadb(here, strlen(here), JSON_REJECT_DUPLICATES, NULL);
    json_t *b = json_loadb(there, strlen(there), JSON_REJECT_DUPLICATES, NULL);
    const Status status = a != NULL && b != NULL ? STATUS_OK : STATUS_INTERNAL;
    if (status == STATUS_OK)
        walk(a, b, "", differences);
    json_decref(a);
    json_decref(b);
    return status;
}
