// Writing. What a write depends on is read within its own transaction, so that of two writers who
// saw the same version one alone goes on.
#include <string.h>

#include "server/db/material_columns.h"

Status material_key_find(Sqlite *database, const char *slug, uint64_t revision, MaterialKey *key,
                         Problem *problem) {
    // Not by the view, of which a join would make all rows.
    static const char sql[] =
        "SELECT m.number, "
        "(SELECT coalesce(max(revision), 0) FROM material_revisions r WHERE r.material = m.number) "
        "AS latest, "
        "(SELECT coalesce(max(version), 0) FROM material_trail t WHERE t.material = m.number) AS "
        "version, "
        "(SELECT coalesce(max(measurement), 0) FROM material_measurements t WHERE t.material = "
        "m.number) AS measurements, "
        "coalesce((SELECT coalesce((SELECT status FROM material_reviews v WHERE v.material = "
        "m.number AND v.revision = :revision ORDER BY v.number DESC LIMIT 1), 'draft') FROM "
        "material_revisions r WHERE r.material = m.number AND r.revision = :revision), '') AS "
        "status, "
        "coalesce((SELECT author FROM material_revisions r WHERE r.material = m.number AND "
        "r.revision = :revision), '') AS author "
        "FROM materials m WHERE m.slug = :slug";
    Statement *statement;
    bool has_row = false;
    *key = (MaterialKey){.slug = (char *)slug,
                         .revision = revision > INT64_MAX ? INT64_MAX : revision};
    TRY(statement_begin(database, sql, material_key_columns, key, &statement, problem));
    Status status = statement_step(statement, &has_row, problem);
    if (status == STATUS_OK && has_row)
        status = row_read(statement, material_key_columns, key, problem);
    statement_end(statement);
    return status;
}

// A material that is there, at the version that its writer saw.
static Status require(Sqlite *database, const char *slug, uint64_t revision, uint64_t version,
                      MaterialKey *key, Problem *problem) {
    TRY(material_key_find(database, slug, revision, key, problem));
    if (key->number == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "there is no material \"%.64s\"", slug);
    if (version != ANY_VERSION && version != key->version)
        return problem_set(problem, STATUS_STALE,
                           "the material \"%.64s\" has changed since you read it: it is at version "
                           "%llu, you have seen version %llu; read it again",
                           slug, (unsigned long long)key->version, (unsigned long long)version);
    return STATUS_OK;
}

typedef struct Room {
    int64_t bytes, most;
} Room;
static const RowColumn room_columns[] = {ROW_COLUMN(Room, bytes, COLUMN_INTEGER),
                                         ROW_COLUMN(Room, most, COLUMN_INTEGER), ROW_END};

static int64_t length(const char *text) {
    return text != NULL ? (int64_t)strlen(text) : 0;
}

// Room for a row with that many bytes of texts, within the transaction that adds it.
static Status take_room(Sqlite *database, int64_t bytes, Problem *problem) {
    enum { ROW = 200 };
    static const char sql[] =
        "UPDATE material_room SET bytes = bytes + :bytes WHERE bytes + :bytes <= :most";
    const Room room = {ROW + bytes, CATALOGUE_BYTES};
    int changes = 0;
    TRY(sqlite_change(database, sql, room_columns, &room, &changes, problem));
    if (changes > 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_LIMIT,
                       "all materials with their measurements have %lld GiB, and no more is kept",
                       (long long)(CATALOGUE_BYTES >> 30));
}

static Status require_number(uint64_t number, uint64_t most, const char *slug, const char *what,
                             Problem *problem) {
    return number <= most
               ? STATUS_OK
               : problem_set(problem, STATUS_LIMIT,
                             "the material \"%.64s\" has %llu %s, and no more are kept: go on "
                             "under another slug",
                             slug, (unsigned long long)most, what);
}

Status material_row_add(Sqlite *database, const char *slug, Problem *problem) {
    // None is ever deleted: the highest number is how many there are.
    static const char sql[] = "INSERT INTO materials (slug) SELECT :slug WHERE (SELECT "
                              "coalesce(max(number), 0) FROM materials) < :revision";
    const MaterialKey key = {.slug = (char *)slug, .revision = CATALOGUE_MATERIALS};
    int changes = 0;
    TRY(take_room(database, length(slug), problem));
    TRY(sqlite_change(database, sql, material_key_columns, &key, &changes, problem));
    return changes > 0 ? STATUS_OK
                       : problem_set(problem, STATUS_LIMIT,
                                     "%d materials are kept, no more: revise one that is there",
                                     CATALOGUE_MATERIALS);
}

Status material_revision_add(Sqlite *database, const MaterialRevision *revision, Problem *problem) {
    static const char sql[] =
        "INSERT INTO material_revisions (material, revision, name, kind, thickness, hardness, "
        "supplier, notes, restitution, restitution_deviation, contact_time, "
        "contact_time_deviation, separation, least_speed, most_speed, least_temperature, "
        "most_temperature, impactor, impactor_mass, base, base_mass, source, lists, reverts, "
        "author, comment, created_unix_ms) SELECT number, :revision, :name, :kind, :thickness, "
        ":hardness, :supplier, :notes, :restitution, :restitution_deviation, :contact_time, "
        ":contact_time_deviation, :separation, :least_speed, :most_speed, :least_temperature, "
        ":most_temperature, :impactor, :impactor_mass, :base, :base_mass, :source, :lists, "
        "nullif(:reverts, 0), :author, :comment, :created_unix_ms FROM materials WHERE slug = "
        ":slug";
    const Material *said = &revision->material;
    TRY(require_number(revision->revision, CATALOGUE_REVISIONS, revision->slug, "revisions",
                       problem));
    TRY(take_room(database,
                  length(said->name) + length(said->kind) + length(said->hardness) +
                      length(said->supplier) + length(said->notes) + length(said->impactor) +
                      length(said->source) + length(revision->lists) + length(revision->comment),
                  problem));
    return sqlite_change(database, sql, material_revision_columns, revision, NULL, problem);
}

Status material_review_add(Sqlite *database, const MaterialReview *review, Problem *problem) {
    static const char sql[] =
        "INSERT INTO material_reviews (material, revision, status, reason, reviewer, "
        "created_unix_ms) SELECT number, :revision, :status, :reason, :reviewer, :created_unix_ms "
        "FROM materials WHERE slug = :slug";
    TRY(take_room(database, length(review->reason), problem));
    return sqlite_change(database, sql, material_review_columns, review, NULL, problem);
}

Status material_measurement_add(Sqlite *database, const MaterialMeasurement *measurement,
                                Problem *problem) {
    static const char sql[] =
        "INSERT INTO material_measurements (material, measurement, author, comment, "
        "created_unix_ms, drops, traces, head, document) SELECT number, :measurement, :author, "
        ":comment, :created_unix_ms, coalesce(json_array_length(:document, '$.drops'), 0), "
        "coalesce(json_array_length(:document, '$.traces'), 0), json_remove(:document, '$.drops', "
        "'$.traces'), :document FROM materials WHERE slug = :slug";
    TRY(require_number(measurement->measurement, CATALOGUE_MEASUREMENTS, measurement->slug,
                       "measurements", problem));
    TRY(take_room(database, length(measurement->comment) + length(measurement->document), problem));
    return sqlite_change(database, sql, material_measurement_columns, measurement, NULL, problem);
}

typedef struct SlugDeed {
    char *slug;
    AuditEntry deed;
} SlugDeed;
// clang-format off
static const RowColumn slug_deed_columns[] = {
    ROW_COLUMN(SlugDeed, slug, COLUMN_TEXT),
    ROW_COLUMN_AS(SlugDeed, deed.action, "action", COLUMN_TEXT),
    ROW_COLUMN_AS(SlugDeed, deed.revision, "revision", COLUMN_COUNT),
    ROW_COLUMN_AS(SlugDeed, deed.measurement, "measurement", COLUMN_COUNT),
    ROW_COLUMN_AS(SlugDeed, deed.who, "who", COLUMN_TEXT),
    ROW_COLUMN_AS(SlugDeed, deed.why, "why", COLUMN_TEXT),
    ROW_COLUMN_AS(SlugDeed, deed.created_unix_ms, "created_unix_ms", COLUMN_INTEGER),
    ROW_END
};
// clang-format on

Status audit_entry_add(Sqlite *database, const char *slug, const AuditEntry *deed,
                       Problem *problem) {
    static const char sql[] =
        "INSERT INTO material_trail (material, version, action, revision, measurement, who, why, "
        "created_unix_ms) SELECT number, 1 + (SELECT coalesce(max(version), 0) FROM "
        "material_trail t WHERE t.material = m.number), :action, nullif(:revision, 0), "
        "nullif(:measurement, 0), :who, :why, :created_unix_ms FROM materials m WHERE slug = :slug";
    const SlugDeed both = {(char *)slug, *deed};
    TRY(take_room(database, length(deed->why), problem));
    return sqlite_change(database, sql, slug_deed_columns, &both, NULL, problem);
}

// A revision and its entry in the trail.
static Status put_revision(Sqlite *database, const MaterialRevision *revision, char *action,
                           Problem *problem) {
    const AuditEntry deed = {.action = action,
                             .revision = revision->revision,
                             .who = revision->author,
                             .why = revision->comment,
                             .created_unix_ms = revision->created_unix_ms};
    TRY(material_revision_add(database, revision, problem));
    return audit_entry_add(database, revision->slug, &deed, problem);
}

static Status add(Sqlite *database, const void *work, Problem *problem) {
    MaterialRevision first = *(const MaterialRevision *)work;
    MaterialKey key;
    TRY(material_key_find(database, first.slug, 0, &key, problem));
    if (key.number != 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "there is a material \"%.64s\" already: add a revision to it, or choose "
                           "another slug",
                           first.slug);
    first.revision = 1;
    TRY(material_row_add(database, first.slug, problem));
    return put_revision(database, &first, "create", problem);
}

// Readers of the catalogue are told of what was written.
static Status write(Db *db, StoreApply *apply, const void *work, Problem *problem) {
    const Status status = db_write(db, apply, work, problem);
    if (status == STATUS_OK)
        db_catalog_changed(db);
    return status;
}

Status db_material_add(Db *db, const MaterialRevision *first, Problem *problem) {
    return write(db, add, first, problem);
}

typedef struct Revise {
    MaterialRevision *revision;
    uint64_t version;
} Revise;

static Status revise(Sqlite *database, const void *work, Problem *problem) {
    const Revise *asked = work;
    MaterialKey key;
    TRY(require(database, asked->revision->slug, 0, asked->version, &key, problem));
    asked->revision->revision = key.latest + 1;
    return put_revision(database, asked->revision,
                        asked->revision->reverts > 0 ? "revert" : "revise", problem);
}

Status db_material_revise(Db *db, MaterialRevision *revision, uint64_t version, Problem *problem) {
    return write(db, revise, &(Revise){revision, version}, problem);
}

typedef struct Review {
    const MaterialReview *review;
    uint64_t version;
} Review;

static Status judge(Sqlite *database, const void *work, Problem *problem) {
    const Review *asked = work;
    const MaterialReview *review = asked->review;
    const bool approves = strcmp(review->status, "approved") == 0;
    MaterialKey key;
    TRY(require(database, review->slug, review->revision, asked->version, &key, problem));
    if (key.status[0] == '\0')
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no material \"%.64s\" with a revision %llu", review->slug,
                           (unsigned long long)review->revision);
    if (strcmp(key.status, review->status) == 0)
        return problem_set(problem, STATUS_CONFLICT, "%.64s@%llu is %s already", review->slug,
                           (unsigned long long)review->revision, key.status);
    if (approves && review->reviewer != NULL && strcmp(key.author, review->reviewer) == 0)
        return problem_set(problem, STATUS_FORBIDDEN,
                           "nobody approves their own revision: %.64s@%llu is by %.64s, somebody "
                           "else has to look at it",
                           review->slug, (unsigned long long)review->revision, key.author);
    const AuditEntry deed = {.action = approves ? "approve" : "deprecate",
                             .revision = review->revision,
                             .who = review->reviewer,
                             .why = review->reason,
                             .created_unix_ms = review->created_unix_ms};
    TRY(material_review_add(database, review, problem));
    return audit_entry_add(database, review->slug, &deed, problem);
}

Status db_material_review(Db *db, const MaterialReview *review, uint64_t version,
                          Problem *problem) {
    return write(db, judge, &(Review){review, version}, problem);
}

typedef struct Measure {
    MaterialMeasurement *measurement;
    uint64_t version;
} Measure;

static Status measure(Sqlite *database, const void *work, Problem *problem) {
    const Measure *asked = work;
    MaterialMeasurement *measurement = asked->measurement;
    MaterialKey key;
    TRY(require(database, measurement->slug, 0, asked->version, &key, problem));
    measurement->measurement = key.measurements + 1;
    const AuditEntry deed = {.action = "measure",
                             .measurement = measurement->measurement,
                             .who = measurement->author,
                             .why = measurement->comment,
                             .created_unix_ms = measurement->created_unix_ms};
    TRY(material_measurement_add(database, measurement, problem));
    return audit_entry_add(database, measurement->slug, &deed, problem);
}

Status db_material_measure(Db *db, MaterialMeasurement *measurement, uint64_t version,
                           Problem *problem) {
    TRY(db_write(db, measure, &(Measure){measurement, version}, problem));
    db_material_measured(db);
    return STATUS_OK;
}
