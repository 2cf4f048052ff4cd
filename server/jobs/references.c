// A sweep pins every material that it or its scene names, so that its list is all of them.
#include "server/jobs/references.h"

#include <stdlib.h>
#include <string.h>

#include "core/study/sweep.h"
#include "server/jobs/resolve_record.h"

static bool has_line(const Bytes *bytes, const char *name, size_t length) {
    for (size_t at = 0; at < bytes->count;) {
        const char *line = bytes->at + at;
        const size_t size = (size_t)((const char *)memchr(line, '\n', bytes->count - at) - line);
        if (size == length && memcmp(line, name, length) == 0)
            return true;
        at += size + 1;
    }
    return false;
}

static void add(Bytes *bytes, const Buffer *buffer) {
    const char *name = buffer->material;
    if (name == NULL || has_line(bytes, name, strlen(name)))
        return;
    bytes_text(bytes, name);
    bytes_text(bytes, "\n");
}

void references_write(Bytes *bytes, const StudyRequest *inquiry) {
    const Dampers *dampers = &inquiry->simulation.scene.dampers;
    for (size_t i = 0; i < dampers->count; i++) {
        add(bytes, &dampers->at[i].buffer);
        add(bytes, &dampers->at[i].left_buffer);
        add(bytes, &dampers->at[i].right_buffer);
    }
    resolve_record_uses(inquiry, bytes);
    if (inquiry->study == NULL || study_kind(inquiry->study) != &study_sweep)
        return;
    const SweepStudy *study = (const SweepStudy *)(const void *)inquiry->study;
    for (size_t i = 0; i < study->materials.count; i++)
        add(bytes, &study->materials.at[i]);
}

bool references_next(const char **lines, ReferenceRow *use) {
    const size_t size = *lines == NULL ? 0 : strcspn(*lines, "\n");
    const size_t length = size == 0 ? 0 : strcspn(*lines, "@\n");
    *use = (ReferenceRow){.slug = ""};
    if (size == 0)
        return false;
    if (length < size && length < sizeof use->slug) {
        memcpy(use->slug, *lines, length);
        use->revision = strtoull(*lines + length + 1, NULL, 10);
    }
    *lines += size + ((*lines)[size] == '\n');
    return true;
}
