// The view material_states joins each revision with its last review. What a write depends on is
// read in its own transaction, so that of two writers who saw the same version one is refused.
#include "server/db/materials.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/material_rows.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/hashmap.h"

// Columns. Those of a revision that are the material's are made of its Field rows; its lists are
// one column.

// clang-format off
static const SqlColumn revision_own_columns[] = {
    COLUMN(MaterialRevision, slug),
    COLUMN(MaterialRevision, revision),
    COLUMN(MaterialRevision, lists),
    COLUMN(MaterialRevision, reverts),
    COLUMN(MaterialRevision, author),
    COLUMN(MaterialRevision, comment),
    COLUMN(MaterialRevision, created_unix_ms),
    COLUMN(MaterialRevision, status),
    COLUMN(MaterialRevision, reason),
    COLUMN(MaterialRevision, reviewer),
    COLUMN(MaterialRevision, reviewed_unix_ms),
    COLUMN(MaterialRevision, latest),
    COLUMN(MaterialRevision, version),
    COLUMN_END
};
// clang-format on
static SqlColumn revision_columns[40];
static char revision_insert[1600];

static void revision_columns_make(void) {
    char names[600] = "", values[600] = "", value[64];
    SqlColumn *column = revision_columns;
    for (const Field *field = material_fields; field->kind != FIELD_KIND_END; field++) {
        *column = (SqlColumn){.name = field->name,
                              .offset = offsetof(MaterialRevision, material) + field->offset};
        if (field->kind == FIELD_KIND_TEXT) {
            column->kind = COLUMN_TEXT;
            column->size = sizeof(char *);
        } else if (field->kind == FIELD_KIND_REAL) {
            column->kind = COLUMN_REAL;
            column->size = sizeof(double);
        } else if (field->kind == FIELD_KIND_CHOICE) {
            column->kind = COLUMN_CHOICE;
            column->size = sizeof(int);
        } else {
            continue;
        }
        snprintf(value, sizeof value, ":%s", field->name);
        text_list(names, sizeof names, field->name);
        text_list(values, sizeof values, value);
        column++;
    }
    memcpy(column, revision_own_columns, sizeof revision_own_columns);
    snprintf(revision_insert, sizeof revision_insert,
             "INSERT INTO material_revisions (material, revision, lists, reverts, author, comment, "
             "created_unix_ms, %s) SELECT number, :revision, :lists, nullif(:reverts, 0), :author, "
             ":comment, :created_unix_ms, %s FROM materials WHERE slug = :slug",
             names, values);
}

const SqlColumn *material_revision_columns(void) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    (void)pthread_once(&once, revision_columns_make);
    return revision_columns;
}

// clang-format off
const SqlColumn material_review_columns[] = {
    COLUMN(MaterialReview, slug),
    COLUMN(MaterialReview, revision),
    COLUMN(MaterialReview, status),
    COLUMN(MaterialReview, reason),
    COLUMN(MaterialReview, reviewer),
    COLUMN(MaterialReview, created_unix_ms),
    COLUMN_END
};

const SqlColumn material_measurement_columns[] = {
    COLUMN(MaterialMeasurement, slug),
    COLUMN(MaterialMeasurement, measurement),
    COLUMN(MaterialMeasurement, author),
    COLUMN(MaterialMeasurement, comment),
    COLUMN(MaterialMeasurement, created_unix_ms),
    COLUMN(MaterialMeasurement, document),
    COLUMN(MaterialMeasurement, drops),
    COLUMN(MaterialMeasurement, traces),
    COLUMN_END
};

static const SqlColumn audit_columns[] = {
    COLUMN(AuditEntry, slug),
    COLUMN(AuditEntry, version),
    COLUMN(AuditEntry, action),
    COLUMN(AuditEntry, revision),
    COLUMN(AuditEntry, measurement),
    COLUMN(AuditEntry, who),
    COLUMN(AuditEntry, why),
    COLUMN(AuditEntry, created_unix_ms),
    COLUMN_END
};

// A row of one text is that text.
static const SqlColumn slug_columns[] = {{.name = "slug", .kind = COLUMN_TEXT, .size = sizeof(char *)}, COLUMN_END};

static const SqlColumn moment_columns[] = {
    COLUMN(MaterialMoment, revisions),
    COLUMN(MaterialMoment, reviews),
    COLUMN(MaterialMoment, measurements),
    COLUMN_END
};

static const SqlColumn material_key_columns[] = {
    COLUMN(MaterialKey, number),
    COLUMN(MaterialKey, latest),
    COLUMN(MaterialKey, version),
    COLUMN(MaterialKey, measurements),
    COLUMN(MaterialKey, status),
    COLUMN(MaterialKey, author),
    COLUMN_END
};

const SqlColumn material_row_key_columns[] = {
    COLUMN(MaterialRowKey, slug),
    COLUMN(MaterialRowKey, number),
    COLUMN(MaterialRowKey, max),
    COLUMN_OF(MaterialRowKey, moment.revisions, "revisions", 0, NULL),
    COLUMN_OF(MaterialRowKey, moment.reviews, "reviews", 0, NULL),
    COLUMN_OF(MaterialRowKey, moment.measurements, "measurements", 0, NULL),
    COLUMN_END
};
// clang-format on

// SQLite's integers have a sign; no number is beyond them.
static uint64_t integer_max(uint64_t number) {
    return number > INT64_MAX ? INT64_MAX : number;
}

static MaterialRowKey key_of(const char *slug, uint64_t number, size_t max) {
    return (MaterialRowKey){
        .slug = (char *)slug, .number = integer_max(number), .max = integer_max(max)};
}

void material_revision_clear(MaterialRevision *revision) {
    fields_clear(material_fields, &revision->material);
    row_clear(material_revision_columns(), revision, sizeof *revision);
}

void material_revisions_clear(MaterialRevisions *materials) {
    for (size_t i = 0; i < materials->count; i++)
        material_revision_clear(&materials->at[i]);
    free(materials->at);
    *materials = (MaterialRevisions){NULL, 0};
}

void material_reviews_clear(MaterialReviews *reviews) {
    rows_clear(material_review_columns, sizeof *reviews->at, reviews);
}

void material_measurement_clear(MaterialMeasurement *measurement) {
    row_clear(material_measurement_columns, measurement, sizeof *measurement);
}

void material_measurements_clear(MaterialMeasurements *measurements) {
    rows_clear(material_measurement_columns, sizeof *measurements->at, measurements);
}

void audit_entries_clear(AuditEntries *entries) {
    rows_clear(audit_columns, sizeof *entries->at, entries);
}

void material_slugs_clear(Texts *slugs) {
    rows_clear(slug_columns, sizeof *slugs->at, slugs);
}

const char *material_member_json(Bytes *bytes, const Field *field, const Material *material) {
    const Field alone[] = {*field, FIELD_END};
    bytes->count = 0;
    (void)encode_members(bytes, alone, material, WRITE_REPORT);
    const char *colon = bytes->is_failed || bytes->at == NULL ? NULL : strstr(bytes->at, ": ");
    return colon != NULL ? colon + 2 : NULL;
}

Status material_lists_read(MaterialRevision *revision, Problem *problem) {
    Material *material = &revision->material;
    Problem *fault = NULL;
    Status status = STATUS_OK;
    material->tags = (Texts){NULL, 0};
    material->table = (MaterialRows){NULL, 0};
    material->measurements = (Reals){NULL, 0};
    if (revision->lists != NULL) {
        fault = calloc(1, sizeof *fault);
        status = fault != NULL ? json_parse(revision->lists, strlen(revision->lists),
                                            material_list_fields, material, fault)
                               : STATUS_NO_MEMORY;
    }
    if (status != STATUS_OK)
        status = problem_set(problem, status == STATUS_NO_MEMORY ? status : STATUS_INTERNAL,
                             "%.64s@%llu cannot be read: %s", revision->slug,
                             (unsigned long long)revision->revision,
                             fault != NULL ? fault->detail : "no memory");
    free(fault);
    free(revision->lists);
    revision->lists = NULL;
    return status;
}

// Cache of the revisions that scenes name, as long as the catalog does not change: 2 us instead of
// 27 us, and of a material with thousands of revisions milliseconds. Lists are texts in it.

enum { CACHE_BYTES = 256 << 10 };

struct MaterialMemory {
    pthread_mutex_t lock;
    uint64_t version; // of the audit log
    Lru *lru;
};

typedef struct CachedRevision {
    LruEntry entry;
    char key[96]; // "SLUG@REVISION"; the head is revision 0
    MaterialRevision revision;
} CachedRevision;

static void cached_revision_free(LruEntry *entry, void *owner, bool is_evicted) {
    CachedRevision *cached = (CachedRevision *)entry;
    (void)owner;
    (void)is_evicted;
    material_revision_clear(&cached->revision);
    free(cached);
}

MaterialMemory *material_memory_new(void) {
    MaterialMemory *memory = calloc(1, sizeof *memory);
    if (memory == NULL)
        return NULL;
    pthread_mutex_init(&memory->lock, NULL);
    memory->lru = lru_new(CACHE_BYTES, cached_revision_free, NULL);
    if (memory->lru != NULL)
        return memory;
    material_memory_free(memory);
    return NULL;
}

void material_memory_free(MaterialMemory *memory) {
    if (memory == NULL)
        return;
    lru_free(memory->lru);
    pthread_mutex_destroy(&memory->lock);
    free(memory);
}

// A copy, of the same version.
static bool material_memory_find(MaterialMemory *memory, uint64_t version, const char *key,
                                 MaterialRevision *revision) {
    pthread_mutex_lock(&memory->lock);
    const CachedRevision *cached = version == memory->version ? lru_find(memory->lru, key) : NULL;
    const bool is_found = cached != NULL && row_copy(material_revision_columns(), &cached->revision,
                                                     revision, sizeof *revision);
    pthread_mutex_unlock(&memory->lock);
    return is_found;
}

// Adds a copy; `version` was read before the revision.
static void material_memory_add(MaterialMemory *memory, uint64_t version, const char *key,
                                const MaterialRevision *revision) {
    CachedRevision *cached = calloc(1, sizeof *cached);
    if (cached == NULL)
        return;
    snprintf(cached->key, sizeof cached->key, "%s", key);
    cached->entry.indexed.key = cached->key;
    cached->entry.bytes =
        sizeof *cached + (revision->lists != NULL ? strlen(revision->lists) : 0) + 1000;
    pthread_mutex_lock(&memory->lock);
    if (version > memory->version) {
        lru_clear(memory->lru);
        memory->version = version;
    }
    if (version == memory->version &&
        row_copy(material_revision_columns(), revision, &cached->revision, sizeof cached->revision))
        lru_add(memory->lru, &cached->entry);
    else
        free(cached);
    pthread_mutex_unlock(&memory->lock);
}

// Reading.

static const char head_sql[] =
    "SELECT * FROM material_states WHERE slug = :slug AND status <> 'deprecated' "
    "ORDER BY status = 'approved' DESC, revision DESC LIMIT 1";
static const char revision_sql[] =
    "SELECT * FROM material_states WHERE slug = :slug AND revision = :number";

static Status error_no_material(const char *slug, Problem *problem) {
    return problem_set(problem, STATUS_NOT_FOUND, "there is no material \"%.64s\"", slug);
}

Status db_material_state(Db *db, const char *slug, MaterialState *state, Problem *problem) {
    MaterialKey key;
    *state = (MaterialState){0};
    Sqlite *database = db_take(db);
    const Status status = material_key_find(database, slug, 0, &key, problem);
    db_put(db, database);
    TRY(status);
    if (key.number == 0)
        return error_no_material(slug, problem);
    *state = (MaterialState){key.latest, key.version, key.measurements};
    return STATUS_OK;
}

static Status error_no_revision(Db *db, const char *slug, uint64_t revision, Problem *problem) {
    MaterialState state;
    TRY(db_material_state(db, slug, &state, problem));
    if (revision == 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "all revisions of the material \"%.64s\" are deprecated; to use one, "
                           "name it: %.64s@%llu",
                           slug, slug, (unsigned long long)state.latest);
    return problem_set(problem, STATUS_NOT_FOUND,
                       "the material \"%.64s\" has no revision %llu, its newest is %llu", slug,
                       (unsigned long long)revision, (unsigned long long)state.latest);
}

Status db_material(Db *db, const char *slug, uint64_t revision, MaterialRevision *material,
                   Problem *problem) {
    const MaterialRowKey key = key_of(slug, revision, 0);
    MaterialMemory *memory = db_material_memory(db);
    const uint64_t version = db_audit_version(db);
    char name[96];
    bool is_found;
    memset(material, 0, sizeof *material);
    snprintf(name, sizeof name, "%.64s@%llu", slug, (unsigned long long)revision);
    if (!material_memory_find(memory, version, name, material)) {
        TRY(db_first(db, revision == 0 ? head_sql : revision_sql, material_row_key_columns, &key,
                     material_revision_columns(), material, &is_found, problem));
        if (!is_found)
            return error_no_revision(db, slug, revision, problem);
        material_memory_add(memory, version, name, material);
    }
    return material_lists_read(material, problem);
}

Status db_material_slugs(Db *db, Texts *slugs, Problem *problem) {
    static const char sql[] = "SELECT slug FROM materials ORDER BY slug";
    return db_list(db, sql, NULL, NULL, slug_columns, sizeof *slugs->at, slugs, problem);
}

static Status db_revisions(Db *db, const char *sql, const MaterialRowKey *key,
                           MaterialRevisions *revisions, Problem *problem) {
    Status status = db_list(db, sql, material_row_key_columns, key, material_revision_columns(),
                            sizeof *revisions->at, revisions, problem);
    for (size_t i = 0; i < revisions->count && status == STATUS_OK; i++)
        status = material_lists_read(&revisions->at[i], problem);
    if (status != STATUS_OK)
        material_revisions_clear(revisions);
    return status;
}

Status db_material_heads(Db *db, const char *after, size_t max, MaterialRevisions *materials,
                         Problem *problem) {
    static const char sql[] =
        "SELECT s.* FROM materials m JOIN material_states s ON s.material = m.number AND "
        "s.revision = (SELECT h.revision FROM material_states h WHERE h.material = m.number ORDER "
        "BY h.status = 'approved' DESC, h.status = 'draft' DESC, h.revision DESC LIMIT 1) WHERE "
        "m.slug > :slug ORDER BY m.slug LIMIT :max";
    const MaterialRowKey key = key_of(after, 0, max);
    return db_revisions(db, sql, &key, materials, problem);
}

Status db_material_page(Db *db, const char *slug, uint64_t before, size_t max,
                        MaterialRevisions *revisions, Problem *problem) {
    static const char sql[] = "SELECT * FROM material_states WHERE slug = :slug AND revision < "
                              ":number ORDER BY revision DESC LIMIT :max";
    const MaterialRowKey key = key_of(slug, before, max);
    return db_revisions(db, sql, &key, revisions, problem);
}

Status db_material_measurement(Db *db, const char *slug, uint64_t number,
                               MaterialMeasurement *measurement, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.* FROM material_measurements t JOIN materials m ON m.number = t.material "
        "WHERE m.slug = :slug AND t.measurement = :number";
    const MaterialRowKey key = key_of(slug, number, 0);
    bool is_found;
    memset(measurement, 0, sizeof *measurement);
    TRY(db_first(db, sql, material_row_key_columns, &key, material_measurement_columns, measurement,
                 &is_found, problem));
    return is_found ? STATUS_OK
                    : problem_set(problem, STATUS_NOT_FOUND,
                                  "the material \"%.64s\" has no measurement %llu", slug,
                                  (unsigned long long)number);
}

Status db_measurement_heads(Db *db, const char *slug, uint64_t before, size_t max,
                            MaterialMeasurements *measurements, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.measurement, t.author, t.comment, t.created_unix_ms, t.head AS document, "
        "t.drops, t.traces FROM material_measurements t JOIN materials m ON m.number = t.material "
        "WHERE m.slug = :slug AND t.measurement < :number ORDER BY t.measurement DESC LIMIT :max";
    const MaterialRowKey key = key_of(slug, before, max);
    return db_list(db, sql, material_row_key_columns, &key, material_measurement_columns,
                   sizeof *measurements->at, measurements, problem);
}

Status db_audit_entries(Db *db, const char *slug, uint64_t before, size_t max,
                        AuditEntries *entries, Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM material_trail t JOIN materials m ON m.number = t.material WHERE m.slug = "
        ":slug AND t.version < :number ORDER BY t.version DESC LIMIT :max";
    const MaterialRowKey key = key_of(slug, before, max);
    return db_list(db, sql, material_row_key_columns, &key, audit_columns, sizeof *entries->at,
                   entries, problem);
}

// Export.

Status db_material_moment(Db *db, MaterialMoment *moment, Problem *problem) {
    static const char sql[] =
        "SELECT (SELECT coalesce(max(number), 0) FROM material_revisions) AS revisions, "
        "(SELECT coalesce(max(number), 0) FROM material_reviews) AS reviews, "
        "(SELECT coalesce(max(number), 0) FROM material_measurements) AS measurements";
    bool is_found;
    *moment = (MaterialMoment){0, 0, 0};
    return db_first(db, sql, NULL, NULL, moment_columns, moment, &is_found, problem);
}

Status db_revision_after(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                         MaterialRevision *revision, bool *is_found, Problem *problem) {
    static const char of_material[] =
        "SELECT m.slug, r.* FROM materials m JOIN material_revisions r ON r.material = m.number "
        "WHERE m.slug = :slug AND r.revision > :number AND r.number <= :revisions "
        "ORDER BY r.revision LIMIT 1";
    // CROSS and + keep SQLite to slugs in order; else it sorts all revisions for each material.
    static const char of_next[] =
        "SELECT m.slug, r.* FROM materials m CROSS JOIN material_revisions r ON r.material = "
        "m.number WHERE m.slug > :slug AND +r.number <= :revisions ORDER BY m.slug, r.revision "
        "LIMIT 1";
    const MaterialRowKey key = {.slug = (char *)slug, .number = number, .moment = *moment};
    memset(revision, 0, sizeof *revision);
    TRY(db_first(db, number > 0 ? of_material : of_next, material_row_key_columns, &key,
                 material_revision_columns(), revision, is_found, problem));
    return *is_found ? material_lists_read(revision, problem) : STATUS_OK;
}

Status db_measurement_after(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                            MaterialMeasurement *measurement, bool *is_found, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement > :number AND t.number <= :measurements "
        "ORDER BY t.measurement LIMIT 1";
    const MaterialRowKey key = {.slug = (char *)slug, .number = number, .moment = *moment};
    memset(measurement, 0, sizeof *measurement);
    return db_first(db, sql, material_row_key_columns, &key, material_measurement_columns,
                    measurement, is_found, problem);
}

Status db_reviews(Db *db, const MaterialMoment *moment, const char *slug, uint64_t revision,
                  MaterialReviews *reviews, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, v.* FROM materials m JOIN material_reviews v ON v.material = m.number "
        "WHERE m.slug = :slug AND v.revision = :number AND v.number <= :reviews ORDER BY v.number";
    const MaterialRowKey key = {.slug = (char *)slug, .number = revision, .moment = *moment};
    return db_list(db, sql, material_row_key_columns, &key, material_review_columns,
                   sizeof *reviews->at, reviews, problem);
}

// Writing.

Status material_key_find(Sqlite *database, const char *slug, uint64_t revision, MaterialKey *key,
                         Problem *problem) {
    // Not by the view: SQLite would make all its rows for the join.
    static const char sql[] =
        "SELECT m.number, "
        "(SELECT coalesce(max(revision), 0) FROM material_revisions r WHERE r.material = m.number) "
        "AS latest, "
        "(SELECT coalesce(max(version), 0) FROM material_trail t WHERE t.material = m.number) AS "
        "version, "
        "(SELECT coalesce(max(measurement), 0) FROM material_measurements t WHERE t.material = "
        "m.number) AS measurements, "
        "coalesce((SELECT coalesce((SELECT status FROM material_reviews v WHERE v.material = "
        "m.number AND v.revision = :number ORDER BY v.number DESC LIMIT 1), 'draft') FROM "
        "material_revisions r WHERE r.material = m.number AND r.revision = :number), '') AS "
        "status, "
        "coalesce((SELECT author FROM material_revisions r WHERE r.material = m.number AND "
        "r.revision = :number), '') AS author "
        "FROM materials m WHERE m.slug = :slug";
    const MaterialRowKey asked = key_of(slug, revision, 0);
    bool is_found;
    *key = (MaterialKey){0};
    return sqlite_first(database, sql, material_row_key_columns, &asked, material_key_columns, key,
                        &is_found, problem);
}

// A material that exists, at the version that the writer saw.
static Status material_require(Sqlite *database, const char *slug, uint64_t revision,
                               uint64_t version, MaterialKey *key, Problem *problem) {
    TRY(material_key_find(database, slug, revision, key, problem));
    if (key->number == 0)
        return error_no_material(slug, problem);
    if (version != ANY_VERSION && version != key->version)
        return problem_set(problem, STATUS_STALE,
                           "the material \"%.64s\" has changed: it is at version %llu, you read "
                           "version %llu; read it again",
                           slug, (unsigned long long)key->version, (unsigned long long)version);
    return STATUS_OK;
}

typedef struct Room {
    int64_t bytes, max;
} Room;
static const SqlColumn room_columns[] = {COLUMN(Room, bytes), COLUMN(Room, max), COLUMN_END};

static int64_t length(const char *text) {
    return text != NULL ? (int64_t)strlen(text) : 0;
}

// Counts a row with that many bytes of texts, in the transaction that adds it.
static Status room_reserve(Sqlite *database, int64_t bytes, Problem *problem) {
    enum { ROW = 200 };
    static const char sql[] =
        "UPDATE material_room SET bytes = bytes + :bytes WHERE bytes + :bytes <= :max";
    const Room room = {ROW + bytes, CATALOGUE_BYTES};
    int changes = 0;
    TRY(sqlite_change(database, sql, room_columns, &room, &changes, problem));
    return changes > 0 ? STATUS_OK
                       : problem_set(problem, STATUS_LIMIT,
                                     "all materials and measurements have reached the limit of "
                                     "%lld GiB",
                                     (long long)(CATALOGUE_BYTES >> 30));
}

static Status require_number(uint64_t number, uint64_t max, const char *slug, const char *what,
                             Problem *problem) {
    return number <= max ? STATUS_OK
                         : problem_set(problem, STATUS_LIMIT,
                                       "the material \"%.64s\" has %llu %s, which is the limit: "
                                       "continue with another slug",
                                       slug, (unsigned long long)max, what);
}

Status material_row_add(Sqlite *database, const char *slug, Problem *problem) {
    // None is ever deleted: the highest number is their count.
    static const char sql[] = "INSERT INTO materials (slug) SELECT :slug WHERE (SELECT "
                              "coalesce(max(number), 0) FROM materials) < :max";
    const MaterialRowKey key = {.slug = (char *)slug, .max = CATALOGUE_MATERIALS};
    int changes = 0;
    TRY(room_reserve(database, length(slug), problem));
    TRY(sqlite_change(database, sql, material_row_key_columns, &key, &changes, problem));
    return changes > 0 ? STATUS_OK
                       : problem_set(problem, STATUS_LIMIT,
                                     "there are %d materials, which is the limit: revise one of "
                                     "them",
                                     CATALOGUE_MATERIALS);
}

Status material_revision_add(Sqlite *database, const MaterialRevision *revision, Problem *problem) {
    const Material *material = &revision->material;
    MaterialRevision stored = *revision; // borrows
    Bytes lists = {.most = 0};
    TRY(require_number(revision->revision, CATALOGUE_REVISIONS, revision->slug, "revisions",
                       problem));
    const SqlColumn *columns = material_revision_columns();
    if (material->tags.count + material->table.count + material->measurements.count > 0) {
        encode_item(&lists, material_list_fields, material, WRITE_SCENE);
        if (lists.is_failed) {
            bytes_clear(&lists);
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the revision");
        }
    }
    stored.lists = lists.at;
    int64_t bytes = length(stored.lists) + length(stored.comment);
    for (const Field *field = material_fields; field->kind != FIELD_KIND_END; field++)
        if (field->kind == FIELD_KIND_TEXT)
            bytes += length(*(char *const *)((const char *)material + field->offset));
    Status status = room_reserve(database, bytes, problem);
    if (status == STATUS_OK)
        status = sqlite_change(database, revision_insert, columns, &stored, NULL, problem);
    bytes_clear(&lists);
    return status;
}

Status material_review_add(Sqlite *database, const MaterialReview *review, Problem *problem) {
    static const char sql[] =
        "INSERT INTO material_reviews (material, revision, status, reason, reviewer, "
        "created_unix_ms) SELECT number, :revision, :status, :reason, :reviewer, :created_unix_ms "
        "FROM materials WHERE slug = :slug";
    TRY(room_reserve(database, length(review->reason), problem));
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
    TRY(room_reserve(database, length(measurement->comment) + length(measurement->document),
                     problem));
    return sqlite_change(database, sql, material_measurement_columns, measurement, NULL, problem);
}

Status audit_entry_add(Sqlite *database, const AuditEntry *entry, Problem *problem) {
    static const char sql[] =
        "INSERT INTO material_trail (material, version, action, revision, measurement, who, why, "
        "created_unix_ms) SELECT number, 1 + (SELECT coalesce(max(version), 0) FROM "
        "material_trail t WHERE t.material = m.number), :action, nullif(:revision, 0), "
        "nullif(:measurement, 0), :who, :why, :created_unix_ms FROM materials m WHERE slug = :slug";
    TRY(room_reserve(database, length(entry->why), problem));
    return sqlite_change(database, sql, audit_columns, entry, NULL, problem);
}

// What one of the four writes below gets and has as its result.
typedef struct MaterialWrite {
    MaterialRevision *revision;
    const MaterialReview *review;
    MaterialMeasurement *measurement;
    uint64_t version;
} MaterialWrite;

static Status revision_write(Sqlite *database, const MaterialRevision *revision, const char *action,
                             Problem *problem) {
    const AuditEntry entry = {.slug = revision->slug,
                              .action = (char *)action,
                              .revision = revision->revision,
                              .who = revision->author,
                              .why = revision->comment,
                              .created_unix_ms = revision->created_unix_ms};
    TRY(material_revision_add(database, revision, problem));
    return audit_entry_add(database, &entry, problem);
}

static Status material_write_first(Sqlite *database, const void *work, Problem *problem) {
    const MaterialWrite *write = work;
    MaterialRevision *first = write->revision;
    MaterialKey key;
    TRY(material_key_find(database, first->slug, 0, &key, problem));
    if (key.number != 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "there is a material \"%.64s\" already: add a revision to it, or "
                           "choose another slug",
                           first->slug);
    first->revision = 1;
    TRY(material_row_add(database, first->slug, problem));
    return revision_write(database, first, "create", problem);
}

static Status material_write_revision(Sqlite *database, const void *work, Problem *problem) {
    const MaterialWrite *write = work;
    MaterialRevision *revision = write->revision;
    MaterialKey key;
    TRY(material_require(database, revision->slug, 0, write->version, &key, problem));
    revision->revision = key.latest + 1;
    return revision_write(database, revision, revision->reverts > 0 ? "revert" : "revise", problem);
}

static Status material_write_review(Sqlite *database, const void *work, Problem *problem) {
    const MaterialWrite *write = work;
    const MaterialReview *review = write->review;
    const bool approves = strcmp(review->status, "approved") == 0;
    MaterialKey key;
    TRY(material_require(database, review->slug, review->revision, write->version, &key, problem));
    if (key.status[0] == '\0')
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the material \"%.64s\" has no revision %llu, its newest is %llu",
                           review->slug, (unsigned long long)review->revision,
                           (unsigned long long)key.latest);
    if (strcmp(key.status, review->status) == 0)
        return problem_set(problem, STATUS_CONFLICT, "%.64s@%llu is %s already", review->slug,
                           (unsigned long long)review->revision, key.status);
    if (approves && review->reviewer != NULL && strcmp(key.author, review->reviewer) == 0)
        return problem_set(problem, STATUS_FORBIDDEN,
                           "%.64s is the author of %.64s@%llu and may not approve their own "
                           "revision: another user has to review it",
                           key.author, review->slug, (unsigned long long)review->revision);
    const AuditEntry entry = {.slug = review->slug,
                              .action = approves ? "approve" : "deprecate",
                              .revision = review->revision,
                              .who = review->reviewer,
                              .why = review->reason,
                              .created_unix_ms = review->created_unix_ms};
    TRY(material_review_add(database, review, problem));
    return audit_entry_add(database, &entry, problem);
}

static Status material_write_measurement(Sqlite *database, const void *work, Problem *problem) {
    const MaterialWrite *write = work;
    MaterialMeasurement *measurement = write->measurement;
    MaterialKey key;
    TRY(material_require(database, measurement->slug, 0, write->version, &key, problem));
    measurement->measurement = key.measurements + 1;
    const AuditEntry entry = {.slug = measurement->slug,
                              .action = "measure",
                              .measurement = measurement->measurement,
                              .who = measurement->author,
                              .why = measurement->comment,
                              .created_unix_ms = measurement->created_unix_ms};
    TRY(material_measurement_add(database, measurement, problem));
    return audit_entry_add(database, &entry, problem);
}

// A write that changes what scenes may refer to.
static Status db_catalog_write(Db *db, StoreApply *apply, const MaterialWrite *write,
                               Problem *problem) {
    TRY(db_write(db, apply, write, problem));
    db_catalog_changed(db);
    return STATUS_OK;
}

Status db_material_add(Db *db, MaterialRevision *first, Problem *problem) {
    return db_catalog_write(db, material_write_first, &(MaterialWrite){.revision = first}, problem);
}

Status db_material_revise(Db *db, MaterialRevision *revision, uint64_t version, Problem *problem) {
    return db_catalog_write(db, material_write_revision,
                            &(MaterialWrite){.revision = revision, .version = version}, problem);
}

Status db_material_review(Db *db, const MaterialReview *review, uint64_t version,
                          Problem *problem) {
    return db_catalog_write(db, material_write_review,
                            &(MaterialWrite){.review = review, .version = version}, problem);
}

Status db_material_measure(Db *db, MaterialMeasurement *measurement, uint64_t version,
                           Problem *problem) {
    const MaterialWrite write = {.measurement = measurement, .version = version};
    TRY(db_write(db, material_write_measurement, &write, problem));
    db_material_measured(db);
    return STATUS_OK;
}
