// Reading. The view material_states says of each revision what the last review made of it.
#include "server/db/materials.h"

#include <stdlib.h>
#include <string.h>

#include "server/db/material_columns.h"
#include "server/db/material_memory.h"

typedef struct Key {
    char *slug;
    uint64_t number; // of a revision, a measurement, an entry of the trail
    uint64_t most;
} Key;
static const RowColumn key_columns[] = {ROW_COLUMN(Key, slug, COLUMN_TEXT),
                                        ROW_COLUMN(Key, number, COLUMN_COUNT),
                                        ROW_COLUMN(Key, most, COLUMN_COUNT), ROW_END};

// SQLite counts with a sign; no number is that high.
static Key key_of(const char *slug, uint64_t number) {
    return (Key){(char *)slug, number > INT64_MAX ? INT64_MAX : number, INT64_MAX};
}

static Key key_of_page(const char *slug, uint64_t before, size_t most) {
    Key key = key_of(slug, before);
    key.most = most > INT64_MAX ? INT64_MAX : most;
    return key;
}

// The head: an approved revision before any other, the newest first; a deprecated one is nobody's
// head.
static const char head_sql[] =
    "SELECT * FROM material_states WHERE slug = :slug AND status <> 'deprecated' "
    "ORDER BY status = 'approved' DESC, revision DESC LIMIT 1";
static const char revision_sql[] =
    "SELECT * FROM material_states WHERE slug = :slug AND revision = :number";
// Of each material the same, and of one whose revisions are all deprecated the newest.
static const char heads_sql[] =
    "SELECT s.* FROM materials m JOIN material_states s ON s.material = m.number AND s.revision = "
    "(SELECT h.revision FROM material_states h WHERE h.material = m.number ORDER BY h.status = "
    "'approved' DESC, h.status = 'draft' DESC, h.revision DESC LIMIT 1) WHERE m.slug > :slug ORDER "
    "BY m.slug LIMIT :most";

void material_revision_clear(MaterialRevision *revision) {
    fields_clear(material_fields, &revision->material);
    row_clear(material_revision_columns, revision, sizeof *revision);
}

static Status refuse_slug(const char *slug, Problem *problem) {
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
        return refuse_slug(slug, problem);
    *state = (MaterialState){key.latest, key.version, key.measurements};
    return STATUS_OK;
}

Status db_material(Db *db, const char *slug, uint64_t revision, MaterialRevision *material,
                   Problem *problem) {
    const Key key = key_of(slug, revision);
    MaterialMemory *memory = db_material_memory(db);
    const uint64_t catalog_version = db_audit_version(db);
    bool is_found;
    memset(material, 0, sizeof *material);
    if (material_memory_find(memory, catalog_version, slug, revision, material))
        return STATUS_OK;
    TRY(db_first(db, revision == 0 ? head_sql : revision_sql, key_columns, &key,
                 material_revision_columns, material, &is_found, problem));
    if (is_found) {
        material_memory_put(memory, catalog_version, revision, material);
        return STATUS_OK;
    }
    MaterialState state;
    TRY(db_material_state(db, slug, &state, problem));
    if (revision == 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "every revision of the material \"%.64s\" is deprecated; name one, as "
                           "%.64s@%llu, to use it all the same",
                           slug, slug, (unsigned long long)state.latest);
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no material \"%.64s\" with a revision %llu", slug,
                       (unsigned long long)revision);
}

// All rows of a query into a typed list; on failure it is cleared.
static Status all(Db *db, const char *sql, const Key *key, const RowColumn *columns, size_t size,
                  void *list, Problem *problem) {
    List *rows = list;
    *rows = (List){NULL, 0};
    const Status status = db_all(db, sql, key == NULL ? NULL : key_columns, key, columns, size,
                                 &rows->at, &rows->count, problem);
    if (status == STATUS_OK)
        return status;
    for (size_t i = 0; i < rows->count; i++)
        row_clear(columns, (char *)rows->at + i * size, size);
    free(rows->at);
    *rows = (List){NULL, 0};
    return status;
}

Status db_material_slugs(Db *db, Texts *slugs, Problem *problem) {
    static const char sql[] = "SELECT slug FROM materials ORDER BY slug";
    // A row of one text is that text.
    static const RowColumn columns[] = {{.name = "slug", .kind = COLUMN_TEXT}, ROW_END};
    return all(db, sql, NULL, columns, sizeof *slugs->at, slugs, problem);
}

void material_slugs_clear(Texts *slugs) {
    for (size_t i = 0; i < slugs->count; i++)
        free(slugs->at[i]);
    free(slugs->at);
    *slugs = (Texts){NULL, 0};
}

Status db_material_heads(Db *db, const char *after, size_t most, MaterialRevisions *materials,
                         Problem *problem) {
    const Key key = key_of_page(after, 0, most);
    return all(db, heads_sql, &key, material_revision_columns, sizeof *materials->at, materials,
               problem);
}

Status db_material_page(Db *db, const char *slug, uint64_t before, size_t most,
                        MaterialRevisions *revisions, Problem *problem) {
    static const char sql[] = "SELECT * FROM material_states WHERE slug = :slug AND revision < "
                              ":number ORDER BY revision DESC LIMIT :most";
    const Key key = key_of_page(slug, before, most);
    return all(db, sql, &key, material_revision_columns, sizeof *revisions->at, revisions, problem);
}

static void clear_all(const RowColumn *columns, size_t size, void *list) {
    List *rows = list;
    for (size_t i = 0; i < rows->count; i++)
        row_clear(columns, (char *)rows->at + i * size, size);
    free(rows->at);
    *rows = (List){NULL, 0};
}

void material_revisions_clear(MaterialRevisions *materials) {
    for (size_t i = 0; i < materials->count; i++)
        material_revision_clear(&materials->at[i]);
    free(materials->at);
    *materials = (MaterialRevisions){NULL, 0};
}

void material_reviews_clear(MaterialReviews *reviews) {
    clear_all(material_review_columns, sizeof *reviews->at, reviews);
}

static const char measurement_sql[] =
    "SELECT m.slug, t.* FROM material_measurements t JOIN materials m ON m.number = t.material "
    "WHERE m.slug = :slug AND t.measurement = :number";

Status db_material_measurement(Db *db, const char *slug, uint64_t number,
                               MaterialMeasurement *measurement, Problem *problem) {
    const Key key = key_of(slug, number);
    bool is_found;
    memset(measurement, 0, sizeof *measurement);
    TRY(db_first(db, measurement_sql, key_columns, &key, material_measurement_columns, measurement,
                 &is_found, problem));
    if (is_found)
        return STATUS_OK;
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no measurement %llu of a material \"%.64s\"",
                       (unsigned long long)number, slug);
}

Status db_measurement_summaries(Db *db, const char *slug, uint64_t before, size_t most,
                                MeasurementSummaries *briefs, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.measurement, t.author, t.comment, t.created_unix_ms, t.head, t.drops, "
        "t.traces FROM material_measurements t JOIN materials m ON m.number = t.material WHERE "
        "m.slug = :slug AND t.measurement < :number ORDER BY t.measurement DESC LIMIT :most";
    const Key key = key_of_page(slug, before, most);
    return all(db, sql, &key, material_brief_columns, sizeof *briefs->at, briefs, problem);
}

void measurement_summaries_clear(MeasurementSummaries *briefs) {
    clear_all(material_brief_columns, sizeof *briefs->at, briefs);
}

void material_measurement_clear(MaterialMeasurement *measurement) {
    row_clear(material_measurement_columns, measurement, sizeof *measurement);
}

Status db_audit_entries(Db *db, const char *slug, uint64_t before, size_t most,
                        AuditEntries *audit_entries, Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM material_trail t JOIN materials m ON m.number = t.material WHERE m.slug = "
        ":slug AND t.version < :number ORDER BY t.version DESC LIMIT :most";
    const Key key = key_of_page(slug, before, most);
    return all(db, sql, &key, material_deed_columns, sizeof *audit_entries->at, audit_entries,
               problem);
}

void audit_entries_clear(AuditEntries *audit_entries) {
    clear_all(material_deed_columns, sizeof *audit_entries->at, audit_entries);
}
