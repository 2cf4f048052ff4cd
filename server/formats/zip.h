// A ZIP archive of members that are stored as they are, the same bytes every time: no times, no
// compression. Not ZIP64: what would need it is refused. Used by npz.c and bundle.c.
#ifndef SERVER_FORMATS_ZIP_H
#define SERVER_FORMATS_ZIP_H

#include "core/base/status.h"
#include "server/formats/segments.h"

enum { ZIP_NAME_MAX = 79 };

// The archive as it is laid out. All zero but `layout` is an empty one.
typedef struct Zip {
    Segments *layout;
    Segments directory; // what comes at the end
    size_t count;
} Zip;

// Puts a member behind the last one; `content` is what it is made of. STATUS_LIMIT from 4 GiB on.
Status zip_put(Zip *zip, const char *name, const Segments *content, Problem *problem);
// Puts the directory, and clears `zip`, whatever it returns.
Status zip_end(Zip *zip, Problem *problem);

#endif
