// The view material_states joins each revision with its last review. What a write depends on is
// read in its own transaction, so that of two writers who saw the same version one is refused.
#include "server/db/materials.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"
#include "server/json/encode.h"
#include "server/json/parse.h"

// Columns. Those of a revision that are the material's are made of its Field rows; its lists are
// one column.

// clang-format off
#define OF_SLUG COLUMN_WRITE("material", "(SELECT number FROM materials WHERE slug = :slug)")
#define WITH_SLUG ", (SELECT slug FROM materials m WHERE m.number = material) AS slug"
#define CHECKED(Type, member) COLUMN_WITH(Type, member, COLUMN_CHECKED)
#define NUMBER_OR_NULL(Type, member, flags_) {.name = #member, .kind = COLUMN_COUNT, .flags = flags_, \
    .offset = offsetof(Type, member), .size = sizeof(uint64_t), .write = "nullif(:" #member ", 0)"}

static const SqlColumn revision_own_columns[] = {
    OF_SLUG,
    COLUMN_OF(MaterialRevision, slug, "slug", COLUMN_ID | COLUMN_BOUND, "slug"),
    COLUMN_WITH(MaterialRevision, revision, COLUMN_CHECKED | COLUMN_ID),
    CHECKED(MaterialRevision, lists),
    NUMBER_OR_NULL(MaterialRevision, reverts, COLUMN_CHECKED),
    CHECKED(MaterialRevision, author),
    CHECKED(MaterialRevision, comment),
    CHECKED(MaterialRevision, created_unix_ms),
    COLUMN_READ(MaterialRevision, status, "status"),
    COLUMN_READ(MaterialRevision, reason, "reason"),
    COLUMN_READ(MaterialRevision, reviewer, "reviewer"),
    COLUMN_READ(MaterialRevision, reviewed_unix_ms, "reviewed_unix_ms"),
    COLUMN_READ(MaterialRevision, latest, "latest"),
    COLUMN_READ(MaterialRevision, version, "version"),
    COLUMN_END
};
// clang-format on
static SqlColumn revision_columns[40];
const CheckedTable revisions_table =
    CHECKED_TABLE_WITH("material_revisions", revision_columns, MaterialRevision, WITH_SLUG);

static void revision_columns_make(void) {
    SqlColumn *column = revision_columns;
    for (const Field *field = material_fields; field->kind != FIELD_KIND_END; field++) {
        *column = (SqlColumn){.name = field->name,
                              .flags = COLUMN_CHECKED,
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
        column++;
    }
    memcpy(column, revision_own_columns, sizeof revision_own_columns);
}

const SqlColumn *material_revision_columns(void) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    (void)pthread_once(&once, revision_columns_make);
    return revision_columns;
}

// clang-format off
const SqlColumn material_review_columns[] = {
    OF_SLUG,
    COLUMN_OF(MaterialReview, slug, "slug", COLUMN_ID | COLUMN_BOUND, "slug"),
    COLUMN_WITH(MaterialReview, revision, COLUMN_CHECKED | COLUMN_ID),
    CHECKED(MaterialReview, status),
    CHECKED(MaterialReview, reason),
    CHECKED(MaterialReview, reviewer),
    CHECKED(MaterialReview, created_unix_ms),
    COLUMN_END
};
const CheckedTable reviews_table =
    CHECKED_TABLE_WITH("material_reviews", material_review_columns, MaterialReview, WITH_SLUG);

const SqlColumn material_measurement_columns[] = {
    OF_SLUG,
    COLUMN_OF(MaterialMeasurement, slug, "slug", COLUMN_ID | COLUMN_BOUND, "slug"),
    COLUMN_WITH(MaterialMeasurement, measurement, COLUMN_CHECKED | COLUMN_ID),
    CHECKED(MaterialMeasurement, author),
    CHECKED(MaterialMeasurement, comment),
    CHECKED(MaterialMeasurement, created_unix_ms),
    CHECKED(MaterialMeasurement, document),
    COLUMN_WITH(MaterialMeasurement, drops, COLUMN_BOUND),
    COLUMN_WITH(MaterialMeasurement, traces, COLUMN_BOUND),
    COLUMN_WITH(MaterialMeasurement, head, COLUMN_BOUND),
    COLUMN_END
};
const CheckedTable measurements_table = CHECKED_TABLE_WITH(
    "material_measurements", material_measurement_columns, MaterialMeasurement, WITH_SLUG);

static const SqlColumn audit_columns[] = {
    OF_SLUG,
    COLUMN_OF(AuditEntry, slug, "slug", COLUMN_ID | COLUMN_BOUND, "slug"),
    COLUMN_WITH(AuditEntry, version, COLUMN_ID | COLUMN_BOUND),
    CHECKED(AuditEntry, action),
    NUMBER_OR_NULL(AuditEntry, revision, COLUMN_CHECKED),
    NUMBER_OR_NULL(AuditEntry, measurement, COLUMN_CHECKED),
    CHECKED(AuditEntry, who),
    CHECKED(AuditEntry, why),
    CHECKED(AuditEntry, created_unix_ms),
    COLUMN_END
};
const CheckedTable audit_table =
    CHECKED_TABLE_WITH("material_trail", audit_columns, AuditEntry, WITH_SLUG);

// A row of one text is that text.
static const SqlColumn slug_columns[] = {{.name = "slug", .kind = COLUMN_TEXT, .flags = COLUMN_ID, .size = sizeof(char *)}, COLUMN_END};

static const SqlColumn moment_columns[] = {
    COLUMN(MaterialMoment, revisions),
    COLUMN(MaterialMoment, reviews),
    COLUMN(MaterialMoment, measurements),
    COLUMN_END
};

static const SqlColumn material_key_columns[] = {
    COLUMN(MaterialKey, number),
    COLUMN_WITH(MaterialKey, slug, COLUMN_ID),
    COLUMN(MaterialKey, latest),
    COLUMN(MaterialKey, version),
    COLUMN(MaterialKey, measurements),
    COLUMN(MaterialKey, status),
    COLUMN(MaterialKey, author),
    COLUMN_END
};
// clang-format on

// SQLite's integers have a sign; no number is beyond them.
static uint64_t integer_max(uint64_t number) {
    return number > INT64_MAX ? INT64_MAX : number;
}

static QueryKey key_of(const char *slug, uint64_t number, size_t max) {
    return (QueryKey){.slug = slug, .number = integer_max(number), .max = integer_max(max)};
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
    const char *colon = bytes->is_failed ? NULL : strstr(bytes->at, ": ");
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

static int64_t length(const char *text) {
    return text != NULL ? (int64_t)strlen(text) : 0;
}

static int64_t texts_length(const Material *material) {
    int64_t bytes = 0;
    for (const Field *field = material_fields; field->kind != FIELD_KIND_END; field++)
        if (field->kind == FIELD_KIND_TEXT)
            bytes += length(*(char *const *)((const char *)material + field->offset));
    return bytes;
}

// Reading.

// Not by the view: SQLite would make all its rows for the join.
static const char key_sql[] =
    "SELECT m.number, (SELECT slug FROM materials n WHERE n.number = m.number) AS slug, "
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

static Status reviews_compare(Sqlite *database, const void *key, Problem *problem) {
    static const CheckedTable reviews = {
        .sql = "SELECT m.slug, v.* FROM materials m JOIN material_reviews v ON v.material = "
               "m.number WHERE m.slug BETWEEN :slug AND :name",
        .columns = material_review_columns,
        .size = sizeof(MaterialReview)};
    TableCheck check = {.keys = query_key_columns, .key = key};
    return sqlite_check_table(database, &reviews, &check, problem);
}

Status db_reviews_compare(Db *db, const char *first, const char *last, Problem *problem) {
    return db_read(db, reviews_compare, &(QueryKey){.slug = first, .name = last}, problem);
}

// The name of a material has no checksum.
static Status require_slug(const char *found, const char *asked, Problem *problem) {
    if (found[0] == '\0' || strcmp(found, asked) == 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_INTERNAL,
                       "the database is damaged: an index leads from %.64s to %.64s; put a backup "
                       "in its place (impactd restore)",
                       asked, found);
}

// The row is the one asked for, and its first revision and its entry are there.
static Status material_key_check(const MaterialKey *key, const char *slug, Problem *problem) {
    if (key->number != 0 && (key->latest == 0 || key->version == 0))
        return problem_set(problem, STATUS_INTERNAL,
                           "the database is damaged: the revisions of the material %.64s are "
                           "missing; put a backup in its place (impactd restore)",
                           slug);
    return require_slug(key->slug, slug, problem);
}

static const char no_material[] = "there is no material \"%.64s\"";

Status db_material_state(Db *db, const char *slug, MaterialState *state, Problem *problem) {
    MaterialKey key;
    *state = (MaterialState){0};
    TRY(db_get(db, key_sql, &(QueryKey){.slug = slug}, material_key_columns, &key, sizeof key,
               problem, no_material, slug));
    TRY(material_key_check(&key, slug, problem));
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
    // Two walks down the revisions, which end at the first that is found.
    static const char head_sql[] =
        "SELECT * FROM material_states WHERE slug = :slug AND revision = coalesce((SELECT revision "
        "FROM material_states WHERE slug = :slug AND status = 'approved' ORDER BY revision DESC "
        "LIMIT 1), (SELECT revision FROM material_states WHERE slug = :slug AND status = 'draft' "
        "ORDER BY revision DESC LIMIT 1))";
    static const char revision_sql[] =
        "SELECT * FROM material_states WHERE slug = :slug AND revision = :number";
    const QueryKey key = key_of(slug, revision, 0);
    bool is_found;
    memset(material, 0, sizeof *material);
    TRY(db_reviews_compare(db, slug, slug, problem));
    TRY(db_first(db, revision == 0 ? head_sql : revision_sql, query_key_columns, &key,
                 material_revision_columns(), material, &is_found, problem));
    if (!is_found)
        return error_no_revision(db, slug, revision, problem);
    Status status = require_slug(material->slug, slug, problem);
    if (status == STATUS_OK)
        status = material_lists_read(material, problem);
    if (status != STATUS_OK)
        material_revision_clear(material);
    return status;
}

static void shared_revision_free(Refcount *refcount) {
    SharedRevision *shared = (SharedRevision *)(void *)refcount;
    material_revision_clear(&shared->revision);
    free(shared);
}

// 2 us instead of 50 us. The cache is emptied after every write of materials: only the process that
// has the folder writes them.
Status db_material_shared(Db *db, const char *slug, uint64_t revision, SharedRevision **shared,
                          Problem *problem) {
    SharedCache *cache = db_cache(db, CACHE_MATERIALS);
    char key[SHARED_KEY_SIZE];
    uint64_t generation;
    snprintf(key, sizeof key, "%.128s@%llu", slug, (unsigned long long)revision);
    *shared = (SharedRevision *)(void *)shared_cache_find(cache, key, &generation);
    if (*shared != NULL)
        return STATUS_OK;
    SharedRevision *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a material");
    made->refcount = (Refcount){.count = 1, .free = shared_revision_free};
    const Status status = db_material(db, slug, revision, &made->revision, problem);
    if (status != STATUS_OK) {
        refcount_unref(&made->refcount);
        return status;
    }
    const Material *material = &made->revision.material;
    const size_t bytes = sizeof *made + (size_t)texts_length(material) +
                         material->table.count * sizeof *material->table.at +
                         material->measurements.count * sizeof *material->measurements.at +
                         (size_t)(length(made->revision.comment) + length(made->revision.reason)) +
                         1000; // tags and short texts
    *shared =
        (SharedRevision *)(void *)shared_cache_add(cache, key, generation, &made->refcount, bytes);
    return STATUS_OK;
}

Status db_material_slugs(Db *db, Texts *slugs, Problem *problem) {
    static const char sql[] = "SELECT slug FROM materials ORDER BY slug";
    return db_list(db, sql, NULL, NULL, slug_columns, sizeof *slugs->at, slugs, problem);
}

static Status db_revisions(Db *db, const char *sql, const QueryKey *key,
                           MaterialRevisions *revisions, Problem *problem) {
    Status status = db_list(db, sql, query_key_columns, key, material_revision_columns(),
                            sizeof *revisions->at, revisions, problem);
    for (size_t i = 0; i < revisions->count && status == STATUS_OK; i++)
        status = material_lists_read(&revisions->at[i], problem);
    if (status == STATUS_OK && revisions->count > 0)
        status = db_reviews_compare(db, revisions->at[0].slug,
                                    revisions->at[revisions->count - 1].slug, problem);
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
    const QueryKey key = key_of(after, 0, max);
    return db_revisions(db, sql, &key, materials, problem);
}

Status db_material_page(Db *db, const char *slug, uint64_t before, size_t max,
                        MaterialRevisions *revisions, Problem *problem) {
    static const char sql[] = "SELECT * FROM material_states WHERE slug = :slug AND revision < "
                              ":number ORDER BY revision DESC LIMIT :max";
    const QueryKey key = key_of(slug, before, max);
    return db_revisions(db, sql, &key, revisions, problem);
}

Status db_material_measurement(Db *db, const char *slug, uint64_t number,
                               MaterialMeasurement *measurement, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.* FROM material_measurements t JOIN materials m ON m.number = t.material "
        "WHERE m.slug = :slug AND t.measurement = :number";
    const QueryKey key = key_of(slug, number, 0);
    return db_get(db, sql, &key, material_measurement_columns, measurement, sizeof *measurement,
                  problem, "the material \"%.64s\" has no measurement %llu", slug,
                  (unsigned long long)number);
}

Status db_measurement_heads(Db *db, const char *slug, uint64_t before, size_t max,
                            MaterialMeasurements *measurements, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.measurement, t.author, t.comment, t.created_unix_ms, t.head, "
        "t.drops, t.traces, t.checks FROM material_measurements t JOIN materials m ON m.number = "
        "t.material "
        "WHERE m.slug = :slug AND t.measurement < :number ORDER BY t.measurement DESC LIMIT :max";
    const QueryKey key = key_of(slug, before, max);
    return db_list(db, sql, query_key_columns, &key, material_measurement_columns,
                   sizeof *measurements->at, measurements, problem);
}

Status db_audit_entries(Db *db, const char *slug, uint64_t before, size_t max,
                        AuditEntries *entries, Problem *problem) {
    static const char sql[] = "SELECT m.slug, t.* FROM material_trail t JOIN materials m ON "
                              "m.number = t.material WHERE m.slug = "
                              ":slug AND t.version < :number ORDER BY t.version DESC LIMIT :max";
    const QueryKey key = key_of(slug, before, max);
    return db_list(db, sql, query_key_columns, &key, audit_columns, sizeof *entries->at, entries,
                   problem);
}

// Export.

Status db_material_moment(Db *db, MaterialMoment *moment, Problem *problem) {
    static const char sql[] =
        "SELECT (SELECT coalesce(max(number), 0) FROM material_revisions) AS revisions, "
        "(SELECT coalesce(max(number), 0) FROM material_reviews) AS reviews, "
        "(SELECT coalesce(max(number), 0) FROM material_measurements) AS measurements";
    TRY(db_reviews_compare(db, "", "~", problem)); // of all: slugs are of a-z, 0-9, _ and -
    return db_first(db, sql, NULL, NULL, moment_columns, moment, NULL, problem);
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
    const QueryKey key = {.slug = slug, .number = number, .moment = *moment};
    memset(revision, 0, sizeof *revision);
    TRY(db_first(db, number > 0 ? of_material : of_next, query_key_columns, &key,
                 material_revision_columns(), revision, is_found, problem));
    return *is_found ? material_lists_read(revision, problem) : STATUS_OK;
}

Status db_measurement_after(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                            MaterialMeasurement *measurement, bool *is_found, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement > :number AND t.number <= :measurements "
        "ORDER BY t.measurement LIMIT 1";
    const QueryKey key = {.slug = slug, .number = number, .moment = *moment};
    memset(measurement, 0, sizeof *measurement);
    return db_first(db, sql, query_key_columns, &key, material_measurement_columns, measurement,
                    is_found, problem);
}

Status db_reviews(Db *db, const MaterialMoment *moment, const char *slug, uint64_t revision,
                  MaterialReviews *reviews, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, v.* FROM materials m JOIN material_reviews v ON v.material = m.number "
        "WHERE m.slug = :slug AND v.revision = :number AND v.number <= :reviews ORDER BY v.number";
    const QueryKey key = {.slug = slug, .number = revision, .moment = *moment};
    return db_list(db, sql, query_key_columns, &key, material_review_columns, sizeof *reviews->at,
                   reviews, problem);
}

// Writing.

Status material_key_find(Sqlite *database, const char *slug, uint64_t revision, MaterialKey *key,
                         Problem *problem) {
    const QueryKey asked = key_of(slug, revision, 0);
    *key = (MaterialKey){0};
    TRY(reviews_compare(database, &(QueryKey){.slug = slug, .name = slug}, problem));
    TRY(sqlite_first(database, key_sql, query_key_columns, &asked, material_key_columns, key, NULL,
                     problem));
    return material_key_check(key, slug, problem);
}

typedef struct Room {
    int64_t bytes, max;
} Room;
static const SqlColumn room_columns[] = {COLUMN(Room, bytes), COLUMN(Room, max), COLUMN_END};

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
    const QueryKey key = {.slug = slug, .max = CATALOGUE_MATERIALS};
    int changes = 0;
    TRY(room_reserve(database, length(slug), problem));
    TRY(sqlite_change(database, sql, query_key_columns, &key, &changes, problem));
    return changes > 0 ? STATUS_OK
                       : problem_set(problem, STATUS_LIMIT,
                                     "there are %d materials, which is the limit: revise one of "
                                     "them",
                                     CATALOGUE_MATERIALS);
}

Status material_revision_add(Sqlite *database, const MaterialRevision *revision, Problem *problem) {
    static const char sql[] = "INSERT INTO material_revisions {insert}";
    const Material *material = &revision->material;
    MaterialRevision stored = *revision; // borrows
    Bytes lists = {.most = 0};
    TRY(require_number(revision->revision, CATALOGUE_REVISIONS, revision->slug, "revisions",
                       problem));
    if (material->tags.count + material->table.count + material->measurements.count > 0) {
        encode_item(&lists, material_list_fields, material, WRITE_SCENE);
        if (lists.is_failed) {
            bytes_clear(&lists);
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the revision");
        }
    }
    stored.lists = lists.at;
    Status status = room_reserve(
        database, length(stored.lists) + length(stored.comment) + texts_length(material), problem);
    if (status == STATUS_OK)
        status = sqlite_change(database, sql, material_revision_columns(), &stored, NULL, problem);
    bytes_clear(&lists);
    return status;
}

Status material_review_add(Sqlite *database, const MaterialReview *review, Problem *problem) {
    static const char sql[] = "INSERT INTO material_reviews {insert}";
    TRY(room_reserve(database, length(review->reason), problem));
    return sqlite_change(database, sql, material_review_columns, review, NULL, problem);
}

Status material_measurement_add(Sqlite *database, const MaterialMeasurement *measurement,
                                Problem *problem) {
    static const char sql[] = "INSERT INTO material_measurements {insert}";
    static const char head_sql[] =
        "SELECT json_remove(:document, '$.drops', '$.traces') AS head, "
        "coalesce(json_array_length(:document, '$.drops'), 0) AS drops, "
        "coalesce(json_array_length(:document, '$.traces'), 0) AS traces";
    MaterialMeasurement stored = *measurement; // borrows
    MaterialMeasurement found = {0};
    TRY(require_number(measurement->measurement, CATALOGUE_MEASUREMENTS, measurement->slug,
                       "measurements", problem));
    TRY(room_reserve(database, length(measurement->comment) + length(measurement->document),
                     problem));
    TRY(sqlite_first(database, head_sql, material_measurement_columns, measurement,
                     material_measurement_columns, &found, NULL, problem));
    stored.head = found.head;
    stored.drops = found.drops;
    stored.traces = found.traces;
    const Status status =
        sqlite_change(database, sql, material_measurement_columns, &stored, NULL, problem);
    free(found.head);
    return status;
}

Status audit_entry_add(Sqlite *database, const AuditEntry *entry, Problem *problem) {
    static const char sql[] = "INSERT INTO material_trail {insert}";
    static const char version_sql[] =
        "SELECT 1 + coalesce(max(t.version), 0) AS version FROM material_trail t JOIN materials m "
        "ON m.number = t.material WHERE m.slug = :slug";
    AuditEntry stored = *entry; // borrows
    AuditEntry found = {0};
    TRY(room_reserve(database, length(entry->why), problem));
    TRY(sqlite_first(database, version_sql, audit_columns, entry, audit_columns, &found, NULL,
                     problem));
    stored.version = found.version;
    return sqlite_change(database, sql, audit_columns, &stored, NULL, problem);
}

// What one of the four writes below adds: the first of these that is there.
typedef struct MaterialWrite {
    MaterialRevision *revision;
    const MaterialReview *review;
    MaterialMeasurement *measurement;
    bool is_first; // the revision, of a new material
    uint64_t version;
} MaterialWrite;

static Status review_validate(const MaterialReview *review, const MaterialKey *key,
                              Problem *problem) {
    const unsigned long long revision = review->revision;
    if (key->status[0] == '\0')
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the material \"%.64s\" has no revision %llu, its newest is %llu",
                           review->slug, revision, (unsigned long long)key->latest);
    if (strcmp(key->status, review->status) == 0)
        return problem_set(problem, STATUS_CONFLICT, "%.64s@%llu is %s already", review->slug,
                           revision, key->status);
    if (strcmp(review->status, "approved") == 0 && review->reviewer != NULL &&
        strcmp(key->author, review->reviewer) == 0)
        return problem_set(problem, STATUS_FORBIDDEN,
                           "%.64s is the author of %.64s@%llu and may not approve their own "
                           "revision: another user has to review it",
                           key->author, review->slug, revision);
    return STATUS_OK;
}

// Adds the row with its audit entry.
static Status material_apply(Sqlite *database, const void *work, Problem *problem) {
    const MaterialWrite *write = work;
    MaterialRevision *revision = write->revision;
    const MaterialReview *review = write->review;
    MaterialMeasurement *measurement = write->measurement;
    AuditEntry entry = {.slug = revision != NULL ? revision->slug
                                : review != NULL ? review->slug
                                                 : measurement->slug};
    const char *slug = entry.slug;
    MaterialKey key;
    TRY(material_key_find(database, slug, review != NULL ? review->revision : 0, &key, problem));
    if (write->is_first && key.number != 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "there is a material \"%.64s\" already: add a revision to it, or "
                           "choose another slug",
                           slug);
    if (write->is_first)
        TRY(material_row_add(database, slug, problem));
    else if (key.number == 0)
        return problem_set(problem, STATUS_NOT_FOUND, no_material, slug);
    else if (write->version != ANY_VERSION && write->version != key.version)
        return problem_set(problem, STATUS_STALE,
                           "the material \"%.64s\" has changed: it is at version %llu, you read "
                           "version %llu; read it again",
                           slug, (unsigned long long)key.version,
                           (unsigned long long)write->version);
    if (revision != NULL) {
        revision->revision = key.latest + 1;
        entry.action = write->is_first ? "create" : revision->reverts > 0 ? "revert" : "revise";
        entry.revision = revision->revision;
        entry.who = revision->author;
        entry.why = revision->comment;
        entry.created_unix_ms = revision->created_unix_ms;
        TRY(material_revision_add(database, revision, problem));
    } else if (review != NULL) {
        TRY(review_validate(review, &key, problem));
        entry.action = strcmp(review->status, "approved") == 0 ? "approve" : "deprecate";
        entry.revision = review->revision;
        entry.who = review->reviewer;
        entry.why = review->reason;
        entry.created_unix_ms = review->created_unix_ms;
        TRY(material_review_add(database, review, problem));
    } else {
        measurement->measurement = key.measurements + 1;
        entry.action = "measure";
        entry.measurement = measurement->measurement;
        entry.who = measurement->author;
        entry.why = measurement->comment;
        entry.created_unix_ms = measurement->created_unix_ms;
        TRY(material_measurement_add(database, measurement, problem));
    }
    return audit_entry_add(database, &entry, problem);
}

static Status material_write(Db *db, const MaterialWrite *write, Problem *problem) {
    const Status status = db_write(db, material_apply, write, problem);
    shared_cache_clear(db_cache(db, CACHE_MATERIALS));
    return status;
}

Status db_material_add(Db *db, MaterialRevision *first, Problem *problem) {
    return material_write(db, &(MaterialWrite){.revision = first, .is_first = true}, problem);
}

Status db_material_revise(Db *db, MaterialRevision *revision, uint64_t version, Problem *problem) {
    return material_write(db, &(MaterialWrite){.revision = revision, .version = version}, problem);
}

Status db_material_review(Db *db, const MaterialReview *review, uint64_t version,
                          Problem *problem) {
    return material_write(db, &(MaterialWrite){.review = review, .version = version}, problem);
}

Status db_material_measure(Db *db, MaterialMeasurement *measurement, uint64_t version,
                           Problem *problem) {
    return material_write(db, &(MaterialWrite){.measurement = measurement, .version = version},
                          problem);
}
