// Embedded files are byte for byte those of the tree.
#include "server/util/embedded.h"
#include "tests/support/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

TEST(every_embedded_file_equals_its_source) {
    const EmbeddedFile *const tables[] = {embedded_sql, embedded_schemas, embedded_examples,
                                          embedded_web};
    size_t files = 0;
    for (size_t t = 0; t < sizeof(tables) / sizeof(tables[0]); t++)
        for (const EmbeddedFile *file = tables[t]; file->path != NULL; file++, files++) {
            char path[1024];
            snprintf(path, sizeof(path), "%s/%s", IMPACTD_SOURCE_DIR, file->path);
            FILE *source = fopen(path, "rb");
            assert_non_null(source);
            char *bytes = malloc(file->size + 1);
            assert_non_null(bytes);
            assert_int_equal(fread(bytes, 1, file->size + 1, source), file->size);
            assert_memory_equal(bytes, file->bytes, file->size);
            assert_int_equal(file->bytes[file->size], 0);
            free(bytes);
            fclose(source);
        }
    assert_true(files > 0);
}

TEST(a_file_is_found_by_its_path) {
    const EmbeddedFile *file = embedded_find(embedded_sql, "schema/sql/schema.sql");
    assert_non_null(file);
    assert_non_null(strstr(file->bytes, "CREATE TABLE"));
    assert_null(embedded_find(embedded_sql, "schema/sql/schema"));
}
