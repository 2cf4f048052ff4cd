// The tables themselves are made while building; here is only the way through them. They are short,
// a walk does.
#include "server/util/embedded.h"

#include <string.h>

const EmbeddedFile *embedded_find(const EmbeddedFile *table, const char *path) {
    for (const EmbeddedFile *file = table; file->path != NULL; file++)
        if (strcmp(file->path, path) == 0)
            return file;
    return NULL;
}
