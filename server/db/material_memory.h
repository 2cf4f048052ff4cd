// Materials that scenes named of late, as long as the catalogue stays as it is: every scene names
// some, mostly the same. Not what is unknown. Locked. Used by store.c and material_rows.c.
#ifndef SERVER_DB_MATERIAL_MEMORY_H
#define SERVER_DB_MATERIAL_MEMORY_H

#include "server/db/materials.h"

typedef struct MaterialMemory MaterialMemory;

MaterialMemory *material_memory_new(void); // NULL without memory
void material_memory_free(MaterialMemory *memory);

// A copy of what was put under that generation of the catalogue. `material` is all zero before.
bool material_memory_find(MaterialMemory *memory, uint64_t catalog_version, const char *slug,
                          uint64_t revision, MaterialRevision *material);
// Puts a copy; `generation` is what it was before the material was read.
void material_memory_put(MaterialMemory *memory, uint64_t catalog_version, uint64_t revision,
                         const MaterialRevision *material);

#endif
