// Edits of the text of a JSON object with any members; numbers keep their values. A text that is
// not an object is left unchanged: the server that receives it reports what is wrong.
#ifndef SERVER_JSON_JSON_EDIT_H
#define SERVER_JSON_JSON_EDIT_H

#include "core/base/status.h"
#include "server/util/bytes.h"

// Sets a member to a string. STATUS_USAGE, under "--name", if that is not UTF-8.
Status json_edit_set(Bytes *text, const char *name, const char *value, Problem *problem);
// Adds "key=value" to the member "labels", an object or a list. STATUS_USAGE if `label` is not of
// that form.
Status json_edit_label(Bytes *text, const char *label, Problem *problem);
// Appends a JSON value to a list, which is created if it is missing. A member of another type is
// left unchanged. STATUS_INVALID: the value is not JSON.
Status json_edit_append(Bytes *text, const char *list, const Bytes *value, Problem *problem);
// Removes members that are null, at any depth.
Status json_edit_remove_nulls(Bytes *text, Problem *problem);

// Appends the text of the member `name`, an object, to `part`. STATUS_NOT_FOUND.
Status json_edit_extract(const Bytes *text, const char *name, Bytes *part, Problem *problem);

#endif
