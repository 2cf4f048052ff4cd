// Field rows printed as JSON Schema 2020-12: types, units, ranges, defaults, descriptions.
#ifndef SERVER_JSON_SCHEMA_H
#define SERVER_JSON_SCHEMA_H

#include "core/base/field.h"
#include "server/util/bytes.h"

// A whole schema document, indented, ending in a newline. Units stand under "x-unit".
void schema_write(Bytes *bytes, const char *id, const char *title, const Field *fields);

// The documents that have a schema: "scene", "material" ...
typedef struct SchemaDocument {
    const char *name, *title;
    const Field *fields;
} SchemaDocument;
extern const SchemaDocument schema_documents[]; // ends with name == NULL

// The schema of the document with the $id "/schemas/NAME": schema/NAME.schema.json.
void schema_write_document(Bytes *bytes, const SchemaDocument *document);

#endif
