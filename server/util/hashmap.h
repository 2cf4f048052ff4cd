// A hash table of entries that live inside the caller's structs, found by a text. It is not locked
// and owns no entry.
#ifndef SERVER_UTIL_HASHMAP_H
#define SERVER_UTIL_HASHMAP_H

#include <stddef.h>

typedef struct HashMap HashMap;

// The first member of an indexed struct.
typedef struct HashMapEntry {
    struct HashMapEntry *next;
    const char *key; // lives as long as the entry is in the map
} HashMapEntry;

HashMap *hashmap_new(void); // NULL without memory
void hashmap_free(HashMap *map);
// Never fails: without memory to grow, look-ups become slower.
void hashmap_add(HashMap *map, HashMapEntry *entry);
void hashmap_remove(HashMap *map, HashMapEntry *entry);  // an entry that is absent is no error
void *hashmap_any(const HashMap *map);                   // any entry; NULL if the map is empty
void *hashmap_find(const HashMap *map, const char *key); // NULL if absent

#endif
