#include <stdlib.h>
#include <string.h>

#include "core/base/report.h"
#include "tests/support/test.h"

TEST(warnings_are_added_with_their_own_texts) {
    Warnings warnings = {NULL, 0};
    char pointer[] = "/dampers/0/clearance";
    assert_int_equal(warnings_add(&warnings, pointer, "is %d m", 15), STATUS_OK);
    pointer[1] = 'x';
    assert_int_equal(warnings.count, 1);
    assert_string_equal(warnings.at[0].pointer, "/dampers/0/clearance");
    assert_string_equal(warnings.at[0].detail, "is 15 m");
    for (int i = 0; i < 1000; i++)
        assert_int_equal(warnings_add(&warnings, "", "%01000d", i), STATUS_OK);
    assert_int_equal(warnings.count, 256);
    for (size_t i = 0; i < warnings.count; i++)
        fields_clear(warning_fields, &warnings.at[i]);
    free(warnings.at);
    assert_int_equal(warnings_add(NULL, "", "no list"), STATUS_OK);
}
