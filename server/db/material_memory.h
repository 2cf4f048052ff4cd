// The cache of revisions in materials.c, which belongs to the database.
#ifndef SERVER_DB_MATERIAL_MEMORY_H
#define SERVER_DB_MATERIAL_MEMORY_H

typedef struct MaterialMemory MaterialMemory;
MaterialMemory *material_memory_new(void); // NULL without memory
void material_memory_free(MaterialMemory *memory);

#endif
