// Upper and lower case as one.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/status.h"
#include "server/util/utf8_fold.h"

static void upper_and_lower_case_of_any_script_are_one(void **state) {
    (void)state;
    static const char *const cases[][2] = {
        {"", ""},
        {"Sponge 7", "sponge 7"},
        {"ÄRMEL É", "ärmel é"},
        {"ΣΚΛΗΡΟ", "σκληρο"},
        {"ЖЁ", "жё"},
        {"Ⱥ", "ⱥ"}, // grows by a byte
        {"漢字 😀", "漢字 😀"},
        {"a\nb\tc\x7f", "a b c "},
        {"%_*?", "%_*?"},
        {"\xff\xc3(\xe2\x82", "\xff\xc3(\xe2\x82"}, // no UTF-8
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Bytes bytes = {0};
        bytes_text(&bytes, "|");
        utf8_fold(&bytes, cases[i][0]);
        assert_string_equal(bytes.at + 1, cases[i][1]);
        bytes_clear(&bytes);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(upper_and_lower_case_of_any_script_are_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
