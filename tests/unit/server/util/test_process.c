// What others send stays within its quotes on its line.
#include <string.h>

#include "server/util/process.h"
#include "tests/support/test.h"

static void expect(const char *text, size_t most, const char *wanted) {
    Bytes line = {0};
    log_put(&line, "a", text, most);
    assert_string_equal(line.at != NULL ? line.at : "", wanted);
    bytes_clear(&line);
}

TEST(texts_of_others_are_escaped_and_cut) {
    expect("plain /v1", 20, " a=\"plain /v1\"");
    expect("\x1b[2J\r\nx", 20, " a=\"\\x1b[2J\\x0d\\x0ax\"");
    expect("\" b=\"\\", 20, " a=\"\\x22 b=\\x22\\x5c\"");
    expect("\xc3\xa9\x7f", 20, " a=\"\\xc3\\xa9\\x7f\"");
    expect("0123456789", 10, " a=\"0123456789\"");
    expect("0123456789x", 10, " a=\"0123456789...\"");
    expect("", 10, " a=\"\"");
    expect(NULL, 10, "");
}
