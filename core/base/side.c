// Names in the order of Side.
#include "core/base/side.h"

#include <stddef.h>

const char *const side_names[] = {[SIDE_LEFT] = "left", [SIDE_RIGHT] = "right", NULL};
