#include "server/db/material_columns.h"

// clang-format off
#define OF_MATERIAL(member, kind_) ROW_COLUMN_AS(MaterialRevision, material.member, #member, kind_)
const RowColumn material_revision_columns[] = {
    ROW_COLUMN(MaterialRevision, slug, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, revision, COLUMN_COUNT),
    OF_MATERIAL(name, COLUMN_TEXT),
    OF_MATERIAL(kind, COLUMN_TEXT),
    OF_MATERIAL(thickness, COLUMN_REAL),
    OF_MATERIAL(hardness, COLUMN_TEXT),
    OF_MATERIAL(supplier, COLUMN_TEXT),
    OF_MATERIAL(notes, COLUMN_TEXT),
    OF_MATERIAL(restitution, COLUMN_REAL),
    OF_MATERIAL(restitution_deviation, COLUMN_REAL),
    OF_MATERIAL(contact_time, COLUMN_REAL),
    OF_MATERIAL(contact_time_deviation, COLUMN_REAL),
    OF_MATERIAL(separation, COLUMN_CHOICE),
    OF_MATERIAL(least_speed, COLUMN_REAL),
    OF_MATERIAL(most_speed, COLUMN_REAL),
    OF_MATERIAL(least_temperature, COLUMN_REAL),
    OF_MATERIAL(most_temperature, COLUMN_REAL),
    OF_MATERIAL(impactor, COLUMN_TEXT),
    OF_MATERIAL(impactor_mass, COLUMN_REAL),
    OF_MATERIAL(base, COLUMN_CHOICE),
    OF_MATERIAL(base_mass, COLUMN_REAL),
    OF_MATERIAL(source, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, lists, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, reverts, COLUMN_COUNT),
    ROW_COLUMN(MaterialRevision, author, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, comment, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, created_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(MaterialRevision, status, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, reason, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, reviewer, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, reviewed_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(MaterialRevision, latest, COLUMN_COUNT),
    ROW_COLUMN(MaterialRevision, version, COLUMN_COUNT),
    ROW_END
};

const RowColumn material_review_columns[] = {
    ROW_COLUMN(MaterialReview, slug, COLUMN_TEXT),
    ROW_COLUMN(MaterialReview, revision, COLUMN_COUNT),
    ROW_COLUMN(MaterialReview, status, COLUMN_TEXT),
    ROW_COLUMN(MaterialReview, reason, COLUMN_TEXT),
    ROW_COLUMN(MaterialReview, reviewer, COLUMN_TEXT),
    ROW_COLUMN(MaterialReview, created_unix_ms, COLUMN_INTEGER),
    ROW_END
};

const RowColumn material_measurement_columns[] = {
    ROW_COLUMN(MaterialMeasurement, slug, COLUMN_TEXT),
    ROW_COLUMN(MaterialMeasurement, measurement, COLUMN_COUNT),
    ROW_COLUMN(MaterialMeasurement, author, COLUMN_TEXT),
    ROW_COLUMN(MaterialMeasurement, comment, COLUMN_TEXT),
    ROW_COLUMN(MaterialMeasurement, created_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN(MaterialMeasurement, document, COLUMN_TEXT),
    ROW_END
};

#define OF_ROW(member, kind_) ROW_COLUMN_AS(MeasurementSummary, row.member, #member, kind_)
const RowColumn material_brief_columns[] = {
    OF_ROW(slug, COLUMN_TEXT),
    OF_ROW(measurement, COLUMN_COUNT),
    OF_ROW(author, COLUMN_TEXT),
    OF_ROW(comment, COLUMN_TEXT),
    OF_ROW(created_unix_ms, COLUMN_INTEGER),
    ROW_COLUMN_AS(MeasurementSummary, row.document, "head", COLUMN_TEXT),
    ROW_COLUMN(MeasurementSummary, drops, COLUMN_COUNT),
    ROW_COLUMN(MeasurementSummary, traces, COLUMN_COUNT),
    ROW_END
};

const RowColumn material_deed_columns[] = {
    ROW_COLUMN(AuditEntry, version, COLUMN_COUNT),
    ROW_COLUMN(AuditEntry, action, COLUMN_TEXT),
    ROW_COLUMN(AuditEntry, revision, COLUMN_COUNT),
    ROW_COLUMN(AuditEntry, measurement, COLUMN_COUNT),
    ROW_COLUMN(AuditEntry, who, COLUMN_TEXT),
    ROW_COLUMN(AuditEntry, why, COLUMN_TEXT),
    ROW_COLUMN(AuditEntry, created_unix_ms, COLUMN_INTEGER),
    ROW_END
};

const RowColumn material_key_columns[] = {
    ROW_COLUMN(MaterialKey, slug, COLUMN_TEXT),
    ROW_COLUMN(MaterialKey, number, COLUMN_INTEGER),
    ROW_COLUMN(MaterialKey, revision, COLUMN_COUNT),
    ROW_COLUMN(MaterialKey, latest, COLUMN_COUNT),
    ROW_COLUMN(MaterialKey, version, COLUMN_COUNT),
    ROW_COLUMN(MaterialKey, measurements, COLUMN_COUNT),
    ROW_COLUMN(MaterialKey, status, COLUMN_NAME),
    ROW_COLUMN(MaterialKey, author, COLUMN_NAME),
    ROW_END
};
// clang-format on
