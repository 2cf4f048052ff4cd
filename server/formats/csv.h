// Cells of CSV tables (RFC 4180); the CSV of a Table is format_csv.
#ifndef SERVER_FORMATS_CSV_H
#define SERVER_FORMATS_CSV_H

#include "core/base/field.h"
#include "server/util/bytes.h"

// ",name [unit]" for each REAL and COUNT row.
void csv_cells_header(Bytes *bytes, const Field *fields);
// The same with `before` and a dot in front of each name.
void csv_cells_header_of(Bytes *bytes, const char *before, const Field *fields);

// "," and the number for each REAL and COUNT row; "nan" where it is unknown.
void csv_cells_members(Bytes *bytes, const Field *fields, const void *item);

void csv_cells_real(Bytes *bytes, double value);     // "nan", "inf" and "-inf" too
void csv_cells_text(Bytes *bytes, const char *text); // quoted, its quotes doubled; NULL: nothing

#endif
