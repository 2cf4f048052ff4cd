// Materials as the rest of the server takes them: rows of the store with their lists read, and the
// JSON they are told in. Not the rows themselves (db/materials.h). Used by jobs/, which
// resolves names in scenes, and by api/.
#ifndef SERVER_MATERIALS_MATERIAL_H
#define SERVER_MATERIALS_MATERIAL_H

#include "server/db/materials.h"
#include "server/util/bytes.h"

// As store_material, with tags, table and measurements read. Cleared by material_revision_clear, in
// any case.
Status catalogue_find(Store *store, const char *slug, uint64_t revision, MaterialRevision *found,
                      Problem *problem);

// Reads the lists of a row into its material; once.
Status catalogue_read_lists(MaterialRevision *revision, Problem *problem);
// Sets revision->lists from its material. STATUS_NO_MEMORY.
Status catalogue_write_lists(MaterialRevision *revision, Problem *problem);

// The revision as an object: what it says, whose it is, its review and links. Lists are read.
void catalogue_write(Bytes *bytes, const MaterialRevision *revision);
// Of it slug, revision, status and what the revision says.
void catalogue_write_said(Bytes *bytes, const MaterialRevision *revision);

// A text and a time as members behind others: NULL and 0 are null.
void material_put_text(Bytes *bytes, const char *name, const char *text);
void material_put_time(Bytes *bytes, const char *name, int64_t unix_ms);

#endif
