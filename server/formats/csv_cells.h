// Cells of the studies' CSV tables, by Field rows. Not the CSV of series (csv.h). Used by the
// studies' tables.
#ifndef SERVER_FORMATS_CSV_CELLS_H
#define SERVER_FORMATS_CSV_CELLS_H

#include "core/base/field.h"
#include "server/util/bytes.h"

// ",name [unit]" for each REAL and COUNT row.
void csv_cells_header(Bytes *bytes, const Field *fields);
// The same with `before` and a dot in front of each name.
void csv_cells_header_of(Bytes *bytes, const char *before, const Field *fields);

// "," and the number for each REAL and COUNT row; "nan" where it is not known.
void csv_cells_members(Bytes *bytes, const Field *fields, const void *item);

void csv_cells_real(Bytes *bytes, double value);     // "nan", "inf" and "-inf" too
void csv_cells_text(Bytes *bytes, const char *text); // quoted, its quotes doubled; NULL: nothing

#endif
