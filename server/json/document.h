// JSON documents as text, with any members: the differences of two, edits of one, and reading one
// whose sender is not trusted.
#ifndef SERVER_JSON_DOCUMENT_H
#define SERVER_JSON_DOCUMENT_H

#include "core/base/field.h"
#include "server/util/bytes.h"

enum { DIFF_MAX = 200, DIFF_VALUE_MAX = 400 }; // differences written; bytes of a value

typedef struct DiffFormat {
    const char *a, *b; // names of the two values
    bool is_full;      // with null for a value that is missing or too long, and "detail"
} DiffFormat;

// Appends [{"pointer", A, B, "detail"}, ...] with the first DIFF_MAX differences; *count has all.
// Objects are compared member by member, arrays of more than 16 numbers as a whole, other arrays
// element by element. The member `ignored` of the documents (NULL: none) is left out.
// STATUS_INTERNAL: a document is not JSON; nothing is appended then.
Status json_diff(const char *a, const char *b, const char *ignored, const DiffFormat *format,
                 Bytes *bytes, size_t *count, Problem *problem);

// Edits keep the values of numbers. A text that is not an object is left unchanged: the server that
// receives it reports what is wrong.

// Sets a member to a string. STATUS_USAGE, under "--name", if that is not UTF-8.
Status json_edit_set(Bytes *text, const char *name, const char *value, Problem *problem);
// Adds "key=value" to the member "labels", an object or a list. STATUS_USAGE if `label` is not of
// that form.
Status json_edit_label(Bytes *text, const char *label, Problem *problem);
// Sets the member at a JSON Pointer without escapes to a JSON value, or removes it where `value` is
// NULL; objects around it that are missing are created. STATUS_USAGE, at `place`: the value is not
// JSON, or lies in no object.
Status json_edit_put(Bytes *text, const char *pointer, const Bytes *value, const char *place,
                     Problem *problem);
// Appends a JSON value to a list, which is created if it is missing. A member of another type is
// left unchanged. STATUS_INVALID: the value is not JSON.
Status json_edit_append(Bytes *text, const char *list, const Bytes *value, Problem *problem);
// Appends the elements of the lists in `more` to those of the same names in `text`. STATUS_INVALID:
// one of them is not an object.
Status json_edit_extend(Bytes *text, const Bytes *more, Problem *problem);
// Appends the members of an object that `fields` have and that are not empty, in the order of the
// fields and one a line. False if there are none.
bool json_edit_pick(const Bytes *text, const Field *fields, Bytes *picked);

// Appends the text of the member `name`, an object, to `part`. STATUS_NOT_FOUND.
Status json_edit_extract(const Bytes *text, const char *name, Bytes *part, Problem *problem);

// Reading. Members that are missing or of another type are absent: the sender may be newer, older
// or no impactd. A document or member that is NULL has no members.
typedef struct json_t JsonDocument;

// The document of a text that is an object, else NULL.
JsonDocument *json_open(const Bytes *text);
void json_close(JsonDocument *document);
// A text member, with '?' for control characters; NULL: absent.
const char *json_get_text(const JsonDocument *of, const char *name);
double json_get_number(const JsonDocument *of, const char *name); // NAN: absent
bool json_get_flag(const JsonDocument *of, const char *name);
const JsonDocument *json_get_object(const JsonDocument *of, const char *name);
bool json_has_list(const JsonDocument *of, const char *name); // of objects only, or empty
// Element i of a list of objects; NULL behind the last.
const JsonDocument *json_get_item(const JsonDocument *of, const char *name, size_t i);

#endif
