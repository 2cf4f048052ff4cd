// Materials in the database: revisions, reviews, measurements and the audit log. Rows are added and
// never changed; triggers enforce it. Drop tests are JSON documents here.
#ifndef SERVER_DB_MATERIALS_H
#define SERVER_DB_MATERIALS_H

#include "core/scene/material.h"
#include "server/db/db.h"
#include "server/util/bytes.h"

// A revision with its last review. Texts are owned; unknown: NULL, NAN.
typedef struct MaterialRevision {
    char *slug;
    uint64_t revision;
    Material material;
    char *lists;      // used while a row is read or written
    uint64_t reverts; // the revision whose contents it has again; 0: none
    char *author;     // a token's name; NULL: the local user, or the program
    char *comment;
    int64_t created_unix_ms;
    // Of its last review; without one "draft" and nothing else.
    char *status, *reason, *reviewer;
    int64_t reviewed_unix_ms;
    // Of the material: its newest revision, and the number of its audit entries.
    uint64_t latest, version;
} MaterialRevision;
typedef struct MaterialRevisions {
    MaterialRevision *at;
    size_t count;
} MaterialRevisions;
void material_revision_clear(MaterialRevision *revision);

// One member of a material as JSON text, in `bytes`, which is emptied first; "null" if it is
// absent. NULL without memory.
const char *material_member_json(Bytes *bytes, const Field *field, const Material *material);

// The newest number of each kind of row; measurements 0: none.
typedef struct MaterialState {
    uint64_t latest, version, measurements;
} MaterialState;
// STATUS_NOT_FOUND.
Status db_material_state(Db *db, const char *slug, MaterialState *state, Problem *problem);

// Revision 0 is the head: the newest approved revision, else the newest draft. STATUS_NOT_FOUND,
// also if all are deprecated. `material` is cleared by the caller in any case.
Status db_material(Db *db, const char *slug, uint64_t revision, MaterialRevision *material,
                   Problem *problem);
// A revision that several share, read once while no material changes. To be given to
// refcount_unref(&shared->refcount).
typedef struct SharedRevision {
    Refcount refcount;
    MaterialRevision revision;
} SharedRevision;
Status db_material_shared(Db *db, const char *slug, uint64_t revision, SharedRevision **shared,
                          Problem *problem);
// The slugs of all materials, by name.
Status db_material_slugs(Db *db, Texts *slugs, Problem *problem);
void material_slugs_clear(Texts *slugs);
// The heads of at most `max` materials, by slug, those after the slug `after` ("": from the first).
// Of a material without a head it is the newest revision.
Status db_material_heads(Db *db, const char *after, size_t max, MaterialRevisions *materials,
                         Problem *problem);
// Newest first, at most `max` revisions of one material, those before `before`.
Status db_material_page(Db *db, const char *slug, uint64_t before, size_t max,
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
    char *document; // the drop test as JSON
    char *head;     // the same without drops and traces, which are counted; of a stored one
    uint64_t drops, traces;
} MaterialMeasurement;
typedef struct MaterialMeasurements {
    MaterialMeasurement *at;
    size_t count;
} MaterialMeasurements;
// STATUS_NOT_FOUND. `measurement` may be uninitialised.
Status db_material_measurement(Db *db, const char *slug, uint64_t number,
                               MaterialMeasurement *measurement, Problem *problem);
void material_measurement_clear(MaterialMeasurement *measurement);
// Newest first, at most `max` of one material, those before `before`, without their documents.
Status db_measurement_heads(Db *db, const char *slug, uint64_t before, size_t max,
                            MaterialMeasurements *measurements, Problem *problem);
void material_measurements_clear(MaterialMeasurements *measurements);

typedef struct AuditEntry {
    uint64_t version;               // of the material after it; what is added gets the next
    char *action;                   // "create", "revise" ...: schema/sql/schema.sql
    uint64_t revision, measurement; // 0: not about one
    char *who, *why;
    int64_t created_unix_ms;
    char *slug; // of the material, for a new entry
} AuditEntry;
typedef struct AuditEntries {
    AuditEntry *at;
    size_t count;
} AuditEntries;
// The audit log of one material, newest first, at most `max` entries, those before `before`.
Status db_audit_entries(Db *db, const char *slug, uint64_t before, size_t max,
                        AuditEntries *entries, Problem *problem);
void audit_entries_clear(AuditEntries *entries);

Status db_material_moment(Db *db, MaterialMoment *moment, Problem *problem);
// What the functions below find is cleared by the caller in any case; *is_found is false after the
// last one. The revision of the material after `number`; 0: the first one of the next material.
// Its last review is not read.
Status db_revision_after(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                         MaterialRevision *revision, bool *is_found, Problem *problem);
Status db_measurement_after(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                            MaterialMeasurement *measurement, bool *is_found, Problem *problem);
// All reviews of a revision in their order.
Status db_reviews(Db *db, const MaterialMoment *moment, const char *slug, uint64_t revision,
                  MaterialReviews *reviews, Problem *problem);

// Each revision with the number of results that used it, newest first.
typedef struct MaterialReference {
    uint64_t revision, results;
    char status[16];
} MaterialReference;
typedef struct MaterialReferences {
    MaterialReference *at; // freed by free
    size_t count;
} MaterialReferences;
Status db_material_uses(Db *db, const char *slug, MaterialReferences *uses, Problem *problem);

// Results that used `name` ("sponge@1", "record:elcentro"), newest first, at most `max`, those
// before the row `before` (0: from the newest); *total counts all.
typedef struct ResultUse {
    int64_t number; // of the row
    char id[72];
    int64_t created_unix_ms;
} ResultUse;
typedef struct ResultUses {
    ResultUse *at; // freed by free
    size_t count;
} ResultUses;
Status db_result_uses(Db *db, const char *name, size_t max, int64_t before, ResultUses *uses,
                      uint64_t *total, Problem *problem);

// Nothing is ever deleted, so there are limits: STATUS_LIMIT from each function that writes.
enum {
    CATALOGUE_MATERIALS = 100000,
    CATALOGUE_REVISIONS = 10000,    // of a material
    CATALOGUE_MEASUREMENTS = 10000, // of a material
};
#define CATALOGUE_BYTES (INT64_C(64) << 30) // of all texts, and some more for each row

// Writing. Each call is one transaction and durable when it returns. `version` is what the
// material's must be now (ANY_VERSION: any), else STATUS_STALE with the present one.
// STATUS_NOT_FOUND: there is no such material.
#define ANY_VERSION UINT64_MAX

// The first revision of a new material: slug, material, author, comment and created_unix_ms.
// STATUS_CONFLICT: the slug is taken.
Status db_material_add(Db *db, MaterialRevision *first, Problem *problem);
// Adds a revision and sets revision->revision; `reverts` and the members above are stored. The
// caller has validated its measurements.
Status db_material_revise(Db *db, MaterialRevision *revision, uint64_t version, Problem *problem);
// STATUS_CONFLICT: the revision has that status already. STATUS_FORBIDDEN: its author approves it.
Status db_material_review(Db *db, const MaterialReview *review, uint64_t version, Problem *problem);
// Adds a measurement and sets its number.
Status db_material_measure(Db *db, MaterialMeasurement *measurement, uint64_t version,
                           Problem *problem);

#endif
