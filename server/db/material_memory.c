// A short list, searched from end to end. Where it is full, or the catalogue has changed, it begins
// anew. What it holds are rows as they are stored: their lists are texts, not read yet.
#include "server/db/material_memory.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/material_columns.h"

enum { MOST = 32 };

typedef struct Known {
    uint64_t asked; // revision; 0: the head
    MaterialRevision material;
} Known;

struct MaterialMemory {
    pthread_mutex_t lock;
    uint64_t catalog_version;
    size_t count;
    Known known[MOST];
};

MaterialMemory *material_memory_new(void) {
    MaterialMemory *memory = calloc(1, sizeof *memory);
    if (memory != NULL)
        pthread_mutex_init(&memory->lock, NULL);
    return memory;
}

static void forget(MaterialMemory *memory) {
    for (size_t i = 0; i < memory->count; i++)
        material_revision_clear(&memory->known[i].material);
    memory->count = 0;
}

void material_memory_free(MaterialMemory *memory) {
    if (memory == NULL)
        return;
    forget(memory);
    pthread_mutex_destroy(&memory->lock);
    free(memory);
}

bool material_memory_find(MaterialMemory *memory, uint64_t catalog_version, const char *slug,
                          uint64_t revision, MaterialRevision *material) {
    bool is_found = false;
    pthread_mutex_lock(&memory->lock);
    for (size_t i = 0; i < memory->count && catalog_version == memory->catalog_version && !is_found;
         i++) {
        const Known *known = &memory->known[i];
        is_found =
            known->asked == revision && strcmp(known->material.slug, slug) == 0 &&
            row_copy(material_revision_columns, &known->material, material, sizeof *material);
    }
    pthread_mutex_unlock(&memory->lock);
    return is_found;
}

void material_memory_put(MaterialMemory *memory, uint64_t catalog_version, uint64_t revision,
                         const MaterialRevision *material) {
    pthread_mutex_lock(&memory->lock);
    // Never back to what the catalogue was before.
    if (catalog_version > memory->catalog_version || memory->count == MOST)
        forget(memory);
    if (catalog_version >= memory->catalog_version) {
        Known *known = &memory->known[memory->count];
        memory->catalog_version = catalog_version;
        known->asked = revision;
        memory->count +=
            row_copy(material_revision_columns, material, &known->material, sizeof known->material);
    }
    pthread_mutex_unlock(&memory->lock);
}
