#include "server/db/material_export.h"

#include <string.h>

#include "server/db/material_columns.h"

typedef struct Key {
    char *slug;
    uint64_t number;
    MaterialMoment moment;
} Key;
// clang-format off
static const RowColumn key_columns[] = {
    ROW_COLUMN(Key, slug, COLUMN_TEXT),
    ROW_COLUMN(Key, number, COLUMN_COUNT),
    ROW_COLUMN_AS(Key, moment.revisions, "revisions", COLUMN_INTEGER),
    ROW_COLUMN_AS(Key, moment.reviews, "reviews", COLUMN_INTEGER),
    ROW_COLUMN_AS(Key, moment.measurements, "measurements", COLUMN_INTEGER),
    ROW_END
};
static const RowColumn moment_columns[] = {
    ROW_COLUMN(MaterialMoment, revisions, COLUMN_INTEGER),
    ROW_COLUMN(MaterialMoment, reviews, COLUMN_INTEGER),
    ROW_COLUMN(MaterialMoment, measurements, COLUMN_INTEGER),
    ROW_END
};
// clang-format on

Status db_material_moment(Db *db, MaterialMoment *moment, Problem *problem) {
    static const char sql[] =
        "SELECT (SELECT coalesce(max(number), 0) FROM material_revisions) AS revisions, "
        "(SELECT coalesce(max(number), 0) FROM material_reviews) AS reviews, "
        "(SELECT coalesce(max(number), 0) FROM material_measurements) AS measurements";
    bool is_found;
    *moment = (MaterialMoment){0, 0, 0};
    return db_first(db, sql, NULL, NULL, moment_columns, moment, &is_found, problem);
}

static Status first_revision(Db *db, const char *sql, const Key *key, MaterialRevision *revision,
                             bool *is_found, Problem *problem) {
    memset(revision, 0, sizeof *revision);
    return db_first(db, sql, key_columns, key, material_revision_columns, revision, is_found,
                    problem);
}

// CROSS and + keep the database to slugs in order: all revisions up to a number would be sorted
// for each material.
Status db_material_behind(Db *db, const MaterialMoment *moment, const char *slug,
                          MaterialRevision *revision, bool *is_found, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, r.* FROM materials m CROSS JOIN material_revisions r ON r.material = "
        "m.number "
        "WHERE m.slug > :slug AND +r.number <= :revisions ORDER BY m.slug, r.revision LIMIT 1";
    const Key key = {.slug = (char *)slug, .moment = *moment};
    return first_revision(db, sql, &key, revision, is_found, problem);
}

Status db_revision_behind(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                          MaterialRevision *revision, bool *is_found, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, r.* FROM materials m JOIN material_revisions r ON r.material = m.number "
        "WHERE m.slug = :slug AND r.revision > :number AND r.number <= :revisions "
        "ORDER BY r.revision LIMIT 1";
    const Key key = {(char *)slug, number, *moment};
    return first_revision(db, sql, &key, revision, is_found, problem);
}

Status db_reviews_of(Db *db, const MaterialMoment *moment, const char *slug, uint64_t revision,
                     MaterialReviews *reviews, Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, v.* FROM materials m JOIN material_reviews v ON v.material = m.number "
        "WHERE m.slug = :slug AND v.revision = :number AND v.number <= :reviews ORDER BY v.number";
    const Key key = {(char *)slug, revision, *moment};
    void *at;
    const Status status = db_all(db, sql, key_columns, &key, material_review_columns,
                                 sizeof *reviews->at, &at, &reviews->count, problem);
    reviews->at = at;
    return status;
}

Status db_measurement_behind(Db *db, const MaterialMoment *moment, const char *slug,
                             uint64_t number, MaterialMeasurement *measurement, bool *is_found,
                             Problem *problem) {
    static const char sql[] =
        "SELECT m.slug, t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement > :number AND t.number <= :measurements "
        "ORDER BY t.measurement LIMIT 1";
    const Key key = {(char *)slug, number, *moment};
    memset(measurement, 0, sizeof *measurement);
    return db_first(db, sql, key_columns, &key, material_measurement_columns, measurement, is_found,
                    problem);
}
