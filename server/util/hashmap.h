// Things found by a text: a hash table whose entries live inside the things. Not locked, owns
// nothing. Used by cache.c and intake.c.
#ifndef SERVER_UTIL_HASHMAP_H
#define SERVER_UTIL_HASHMAP_H

#include <stddef.h>

typedef struct Index Index;

// First member of what is indexed.
typedef struct IndexEntry {
    struct IndexEntry *next;
    const char *key; // lives as long as the thing is in the index
} IndexEntry;

Index *index_new(void); // NULL without memory
void index_free(Index *index);
void index_add(Index *index, IndexEntry *entry);
void index_remove(Index *index, IndexEntry *entry);    // fine if it is not there
void *index_any(const Index *index);                   // any thing of it, or NULL where it is empty
void *index_find(const Index *index, const char *key); // the thing, or NULL

#endif
