#include "tests/support/scratch.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

void scratch_make(char target[SCRATCH_SIZE]) {
    snprintf(target, SCRATCH_SIZE, "/tmp/impactd-test-XXXXXX");
    assert_non_null(mkdtemp(target));
}

void scratch_remove(const char *folder) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    assert_int_equal(system(command), 0);
}
