// Changes in the text of a JSON object, and parts taken out of it, whatever else it holds; numbers
// stay the same doubles. Not a reader of what it says. Used by the commands that send documents of
// people's on.
#ifndef SERVER_CODEC_AMEND_H
#define SERVER_CODEC_AMEND_H

#include "core/base/status.h"
#include "server/base/bytes.h"

// Sets a member to `value`, a JSON text. A text that is no object stays as it is, for whoever
// judges it. STATUS_INVALID: the value is no JSON.
Status amend_set(Bytes *text, const char *name, const Bytes *value, Problem *problem);
// Appends to a list, which is made where it is missing. Where it is no list, as above.
Status amend_append(Bytes *text, const char *list, const Bytes *value, Problem *problem);

// Drops members that are null, at any depth.
Status amend_known(Bytes *text, Problem *problem);

// The text of the object at `name`. STATUS_NOT_FOUND.
Status amend_take(const Bytes *text, const char *name, Bytes *part, Problem *problem);

#endif
