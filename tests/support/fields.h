// Setting members by their JSON name, for structs that only their own file knows.
// Not for the program: no range is judged. Used by unit tests.
#ifndef TESTS_SUPPORT_FIELDS_H
#define TESTS_SUPPORT_FIELDS_H

#include "core/base/field.h"

// The member called `name` of an item; the test fails if there is none.
void *member_at(const Field *fields, void *item, const char *name);

// The same of a variant.
void *variant_member(Variant *variant, const char *name);

// A copy of texts or numbers for a member to own.
Texts texts_of(size_t count, const char *const *texts);
Reals reals_of(size_t count, const double *values);

// What a problem says at `pointer`; "(no fault there)" if nothing.
const char *detail_at(const Problem *problem, const char *pointer);

#endif
