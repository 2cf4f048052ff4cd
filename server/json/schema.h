// The documents that clients send other than scenes, and Field rows printed as JSON Schema 2020-12:
// types, units, ranges, defaults, descriptions.
#ifndef SERVER_JSON_SCHEMA_H
#define SERVER_JSON_SCHEMA_H

#include "core/drop_test/drop_test.h"
#include "core/scene/material.h"
#include "server/util/bytes.h"

// A new material, or a new revision of one: then the slug is the address's.
typedef struct MaterialBody {
    char *slug;    // new_material_fields alone
    char *comment; // why; NULL: none, of a new material
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

// The documents that have a schema: "scene", "material" ...
typedef struct SchemaDocument {
    const char *name, *title;
    const Field *fields;           // of a document that is read; else NULL, and
    const struct StudyKind *study; // whose answer is written
} SchemaDocument;
extern const SchemaDocument schema_documents[]; // ends with name == NULL

// Appends the schema of the document, schema/NAME.schema.json: indented, with the $id
// "/schemas/NAME", units under "x-unit".
void schema_write_document(Bytes *bytes, const SchemaDocument *document);

#endif
