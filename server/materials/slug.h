// Whether a new material may be called so. Not whether there is one (db/materials.h). Used
// by whoever adds materials.
#ifndef SERVER_MATERIALS_SLUG_H
#define SERVER_MATERIALS_SLUG_H

#include "core/base/status.h"

// STATUS_INVALID, told at `pointer`: other characters, too many of them, or a word that is an
// address of another thing.
Status slug_check(const char *slug, const char *pointer, Problem *problem);

#endif
