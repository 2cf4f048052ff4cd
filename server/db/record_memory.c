// A list with the last asked for in front. Whatever others hold costs nothing more by standing
// here; of the rest the longest unused goes first, beyond a budget of bytes.
#include "server/db/record_memory.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static const size_t bytes_max = 64 << 20;

typedef struct Entry {
    struct Entry *next;
    NamedRecord *named;
    uint64_t catalog_version; // of the catalogue, under which the name was found to stand for it
} Entry;

struct RecordMemory {
    pthread_mutex_t lock;
    Entry *first;
};

RecordMemory *record_memory_new(void) {
    RecordMemory *memory = calloc(1, sizeof *memory);
    if (memory != NULL)
        pthread_mutex_init(&memory->lock, NULL);
    return memory;
}

static void entry_free(Entry *entry) {
    refcount_unref(&entry->named->shared);
    free(entry);
}

void record_memory_free(RecordMemory *memory) {
    if (memory == NULL)
        return;
    for (Entry *entry; (entry = memory->first) != NULL;) {
        memory->first = entry->next;
        entry_free(entry);
    }
    pthread_mutex_destroy(&memory->lock);
    free(memory);
}

// With the lock held: a hold for the caller.
static NamedRecord *find(RecordMemory *memory, uint64_t catalog_version, const char *name,
                         const char *digest) {
    for (Entry **at = &memory->first; *at != NULL; at = &(*at)->next) {
        Entry *entry = *at;
        if (strcmp(entry->named->name, name) != 0)
            continue;
        if (digest == NULL ? entry->catalog_version != catalog_version
                           : strcmp(entry->named->digest, digest) != 0)
            continue;
        if (catalog_version > entry->catalog_version) // never back to what the catalogue was before
            entry->catalog_version = catalog_version;
        *at = entry->next;
        entry->next = memory->first;
        memory->first = entry;
        refcount_ref(&entry->named->shared);
        return entry->named;
    }
    return NULL;
}

NamedRecord *record_memory_find(RecordMemory *memory, uint64_t catalog_version, const char *name,
                                const char *digest) {
    pthread_mutex_lock(&memory->lock);
    NamedRecord *named = find(memory, catalog_version, name, digest);
    pthread_mutex_unlock(&memory->lock);
    return named;
}

// With the lock held.
static void forget(RecordMemory *memory) {
    size_t bytes = 0;
    for (Entry **at = &memory->first; *at != NULL;) {
        Entry *entry = *at;
        // Nobody can come to hold it meanwhile but through the lock.
        const bool is_ours = atomic_load(&entry->named->shared.count) == 1;
        bytes += entry->named->samples.count * sizeof(double);
        if (!is_ours || bytes <= bytes_max) {
            at = &entry->next;
            continue;
        }
        *at = entry->next;
        entry_free(entry);
    }
}

NamedRecord *record_memory_put(RecordMemory *memory, uint64_t catalog_version, NamedRecord *named) {
    Entry *entry = malloc(sizeof *entry);
    pthread_mutex_lock(&memory->lock);
    NamedRecord *known = find(memory, catalog_version, named->name, named->digest);
    if (known == NULL && entry != NULL) {
        *entry = (Entry){memory->first, named, catalog_version};
        refcount_ref(&named->shared);
        memory->first = entry;
        entry = NULL;
        forget(memory);
    }
    pthread_mutex_unlock(&memory->lock);
    free(entry);
    if (known == NULL)
        return named;
    refcount_unref(&named->shared);
    return known;
}
