// All that is said of materials, one by one, as of one moment: rows are only ever added, so that
// the newest number of each kind tells a moment. Not the texts. Used by formats/material_export.c.
#ifndef SERVER_DB_MATERIAL_EXPORT_H
#define SERVER_DB_MATERIAL_EXPORT_H

#include "server/db/materials.h"

// The newest row of each kind.
typedef struct MaterialMoment {
    int64_t revisions, reviews, measurements;
} MaterialMoment;

Status db_material_moment(Db *db, MaterialMoment *moment, Problem *problem);

// What is found below may be uninitialised before, and is cleared by the caller in any case;
// *is_found is false behind the last.

// The first revision of the first material behind `slug`.
Status db_material_behind(Db *db, const MaterialMoment *moment, const char *slug,
                          MaterialRevision *revision, bool *is_found, Problem *problem);
// The first of a material's revisions behind `number`. What its last review made of it is not told.
Status db_revision_behind(Db *db, const MaterialMoment *moment, const char *slug, uint64_t number,
                          MaterialRevision *revision, bool *is_found, Problem *problem);
// The reviews of one revision in their order.
Status db_reviews_of(Db *db, const MaterialMoment *moment, const char *slug, uint64_t revision,
                     MaterialReviews *reviews, Problem *problem);
// The first of a material's measurements behind `number`.
Status db_measurement_behind(Db *db, const MaterialMoment *moment, const char *slug,
                             uint64_t number, MaterialMeasurement *measurement, bool *is_found,
                             Problem *problem);

#endif
