// "Did you mean": finds the known name that is nearest to a misspelt one.
#ifndef CORE_BASE_SPELLING_H
#define CORE_BASE_SPELLING_H

#include "core/base/field.h"

// The nearest name among the rows (including BASE rows) or in a NULL-terminated list. NULL if more
// than a third of the letters differ.
const char *spelling_nearest_field(const Field *fields, const char *name);
const char *spelling_nearest(const char *const *texts, const char *name);

// Adds the fault "must be one of ..." for `text` at `pointer`, and suggests the nearest of `texts`.
// Returns STATUS_INVALID.
Status spelling_reject(const char *const *texts, const char *text, const char *pointer,
                       Problem *problem);

// The same for a text "name_2" whose `stem` of `length` bytes is compared; the suggestion ends with
// the rest of the text.
Status spelling_reject_numbered(const char *const *texts, const char *text, size_t length,
                                const char *pointer, Problem *problem);

#endif
