// One table on its way out in one format: whole, or piece by piece from any place. What it borrows
// stays borrowed. Not HTTP: api/columns.c makes streams of it. Used by that and cli/run.c.
#ifndef SERVER_FORMATS_ENCODING_H
#define SERVER_FORMATS_ENCODING_H

#include "server/formats/format.h"

typedef struct Encoding Encoding;

// Appends the whole document. STATUS_LIMIT where the format has no room for it; what `bytes` has no
// room for is told by `bytes` itself.
Status encoding_write(const TableFormat *encoder, const Table *table, Bytes *bytes,
                      Problem *problem);

// Borrows the table's columns and their list until encoding_close.
Status encoding_open(const TableFormat *encoder, const Table *table, Encoding **encoding,
                     Problem *problem);
// A document whose every byte has its place. Takes what `layout` holds, also when it fails.
Status encoding_open_layout(Segments *layout, Encoding **encoding, Problem *problem);
void encoding_close(Encoding *encoding);

uint64_t encoding_size(const Encoding *encoding); // UINT64_MAX: not known beforehand
// Only bytes first ... first + size - 1 from now on. For sizes that are known.
void encoding_cut(Encoding *encoding, uint64_t first, uint64_t size);
// The next bytes, at most `size`; 0 behind the last one.
size_t encoding_next(Encoding *encoding, char *target, size_t size);

#endif
