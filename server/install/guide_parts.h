// Parts of the guide in Markdown, printed from the tables of the program, and the texts on a member
// that manual pages have as well.
#ifndef SERVER_INSTALL_GUIDE_PARTS_H
#define SERVER_INSTALL_GUIDE_PARTS_H

#include <stdio.h>

#include "core/base/field.h"
#include "server/util/bytes.h"

// "number [kg], above 0"
void nature_write(const Field *row, Bytes *bytes);
// "required", "0"; "" where there is no default.
void default_write(const Field *row, Bytes *bytes);

void part_commands(FILE *file); // each command with its options
void part_scene(FILE *file);    // the members of a scene, place by place
void part_paths(FILE *file);    // all calls of the API with their scopes

#endif
