// Import of materials: the staging list that the rows of a file are read into, its validation
// against the database, and its write, all of it or nothing, in one transaction.
#ifndef SERVER_DB_MATERIAL_IMPORT_H
#define SERVER_DB_MATERIAL_IMPORT_H

#include "core/drop_test/drop_test.h"
#include "server/db/materials.h"
#include "server/util/hashmap.h"

enum { IMPORT_ROWS_MAX = 100000, IMPORT_PLACE_SIZE = 64 };

typedef enum ImportKind {
    IMPORT_REVISION,
    IMPORT_MEASUREMENT,
    IMPORT_UNKNOWN, // its kind could not be read: numbers of its material need not continue
} ImportKind;

typedef struct ImportReview {
    int status; // index into material_verdicts
    char *reason;
    char *reviewer;          // NULL: absent, then the importer; "": unknown
    char *created;           // RFC 3339; NULL: now
    int64_t created_unix_ms; // of it; 0: none
} ImportReview;
typedef struct ImportReviews {
    ImportReview *at;
    size_t count;
} ImportReviews;

// A revision or a measurement.
typedef struct ImportRow {
    HashMapEntry indexed; // by its document
    // As the file has it.
    int kind; // ImportKind
    char *slug;
    uint64_t number; // of the revision or measurement; COUNT_ABSENT: the next one
    Material material;
    uint64_t reverts;
    char *author; // NULL: absent, then the importer; "": unknown
    char *comment;
    char *created; // RFC 3339; NULL: now
    ImportReviews reviews;
    DropTest test;
    // Set when it joins the list.
    char place[IMPORT_PLACE_SIZE]; // JSON Pointer
    size_t order;                  // in the file
    int64_t created_unix_ms;       // of `created`; 0: none
    char *document;                // the test as JSON; NULL if faulty
    bool is_faulty;      // has faults already: its number counts, what is valid is compared
    bool is_stored;      // a measurement without a number whose test the database has
    bool number_unknown; // has a number that could not be read
} ImportRow;

typedef struct MaterialImport {
    ImportRow *rows;
    size_t count, capacity;
    const char *number_names[2]; // of ImportRow.number in the file, by kind
    bool is_partial;             // columns are missing: stored revisions are not compared
    const char *who;             // the importer; NULL: the local user
    bool may_all;                // may import rows of other authors, times and reviews
    int64_t now_unix_ms;
} MaterialImport;

typedef struct ImportCount {
    size_t added, same;
} ImportCount;
typedef struct ImportTally {
    size_t materials;
    ImportCount revisions, measurements, reviews;
} ImportTally;

// Sorts and validates the list. Writes it unless `is_dry` or `problem` has faults before or after.
// STATUS_INVALID: the faults. STATUS_FORBIDDEN: rows that need `may_all`.
Status db_material_import(Db *db, MaterialImport *import, bool is_dry, ImportTally *tally,
                          Problem *problem);

#endif
