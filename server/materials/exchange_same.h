// Whether two revisions say the same of a material. Not whose they are and when they were written
// (db/material_import.c). Used by exchange_import.c.
#ifndef SERVER_MATERIALS_EXCHANGE_SAME_H
#define SERVER_MATERIALS_EXCHANGE_SAME_H

#include "server/db/materials.h"

// What `ours` says otherwise than `there` is told below `place`, member by member; `problem` NULL:
// nothing is told. Lists are compared as they are stored.
bool exchange_says_same(const MaterialRevision *ours, const MaterialRevision *there,
                        const char *place, Problem *problem);

#endif
