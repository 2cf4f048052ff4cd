// All materials as a document, to be carried to another database and back: its rows, and how what
// was read becomes an import. Not the texts (exchange_json.h, exchange_csv.h;
// formats/material_export.h writes them) and not the database's judgement (db/material_import.h).
// Used by those and by api/.
#ifndef SERVER_MATERIALS_EXCHANGE_H
#define SERVER_MATERIALS_EXCHANGE_H

#include "core/drop_test/drop_test.h"
#include "core/scene/material.h"
#include "server/db/material_import.h"

enum { EXCHANGE_VERSION = 1, EXCHANGE_ROWS_MAX = 100000 };
extern const char exchange_format[]; // "impactd-materials"

typedef enum ExchangeKind { EXCHANGE_REVISION, EXCHANGE_MEASUREMENT } ExchangeKind;

typedef struct ExchangeReview {
    int status; // of material_verdicts
    char *reason;
    char *reviewer; // NULL: not said; "": nobody known
    char *created;  // RFC 3339
} ExchangeReview;
typedef struct ExchangeReviews {
    ExchangeReview *at;
    size_t count;
} ExchangeReviews;

// A revision or a measurement.
typedef struct ExchangeRow {
    int row;         // ExchangeKind
    char *slug;      // of tables alone
    uint64_t number; // of the revision, the measurement; COUNT_ABSENT: the next
    Material material;
    uint64_t reverts;
    char *author; // NULL: not said; "": nobody known
    char *comment;
    char *created; // RFC 3339; NULL: now
    ExchangeReviews reviews;
    DropTest test;
} ExchangeRow;

extern const Field exchange_revision_fields[], exchange_measurement_fields[]; // in a document
extern const Field exchange_row_fields[]; // of a table, the columns in their order

// A file as far as it is read. All zero is empty.
typedef struct Exchange {
    MaterialImport import;
    size_t revision_room, measurement_room;
} Exchange;
void exchange_clear(Exchange *exchange);

// Takes over what a row says, which is left clear. Adds the faults that are found below `place`;
// `faults` is how many there were before the row was read: with more the row is faulty. A slug that
// is none is told at `slug_place`, and the row given up. STATUS_NO_MEMORY, STATUS_LIMIT.
Status exchange_take(Exchange *exchange, const char *slug, ExchangeKind kind, ExchangeRow *row,
                     const char *place, const char *slug_place, size_t faults, Problem *problem);

// A row of that slug of which nothing more is known: other numbers need not continue then.
Status exchange_drift(Exchange *exchange, const char *slug, const char *place, Problem *problem);

// STATUS_LIMIT: more than EXCHANGE_ROWS_MAX rows.
Status exchange_refuse_many(Problem *problem);

// Sorts what was taken, tells what cannot stand beside each other, and imports it for `who` (NULL:
// the local user): db_material_import.
Status exchange_import(Exchange *exchange, Db *db, const char *who, bool may_all, bool is_dry,
                       ImportTally *metrics, Problem *problem);

#endif
