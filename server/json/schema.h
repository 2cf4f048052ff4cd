// Field rows printed as JSON Schema 2020-12: types, units, ranges, defaults, docs.
// Used by the schema target, GET /schemas and tests.
#ifndef SERVER_JSON_SCHEMA_H
#define SERVER_JSON_SCHEMA_H

#include "core/base/field.h"
#include "server/util/bytes.h"

// A whole schema document, indented, ending in a newline. Units stand under "x-unit".
void schema_write(Bytes *bytes, const char *id, const char *title, const Field *fields);

// The documents that exist: "scene", "material" ... One line each in describe.c.
typedef struct SchemaDocument {
    const char *name, *title;
    const Field *fields;
} SchemaDocument;
extern const SchemaDocument schema_documents[]; // ends with name == NULL

// The document's schema under "/schemas/NAME": what schema/NAME.schema.json holds.
void schema_write_document(Bytes *bytes, const SchemaDocument *document);

#endif
