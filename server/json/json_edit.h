// Edits of the text of a JSON object, whatever else it holds; numbers stay the same doubles. A text
// that is no object stays as it is: the daemon, which it is sent to, says what is wrong with it.
#ifndef SERVER_JSON_JSON_EDIT_H
#define SERVER_JSON_JSON_EDIT_H

#include "core/base/status.h"
#include "server/util/bytes.h"

// Sets a member to a string. STATUS_USAGE, under "--name", if that is not UTF-8.
Status json_edit_set(Bytes *text, const char *name, const char *value, Problem *problem);
// Adds "key=value" to the "labels", an object or a list. STATUS_USAGE if it is none.
Status json_edit_label(Bytes *text, const char *label, Problem *problem);
// Appends a JSON value to a list, which is made where it is missing. Where the member is no list,
// the text stays as it is. STATUS_INVALID: the value is no JSON.
Status json_edit_append(Bytes *text, const char *list, const Bytes *value, Problem *problem);
// Removes members that are null, at any depth.
Status json_edit_remove_nulls(Bytes *text, Problem *problem);

// Appends the text of the object at `name` to `part`. STATUS_NOT_FOUND.
Status json_edit_extract(const Bytes *text, const char *name, Bytes *part, Problem *problem);

#endif
