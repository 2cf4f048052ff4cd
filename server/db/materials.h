// The materials as they are stored: revisions, reviews, measurements and the trail of who did what.
// Rows are added and never changed; the database itself refuses it. Not what the numbers mean
// (core/scene/material.h) and not JSON: lists and drop tests are documents here. Used by materials/
// and by whoever resolves names.
#ifndef SERVER_DB_MATERIALS_H
#define SERVER_DB_MATERIALS_H

#include "core/scene/material.h"
#include "server/db/db.h"

// A revision with what its last review made of it. Texts are owned; not known: NULL, NAN.
typedef struct MaterialRevision {
    char *slug;
    uint64_t revision;
    Material material; // but for its lists
    char *lists; // tags, table, measurements: a JSON object of material_list_fields; NULL: none
    uint64_t reverts; // the revision that it says again; 0: none
    char *author;     // a token's name; NULL: the local user, or the program
    char *comment;
    int64_t created_unix_ms;
    // Of its last review; "draft" and nothing without one.
    char *status, *reason, *reviewer;
    int64_t reviewed_unix_ms;
    // Of the material: its newest revision, and how much was done to it.
    uint64_t latest, version;
} MaterialRevision;
typedef struct MaterialRevisions {
    MaterialRevision *at;
    size_t count;
} MaterialRevisions;
void material_revision_clear(MaterialRevision *revision);

// How far a material has come.
typedef struct MaterialState {
    uint64_t latest, version, measurements; // the newest of each; measurements 0: none
} MaterialState;
// As it is in the database now. STATUS_NOT_FOUND.
Status db_material_state(Db *db, const char *slug, MaterialState *state, Problem *problem);

// revision 0: the head, which is the newest approved one, else the newest draft. STATUS_NOT_FOUND,
// also where all are deprecated.
Status db_material(Db *db, const char *slug, uint64_t revision, MaterialRevision *material,
                   Problem *problem);
// The slugs of all materials, by name.
Status db_material_slugs(Db *db, Texts *slugs, Problem *problem);
void material_slugs_clear(Texts *slugs);
// The heads of materials, by slug; of those that are all deprecated the newest revision. At most
// `most` of them, those behind the slug `after` ("": from the first).
Status db_material_heads(Db *db, const char *after, size_t most, MaterialRevisions *materials,
                         Problem *problem);
// Newest first, at most `most` of one material's, those before `before`.
Status db_material_page(Db *db, const char *slug, uint64_t before, size_t most,
                        MaterialRevisions *revisions, Problem *problem);
void material_revisions_clear(MaterialRevisions *materials);

typedef struct MaterialReview {
    char *slug;
    uint64_t revision;
    char *status; // "approved", "deprecated"
    char *reason, *reviewer;
    int64_t created_unix_ms;
} MaterialReview;
typedef struct MaterialReviews {
    MaterialReview *at;
    size_t count;
} MaterialReviews;
void material_reviews_clear(MaterialReviews *reviews);

typedef struct MaterialMeasurement {
    char *slug;
    uint64_t measurement; // from 1
    char *author, *comment;
    int64_t created_unix_ms;
    char *document; // the drop test, JSON
} MaterialMeasurement;
// STATUS_NOT_FOUND. `measurement` may be uninitialised.
Status db_material_measurement(Db *db, const char *slug, uint64_t number,
                               MaterialMeasurement *measurement, Problem *problem);
void material_measurement_clear(MaterialMeasurement *measurement);

// A measurement without its readings, which are counted. `document` is the drop test but for them.
typedef struct MeasurementSummary {
    MaterialMeasurement row;
    uint64_t drops, traces;
} MeasurementSummary;
typedef struct MeasurementSummaries {
    MeasurementSummary *at;
    size_t count;
} MeasurementSummaries;
// Newest first, at most `most` of one material's, those before `before`.
Status db_measurement_summaries(Db *db, const char *slug, uint64_t before, size_t most,
                                MeasurementSummaries *briefs, Problem *problem);
void measurement_summaries_clear(MeasurementSummaries *briefs);

typedef struct AuditEntry {
    uint64_t version;               // of the material after it; what is added gets the next
    char *action;                   // "create", "revise" ...: schema/sql/schema.sql
    uint64_t revision, measurement; // 0: not about one
    char *who, *why;
    int64_t created_unix_ms;
} AuditEntry;
typedef struct AuditEntries {
    AuditEntry *at;
    size_t count;
} AuditEntries;
// The trail of one material, newest first, at most `most` entries, those before `before`.
Status db_audit_entries(Db *db, const char *slug, uint64_t before, size_t most,
                        AuditEntries *audit_entries, Problem *problem);
void audit_entries_clear(AuditEntries *audit_entries);

// Each revision with how many results were made with it, newest first.
typedef struct MaterialReference {
    uint64_t revision, results;
    char status[16];
} MaterialReference;
typedef struct MaterialReferences {
    MaterialReference *at; // freed by free
    size_t count;
} MaterialReferences;
Status db_material_uses(Db *db, const char *slug, MaterialReferences *uses, Problem *problem);

// Results made with `name` ("sponge@1", "record:elcentro"), newest first, at most `most` of them,
// those before the one numbered `before` (0: from the newest); *total counts all.
typedef struct ResultUse {
    int64_t number; // the store's
    char id[72];
    int64_t created_unix_ms;
} ResultUse;
typedef struct ResultUses {
    ResultUse *at; // freed by free
    size_t count;
} ResultUses;
Status db_result_uses(Db *db, const char *name, size_t most, int64_t before, ResultUses *uses,
                      uint64_t *total, Problem *problem);

// What is kept is kept for good, so there is an end to it: STATUS_LIMIT from each that writes.
enum {
    CATALOGUE_MATERIALS = 100000,
    CATALOGUE_REVISIONS = 10000,    // of a material
    CATALOGUE_MEASUREMENTS = 10000, // of a material
};
#define CATALOGUE_BYTES (INT64_C(64) << 30) // of all texts, and a bit for each row

// Writing. Each is one transaction, durable when the call returns, and tells the catalogue's
// readers. `version`: what the material's must be now (ANY_VERSION: whatever it is), else
// STATUS_STALE, which tells the version that it has. Missing materials are STATUS_NOT_FOUND.
#define ANY_VERSION UINT64_MAX

// The first revision of a new material. STATUS_CONFLICT where the slug is taken. Slug, material,
// lists, author, comment and created_unix_ms are read.
Status db_material_add(Db *db, const MaterialRevision *first, Problem *problem);
// Adds a revision and sets revision->revision; `reverts` is kept (0: none), the rest as above. That
// the measurements that it names are there is for the caller to see to.
Status db_material_revise(Db *db, MaterialRevision *revision, uint64_t version, Problem *problem);
// STATUS_CONFLICT where the revision has that status already; STATUS_FORBIDDEN where its author,
// known by name, approves it.
Status db_material_review(Db *db, const MaterialReview *review, uint64_t version, Problem *problem);
// Adds a measurement and sets its number.
Status db_material_measure(Db *db, MaterialMeasurement *measurement, uint64_t version,
                           Problem *problem);

#endif
