// In which members two JSON documents differ, by JSON Pointer. Not a comparison of results. Used by
// api/cache.c.
#ifndef SERVER_CODEC_DIFFER_H
#define SERVER_CODEC_DIFFER_H

#include "core/base/status.h"

enum { DIFFER_MOST = 100 };

typedef struct Difference {
    char pointer[256];
    char here[128], there[128]; // JSON; a text where it is long, "" where there is none
} Difference;

// The first of them are listed.
typedef struct Differences {
    size_t count;
    Difference at[DIFFER_MOST];
} Differences;

// STATUS_INTERNAL for what is no JSON.
Status differ_json(const char *here, const char *there, Differences *differences);

#endif
