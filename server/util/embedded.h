// Files that are embedded in the binary by server/embed.cmake: SQL, schemas, examples, web pages.
#ifndef SERVER_UTIL_EMBEDDED_H
#define SERVER_UTIL_EMBEDDED_H

#include <stddef.h>
#include <string.h>

typedef struct EmbeddedFile {
    const char *path;   // from the project's folder: "schema/sql/schema.sql"
    const char *bytes;  // a NUL follows the last one
    size_t size;        // without that NUL
    const char *digest; // half of its SHA-256, in hexadecimal
} EmbeddedFile;

// Each table is sorted by path and ends with path == NULL.
extern const EmbeddedFile embedded_sql[];      // schema/sql/*.sql, the schema first
extern const EmbeddedFile embedded_schemas[];  // schema/*.json
extern const EmbeddedFile embedded_examples[]; // schema/examples/*.json
extern const EmbeddedFile embedded_web[];      // web/, all that a browser loads
extern const EmbeddedFile embedded_client[];   // web/client/, clients in other languages
extern const EmbeddedFile embedded_guide[];    // guide/, of the program alone: guide_files

// The row of that path, NULL if there is none. The tables are short.
static inline const EmbeddedFile *embedded_find(const EmbeddedFile *table, const char *path) {
    const EmbeddedFile *file = table;
    while (file->path != NULL && strcmp(file->path, path) != 0)
        file++;
    return file->path != NULL ? file : NULL;
}

#endif
