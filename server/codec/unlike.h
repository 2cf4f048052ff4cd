// In which members two JSON documents differ, by JSON Pointer. Not a comparison of results. Used by
// api/cache.c.
#ifndef SERVER_CODEC_UNLIKE_H
#define SERVER_CODEC_UNLIKE_H

#include "core/base/status.h"

enum { UNLIKE_MOST = 100 };

typedef struct Unlike {
    char pointer[256];
    char here[128], there[128]; // JSON; a text where it is long, "" where there is none
} Unlike;

// The first of them are listed.
typedef struct Unlikes {
    size_t count;
    Unlike at[UNLIKE_MOST];
} Unlikes;

// STATUS_INTERNAL for what is no JSON.
Status unlike_json(const char *here, const char *there, Unlikes *differences);

#endif
