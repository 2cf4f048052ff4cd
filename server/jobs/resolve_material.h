// The materials that a scene names become revisions and their numbers. Not the records that one
// names, nor the judging of either. Used by prepare.c and resolve.c.
#ifndef SERVER_JOBS_RESOLVE_MATERIAL_H
#define SERVER_JOBS_RESOLVE_MATERIAL_H

#include "core/simulation/simulation.h"
#include "server/db/db.h"

// Every buffer that names a material gets "slug@revision", its numbers and what is known of its
// test. Adds all faults; STATUS_INVALID where there are any.
Status resolve_materials(Db *db, Simulation *simulation, Warnings *warnings, Problem *problem);

// The same for one buffer, at `pointer`; one that names none stays as it is.
Status resolve_buffer(Db *db, Buffer *buffer, const char *pointer, Warnings *warnings,
                      Problem *problem);

#endif
