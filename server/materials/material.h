// Materials as the rest of the server takes them: rows of the store with their lists read, and the
// JSON they are told in. Not the rows themselves (db/materials.h). Used by jobs/, which
// resolves names in scenes, and by api/.
#ifndef SERVER_MATERIALS_MATERIAL_H
#define SERVER_MATERIALS_MATERIAL_H

#include "server/db/materials.h"
#include "server/util/bytes.h"

// As db_material, with tags, table and measurements read. Cleared by material_revision_clear, in
// any case.
Status material_find(Db *db, const char *slug, uint64_t revision, MaterialRevision *found,
                     Problem *problem);

// Reads the lists of a row into its material; once.
Status material_read_lists(MaterialRevision *revision, Problem *problem);
// Sets revision->lists from its material. STATUS_NO_MEMORY.
Status material_write_lists(MaterialRevision *revision, Problem *problem);

// The revision as an object: what it says, whose it is, its review and links. Lists are read.
void material_write(Bytes *bytes, const MaterialRevision *revision);
// Of it slug, revision, status and what the revision says.
void material_write_stated(Bytes *bytes, const MaterialRevision *revision);

// A text and a time as members behind others: NULL and 0 are null.
void material_put_text(Bytes *bytes, const char *name, const char *text);
void material_put_time(Bytes *bytes, const char *name, int64_t unix_ms);

#endif
