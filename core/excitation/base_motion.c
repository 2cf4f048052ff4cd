#include "core/excitation/base_motion.h"

#include <stdlib.h>
#include <string.h>

void base_clear(Base *base) {
    if (base == NULL)
        return;
    free(base->values);
    memset(base, 0, sizeof *base);
}
