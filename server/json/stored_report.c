#include "server/json/stored_report.h"

#include <jansson.h>
#include <string.h>

#include "server/json/decode.h"

Status stored_report_read(const char *text, size_t size, const Field *fields, void *item,
                          Problem *problem) {
    if (fields_default(fields, item) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read a report");
    Decoder reader = {.problem = NULL};
    json_t *root = json_loadb(text, size, JSON_REJECT_DUPLICATES, NULL);
    bool is_read = json_is_object(root);
    if (is_read) {
        const char *name;
        json_t *value;
        void *next;
        json_object_foreach_safe(root, next, name, value) {
            if (json_is_null(value) || fields_find(fields, name, NULL) == NULL)
                json_object_del(root, name);
        }
        decode_root(&reader, root, fields, item, "");
        is_read = !reader.is_faulty && !reader.is_out_of_memory;
    }
    json_decref(root);
    return is_read ? STATUS_OK
                   : problem_set(problem, STATUS_INTERNAL, "a stored report cannot be read");
}
