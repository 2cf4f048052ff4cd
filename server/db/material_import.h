// Rows of materials that come from elsewhere: judged against what is there and written, all of them
// or none, in one transaction. Not the reading of files (materials/exchange.h). Used by materials/.
#ifndef SERVER_DB_MATERIAL_IMPORT_H
#define SERVER_DB_MATERIAL_IMPORT_H

#include "server/db/materials.h"

enum { IMPORT_PLACE_SIZE = 64 };

// What a file says of a row besides its contents.
typedef struct RowInfo {
    char place[IMPORT_PLACE_SIZE]; // JSON Pointer
    size_t order;                  // in the file
    bool is_faulty; // told already: its number counts, and what could be read is compared
    bool is_adrift; // it has a number that could not be read
    bool has_author, has_comment, has_created; // else the importer's, a word for it, and now
} RowInfo;

typedef struct ImportReview {
    MaterialReview review; // but for slug and revision
    bool has_reviewer, has_created;
} ImportReview;

typedef struct ImportRevision {
    RowInfo mark;
    MaterialRevision said; // revision 0: the next, unless the newest says the same
    ImportReview *reviews; // in their order
    size_t review_count;
} ImportRevision;

typedef struct ImportMeasurement {
    RowInfo mark;
    MaterialMeasurement made; // measurement 0: the next, unless its test is there
} ImportMeasurement;

// Both lists are by slug, then by number, those without one last, in the file's order.
typedef struct MaterialImport {
    ImportRevision *revisions;
    size_t revision_count;
    ImportMeasurement *measurements;
    size_t measurement_count;
    const char *revision_name, *measurement_name; // of the number below a row's place
    bool is_partial; // columns that it needs are missing, and told: what is there is not compared
    const char *who; // imports; NULL: the local user
    bool may_all;    // bring what is by others, and reviews, which else is STATUS_FORBIDDEN
    int64_t now_unix_ms;
    // Whether both say the same of the material. What `ours` says otherwise is told below `place`;
    // NULL: nothing is told.
    bool (*says_same)(const MaterialRevision *ours, const MaterialRevision *there,
                      const char *place, Problem *problem);
} MaterialImport;

typedef struct ImportCount {
    size_t added, same;
} ImportCount;
typedef struct ImportTally {
    size_t materials;
    ImportCount revisions, measurements, reviews;
} ImportTally;

// Judges all of it; adds it unless `is_dry`, or `problem` has faults already or comes to have some:
// then nothing is written. STATUS_INVALID: the faults. Tells the catalogue's readers.
Status db_material_import(Db *db, const MaterialImport *import, bool is_dry, ImportTally *metrics,
                          Problem *problem);

void import_revision_clear(ImportRevision *revision);
void import_measurement_clear(ImportMeasurement *measurement);

#endif
