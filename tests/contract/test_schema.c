// schema/*.schema.json are what the tables print now, and sound JSON.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <dirent.h>
#include <jansson.h>

#include "server/json/schema.h"
#include "tests/support/test.h"

static const char *const folder = IMPACTD_SOURCE_DIR "/schema";

static char *read_file(const char *name) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.schema.json", folder, name);
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        fail_msg("%s is missing: build the target `schema`", path);
    Bytes bytes = {.most = 1 << 24};
    char part[4096];
    size_t size;
    while ((size = fread(part, 1, sizeof part, file)) > 0)
        bytes_put(&bytes, part, size);
    fclose(file);
    return bytes_take(&bytes, NULL);
}

TEST(the_committed_schemas_are_what_the_tables_say) {
    for (const SchemaDocument *document = schema_documents; document->name != NULL; document++) {
        Bytes bytes = {0};
        schema_write_document(&bytes, document);
        assert_false(bytes.is_failed);
        char *committed = read_file(document->name);
        if (strcmp(committed, bytes.at) != 0)
            fail_msg("schema/%s.schema.json is out of date: build the target `schema`",
                     document->name);
        free(committed);
        bytes_clear(&bytes);
    }
}

TEST(every_committed_schema_has_a_table) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    const struct dirent *entry;
    while ((entry = readdir(directory)) != NULL) {
        const char *ending = strstr(entry->d_name, ".schema.json");
        if (ending == NULL)
            continue;
        const size_t length = (size_t)(ending - entry->d_name);
        const SchemaDocument *document = schema_documents;
        while (document->name != NULL && (strncmp(document->name, entry->d_name, length) != 0 ||
                                          document->name[length] != '\0'))
            document++;
        if (document->name == NULL)
            fail_msg("no table prints %s", entry->d_name);
    }
    closedir(directory);
}

TEST(every_schema_is_an_object_that_refuses_unknown_members) {
    for (const SchemaDocument *document = schema_documents; document->name != NULL; document++) {
        Bytes bytes = {0};
        schema_write_document(&bytes, document);
        json_error_t error;
        json_t *schema = json_loadb(bytes.at, bytes.count, JSON_REJECT_DUPLICATES, &error);
        if (schema == NULL)
            fail_msg("%s: %s in line %d", document->name, error.text, error.line);
        assert_string_equal(json_string_value(json_object_get(schema, "$schema")),
                            "https://json-schema.org/draft/2020-12/schema");
        assert_string_equal(json_string_value(json_object_get(schema, "type")), "object");
        assert_true(json_is_false(json_object_get(schema, "additionalProperties")));
        assert_true(json_object_size(json_object_get(schema, "properties")) > 0);
        json_decref(schema);
        bytes_clear(&bytes);
    }
}
