// The path that a reverse proxy puts before "/v1/jobs/..." in links. Set once, before threads
// start.
#ifndef SERVER_UTIL_BASE_PATH_H
#define SERVER_UTIL_BASE_PATH_H

#include <stddef.h>

enum { LINK_BASE_SIZE = 64 };

// "/sim", or "" for none; at most LINK_BASE_SIZE - 1 bytes of it. A link is written as "%s/v1/...".
void base_path_set(const char *path);
const char *base_path(void);

// Puts the base before `text` if it is a path, and before each "</path>" in it: headers Location
// and Link. Left as it is where it would not fit.
void base_path_apply(char *text, size_t size);

// `path` without the base, if it begins with it.
const char *base_path_strip(const char *path);

#endif
