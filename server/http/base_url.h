// The address that clients reach us by, behind a proxy: "https://sim.example.org/impactd".
// Not where we listen (address.h). Used by cli/serve.c.
#ifndef SERVER_HTTP_BASE_URL_H
#define SERVER_HTTP_BASE_URL_H

#include "core/base/status.h"
#include "server/util/base_path.h"

typedef struct BaseUrl {
    char text[256];            // without a slash at its end
    char host[200];            // as a Host header has it, without port
    char path[LINK_BASE_SIZE]; // "/impactd", or ""
} BaseUrl;

// STATUS_USAGE says what would be right.
Status base_url_read(const char *text, BaseUrl *url, Problem *problem);

#endif
