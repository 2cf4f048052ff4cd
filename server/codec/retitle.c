#include "server/codec/retitle.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "server/codec/scan.h"

static bool label_put(json_t *root, const char *label) {
    json_t *labels = json_object_get(root, "labels");
    if (labels == NULL) {
        labels = json_object();
        if (json_object_set_new(root, "labels", labels) != 0)
            return false;
    }
    if (json_is_array(labels))
        return json_array_append_new(labels, json_string(label)) == 0;
    const size_t length = strcspn(label, "=");
    char *key = strndup(label, length);
    const bool is_put =
        key != NULL && json_object_set_new(labels, key, json_string(label + length + 1)) == 0;
    free(key);
    return is_put;
}

Status retitle(Bytes *text, const char *title, const Texts *labels, Problem *problem) {
    size_t position;
    const char *sentence;
    for (size_t i = 0; i < labels->count; i++)
        if (labels->at[i][0] == '=' || strchr(labels->at[i], '=') == NULL)
            return problem_add(problem, STATUS_USAGE, "--label", "must be KEY=VALUE, is %.100s",
                               labels->at[i]);
    if (title == NULL && labels->count == 0)
        return STATUS_OK;
    if (text->count == 0)
        return STATUS_OK;
    const size_t mark = scan_mark(text->at, text->count);
    const char *json = text->at + mark;
    const size_t size = text->count - mark;
    if (!scan_allows(json, size, &position, &sentence))
        return STATUS_OK;
    json_t *root = json_loadb(json, size, JSON_REJECT_DUPLICATES, NULL);
    const json_t *given = json_object_get(root, "labels");
    if (!json_is_object(root) ||
        (given != NULL && !json_is_object(given) && !json_is_array(given))) {
        json_decref(root);
        return STATUS_OK;
    }
    bool is_put = title == NULL || json_object_set_new(root, "title", json_string(title)) == 0;
    for (size_t i = 0; is_put && i < labels->count; i++)
        is_put = label_put(root, labels->at[i]);
    char *changed = is_put ? json_dumps(root, JSON_COMPACT) : NULL;
    json_decref(root);
    if (changed == NULL)
        return problem_add(problem, STATUS_USAGE, title != NULL ? "--title" : "--label",
                           "must be UTF-8 text");
    bytes_clear(text);
    bytes_text(text, changed);
    free(changed);
    return text->is_failed ? problem_set(problem, STATUS_TOO_LARGE, "the scene is too large")
                           : STATUS_OK;
}
