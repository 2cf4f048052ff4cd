// All that is said of materials, one by one, as of one moment: rows are only ever added, so that
// the newest number of each kind tells a moment. Not the texts. Used by encode/exchange_text.c.
#ifndef SERVER_STORE_MATERIAL_EXPORT_H
#define SERVER_STORE_MATERIAL_EXPORT_H

#include "server/store/material_rows.h"

// The newest row of each kind.
typedef struct MaterialMoment {
    int64_t revisions, reviews, measurements;
} MaterialMoment;

Status store_material_moment(Store *store, MaterialMoment *moment, Problem *problem);

// The revisions of the first material behind `slug` in their order, and their reviews, by revision;
// none behind the last. What the last review made of a revision is not told in it. Both are cleared
// by the caller, in any case.
Status store_material_behind(Store *store, const MaterialMoment *moment, const char *slug,
                             MaterialRevisions *revisions, MaterialReviews *reviews,
                             Problem *problem);

// The first of a material's measurements behind `number`; *is_found is false behind the last.
// `measurement` may be uninitialised.
Status store_measurement_behind(Store *store, const MaterialMoment *moment, const char *slug,
                                uint64_t number, MaterialMeasurement *measurement, bool *is_found,
                                Problem *problem);

#endif
