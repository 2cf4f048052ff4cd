// A ZIP archive of members that are stored as they are, the same bytes every time: no times, no
// compression. No ZIP64: what would need it is refused.
#ifndef SERVER_FORMATS_ZIP_H
#define SERVER_FORMATS_ZIP_H

#include "core/base/status.h"
#include "server/formats/segments.h"

enum { ZIP_NAME_MAX = 79 };

// An archive being written to `segments`. All zero but that is empty.
typedef struct Zip {
    Segments *segments;
    Segments directory; // the end of the archive
    size_t count;
} Zip;

// Appends a member; borrows what `content` borrows. STATUS_LIMIT from 4 GiB on.
Status zip_put(Zip *zip, const char *name, const Segments *content, Problem *problem);
// Appends the directory and clears `zip`, also when it fails.
Status zip_end(Zip *zip, Problem *problem);

#endif
