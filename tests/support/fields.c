#include "tests/support/fields.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

void *member_at(const Field *fields, void *item, const char *name) {
    size_t offset = 0;
    const Field *field = fields_find(fields, name, &offset);
    if (field == NULL)
        fail_msg("no row is called %s", name);
    return (char *)item + offset + field->offset;
}

void *variant_member(Variant *variant, const char *name) {
    return member_at(variant->kind->fields, variant, name);
}

Texts texts_of(size_t count, const char *const *texts) {
    Texts copy = {calloc(count + 1, sizeof *copy.at), count};
    for (size_t i = 0; i < count; i++)
        copy.at[i] = strdup(texts[i]);
    return copy;
}

Reals reals_of(size_t count, const double *values) {
    Reals copy = {calloc(count + 1, sizeof *copy.at), count};
    for (size_t i = 0; i < count; i++)
        copy.at[i] = values[i];
    return copy;
}

const char *detail_at(const Problem *problem, const char *pointer) {
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++)
        if (strcmp(problem->faults[i].pointer, pointer) == 0)
            return problem->faults[i].detail;
    return "(no fault there)";
}
