// The samples of records in memory: those of the last records named, up to `memory_max` bytes, and
// those that jobs refer to, which cost nothing more here. (Not util/hashmap: an evicted record that
// jobs still have would be read, and kept, once more by the next one that names it.)
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "server/db/db_private.h"

static const size_t memory_max = 64 << 20;

typedef struct Entry {
    struct Entry *next;
    NamedRecord *named;
} Entry;

struct RecordMemory {
    pthread_mutex_t lock;
    Entry *first; // the last used
};

RecordMemory *record_memory_new(void) {
    RecordMemory *memory = calloc(1, sizeof *memory);
    if (memory != NULL)
        pthread_mutex_init(&memory->lock, NULL);
    return memory;
}

static void entry_remove(Entry **at) {
    Entry *entry = *at;
    *at = entry->next;
    refcount_unref(&entry->named->shared);
    free(entry);
}

void record_memory_free(RecordMemory *memory) {
    if (memory == NULL)
        return;
    while (memory->first != NULL)
        entry_remove(&memory->first);
    pthread_mutex_destroy(&memory->lock);
    free(memory);
}

// A reference to the record of that name and digest, which becomes the first, or NULL. With the
// lock held.
static NamedRecord *memory_find(RecordMemory *memory, const char *name, const char *digest) {
    for (Entry **at = &memory->first; *at != NULL; at = &(*at)->next) {
        Entry *entry = *at;
        if (strcmp(entry->named->name, name) != 0 || strcmp(entry->named->digest, digest) != 0)
            continue;
        *at = entry->next;
        entry->next = memory->first;
        memory->first = entry;
        refcount_ref(&entry->named->shared);
        return entry->named;
    }
    return NULL;
}

// With the lock held, without which no other thread gets a reference.
static void memory_evict(RecordMemory *memory) {
    size_t bytes = 0;
    for (Entry **at = &memory->first; *at != NULL;) {
        const NamedRecord *named = (*at)->named;
        bytes += named->samples.count * sizeof(double);
        if (atomic_load(&named->shared.count) > 1 || bytes <= memory_max)
            at = &(*at)->next;
        else
            entry_remove(at);
    }
}

NamedRecord *record_memory_find(RecordMemory *memory, const char *name, const char *digest) {
    pthread_mutex_lock(&memory->lock);
    NamedRecord *named = memory_find(memory, name, digest);
    pthread_mutex_unlock(&memory->lock);
    return named;
}

NamedRecord *record_memory_add(RecordMemory *memory, NamedRecord *named) {
    Entry *entry = malloc(sizeof *entry);
    pthread_mutex_lock(&memory->lock);
    NamedRecord *there = memory_find(memory, named->name, named->digest);
    if (there == NULL && entry != NULL) {
        *entry = (Entry){memory->first, named};
        refcount_ref(&named->shared);
        memory->first = entry;
        entry = NULL;
        memory_evict(memory);
    }
    pthread_mutex_unlock(&memory->lock);
    free(entry);
    if (there == NULL)
        return named;
    refcount_unref(&named->shared);
    return there;
}
