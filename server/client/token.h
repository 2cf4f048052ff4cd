// The bearer token a client sends: from a file that only its owner can read, or the environment;
// never an argument, which every user of a machine can see. Used by command/daemon.c.
#ifndef SERVER_CLIENT_TOKEN_H
#define SERVER_CLIENT_TOKEN_H

#include "core/base/status.h"

enum { TOKEN_MAX = 512 };

// Reads the first line of `path`, or, where that is NULL, IMPACTD_TOKEN; "" if there is neither.
Status token_read(const char *path, char token[TOKEN_MAX + 1], Problem *problem);

#endif
