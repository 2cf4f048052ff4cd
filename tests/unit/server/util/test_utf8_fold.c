// Upper and lower case as one.

#include "core/base/status.h"
#include "server/util/bytes.h"
#include "tests/support/test.h"

TEST(upper_and_lower_case_of_any_script_are_one) {
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
        bytes_folded(&bytes, cases[i][0]);
        assert_string_equal(bytes.at + 1, cases[i][1]);
        bytes_clear(&bytes);
    }
}
