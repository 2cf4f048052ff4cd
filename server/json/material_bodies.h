// What people send to write materials: a new one, a revision, a revert, a review, a measurement.
// Not what is stored (db/materials.h). Read by api/, described by describe.c.
#ifndef SERVER_JSON_MATERIAL_BODIES_H
#define SERVER_JSON_MATERIAL_BODIES_H

#include "core/drop_test/drop_test.h"
#include "core/scene/material.h"

// A new material, or a new revision of one: then the slug is the address's.
typedef struct MaterialBody {
    char *slug;    // new_material_fields alone
    char *comment; // why; NULL: a new material says nothing
    Material material;
} MaterialBody;
extern const Field new_material_fields[], material_revision_fields[];

typedef struct MaterialRevertBody {
    uint64_t to; // the revision that is to be said again
    char *comment;
} MaterialRevertBody;
extern const Field material_revert_fields[];

extern const char *const material_verdicts[]; // "approved", "deprecated"; NULL-terminated
typedef struct MaterialReviewBody {
    int status; // of material_verdicts
    char *reason;
} MaterialReviewBody;
extern const Field material_review_fields[];

typedef struct MeasurementBody {
    DropTest test;
    char *comment; // NULL: nothing is said
} MeasurementBody;
extern const Field measurement_body_fields[];

#endif
