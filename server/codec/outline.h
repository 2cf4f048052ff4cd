// A JSON document as blocks that people read: of each object its names and values, of objects that
// are alike and of each list of objects a table. Not a reader by Field rows: what a newer server
// tells is shown as well. Used by command/.
#ifndef SERVER_CODEC_OUTLINE_H
#define SERVER_CODEC_OUTLINE_H

#include "core/base/field.h"

enum { OUTLINE_BLOCKS = 200, OUTLINE_ROWS = 2000, OUTLINE_COLUMNS = 12 };

// Which columns the table of a list has, in this order, as far as they say something; other lists
// have all that do.
typedef struct OutlineTable {
    const char *list;
    const char *columns[OUTLINE_COLUMNS + 1]; // NULL-terminated
} OutlineTable;

typedef struct OutlineWay {
    const char *const *besides; // members passed over, at any depth; NULL-terminated
    const OutlineTable *tables; // ends with list NULL; may be NULL
    const Field *const *fields; // tables of rows that know units by name; NULL-terminated
} OutlineWay;

// Cell (row, column) is cells[row * columns + column], "" where nothing is known. With heads the
// first row has the names of the columns; without there are two, a name and its value.
typedef struct OutlineBlock {
    char *heading; // "evaluation trend"; "" for the document itself
    bool has_heads;
    size_t rows, columns;
    size_t more; // rows beyond
    char **cells;
} OutlineBlock;

typedef struct Outline {
    OutlineBlock *at;
    size_t count;
    bool is_cut; // there are more blocks
} Outline;

// In the document's order; what is null or empty is passed over. STATUS_UNREADABLE if it is no JSON
// object. Cleared by outline_clear in any case.
Status outline_read(const char *text, size_t size, const OutlineWay *way, Outline *outline,
                    Problem *problem);
void outline_clear(Outline *outline);

#endif
