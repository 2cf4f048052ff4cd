// Text as it is compared where upper and lower case are one: what is stored to be searched, and
// what it is searched for. Not for people to read. Used by jobs/ and store/.
#ifndef SERVER_UTIL_UTF8_FOLD_H
#define SERVER_UTIL_UTF8_FOLD_H

#include "server/util/bytes.h"

// Appends UTF-8 in lower case, of any script, with a space for each control character. What is no
// UTF-8 is kept as it is.
void utf8_fold(Bytes *bytes, const char *text);

#endif
