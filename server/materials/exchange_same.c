// Member by member as they are written: what reads the same is the same.
#include "server/materials/exchange_same.h"

#include <stdio.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/json/encode.h"
#include "server/json/parse.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

static bool is_list(const Field *field) {
    return field->kind == FIELD_KIND_TEXTS || field->kind == FIELD_KIND_REALS ||
           field->kind == FIELD_KIND_LIST;
}

// One member alone as text, without its name.
static void put_member(Bytes *bytes, const Field *field, const void *item) {
    const Field alone[] = {*field, FIELD_END};
    encode_item(bytes, alone, item, WRITE_SCENE);
}

static void show(char *target, size_t size, const Bytes *bytes, const Field *field) {
    const char *value = bytes->at != NULL ? strstr(bytes->at, ": ") : NULL;
    if (value == NULL || is_list(field)) {
        target[0] = '\0';
        return;
    }
    text_fit(target, size, value + 2);
    const size_t length = strlen(target);
    if (length > 0 && length + 1 < size && target[length - 1] == '}')
        target[length - 1] = '\0'; // the object's end
}

static void tell(const Field *field, const Bytes *ours, const Bytes *there,
                 const MaterialRevision *revision, const char *place, Problem *problem) {
    Fault fault = {.row = 0};
    char is[sizeof fault.value];
    json_pointer_join(fault.pointer, sizeof fault.pointer, place, field->name);
    if (problem_concerns(problem, fault.pointer))
        return; // it could not be read, and is told
    show(fault.value, sizeof fault.value, ours, field);
    show(is, sizeof is, there, field);
    // A value that was cut is no JSON.
    if (strlen(fault.value) + 1 >= sizeof fault.value)
        fault.value[0] = '\0';
    text_fit(fault.unit, sizeof fault.unit, field->unit != NULL ? field->unit : "");
    char detail[2 * sizeof fault.detail];
    snprintf(
        detail, sizeof detail,
        "%.64s@%llu is there and says %s%.60s; revisions never change: bring it under the next "
        "number",
        revision->slug, (unsigned long long)revision->revision,
        is[0] != '\0'                        ? ""
        : is_list(field) && there->count > 2 ? "something else"
                                             : "nothing here",
        is);
    text_fit(fault.detail, sizeof fault.detail, detail);
    (void)problem_add_fault(problem, STATUS_INVALID, &fault);
}

static bool compare(const Field *fields, bool takes_lists, const Material *a, const Material *b,
                    const MaterialRevision *there, const char *place, Problem *problem) {
    bool is_same = true;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        Bytes ours = {.most = 0}, theirs = {.most = 0};
        if (is_list(field) != takes_lists)
            continue;
        put_member(&ours, field, a);
        put_member(&theirs, field, b);
        if (ours.is_failed || theirs.is_failed || strcmp(ours.at, theirs.at) != 0) {
            is_same = false;
            if (problem != NULL)
                tell(field, &ours, &theirs, there, place, problem);
        }
        bytes_clear(&ours);
        bytes_clear(&theirs);
    }
    return is_same;
}

static bool compare_lists(const MaterialRevision *ours, const MaterialRevision *there,
                          const char *place, Problem *problem) {
    const char *a = ours->lists != NULL ? ours->lists : "{}";
    const char *b = there->lists != NULL ? there->lists : "{}";
    Material one, other;
    if (strcmp(a, b) == 0)
        return true;
    if (problem == NULL)
        return false;
    memset(&one, 0, sizeof one);
    memset(&other, 0, sizeof other);
    (void)json_parse(a, strlen(a), material_list_fields, &one, NULL);
    (void)json_parse(b, strlen(b), material_list_fields, &other, NULL);
    (void)compare(material_list_fields, true, &one, &other, there, place, problem);
    fields_clear(material_list_fields, &one);
    fields_clear(material_list_fields, &other);
    return false;
}

bool exchange_says_same(const MaterialRevision *ours, const MaterialRevision *there,
                        const char *place, Problem *problem) {
    const bool is_same =
        compare(material_fields, false, &ours->material, &there->material, there, place, problem);
    return compare_lists(ours, there, place, problem) && is_same;
}
