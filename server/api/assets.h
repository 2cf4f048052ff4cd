// Files that stand inside the program as answers. Not what says which there are: catalog.c,
// assets.c and landing.c. Used by those.
#ifndef SERVER_API_ASSETS_H
#define SERVER_API_ASSETS_H

#include "server/http/request.h"
#include "server/util/embedded.h"

// The file, or that the client has it already: its tag is what it holds.
Status assets_reply(const Request *request, Reply *reply, const EmbeddedFile *file,
                    const char *content_type);

#endif
