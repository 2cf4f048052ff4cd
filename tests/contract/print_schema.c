// Writes every document of schema_documents to FOLDER/NAME.schema.json. Run by the CMake target
// `schema`.
#include <stdio.h>

#include "server/json/schema.h"

static int write_file(const char *path, const Bytes *bytes) {
    FILE *file = fopen(path, "wb");
    if (file == NULL)
        return 0;
    const int is_written = fwrite(bytes->at, 1, bytes->count, file) == bytes->count;
    return fclose(file) == 0 && is_written;
}

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: print_schema FOLDER\n");
        return 2;
    }
    for (const SchemaDocument *document = schema_documents; document->name != NULL; document++) {
        char path[4096];
        snprintf(path, sizeof path, "%s/%s.schema.json", argv[1], document->name);
        Bytes bytes = {0};
        schema_write_document(&bytes, document);
        if (bytes.is_failed || !write_file(path, &bytes)) {
            fprintf(stderr, "cannot write %s\n", path);
            bytes_clear(&bytes);
            return 1;
        }
        bytes_clear(&bytes);
    }
    return 0;
}
