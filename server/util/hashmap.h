// Things found by a text: a hash table whose entries live inside the things. Not locked, owns
// nothing. Used by cache.c and intake.c.
#ifndef SERVER_UTIL_HASHMAP_H
#define SERVER_UTIL_HASHMAP_H

#include <stddef.h>

typedef struct HashMap HashMap;

// First member of what is indexed.
typedef struct HashMapEntry {
    struct HashMapEntry *next;
    const char *key; // lives as long as the thing is in the index
} HashMapEntry;

HashMap *hashmap_new(void); // NULL without memory
void hashmap_free(HashMap *index);
void hashmap_add(HashMap *index, HashMapEntry *entry);
void hashmap_remove(HashMap *index, HashMapEntry *entry); // fine if it is not there
void *hashmap_any(const HashMap *index); // any thing of it, or NULL where it is empty
void *hashmap_find(const HashMap *index, const char *key); // the thing, or NULL

#endif
