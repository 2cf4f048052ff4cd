// Which addresses are spoken to, and how texts travel in them; exchanges are in
// contract/test_client.py.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/cli/http.h"

static Status opened(const char *url, const char *token, bool *exposes) {
    const HttpServer server = {.url = url, .token = token};
    Http *http = NULL;
    const Status status = http_open(&server, &http, NULL);
    *exposes = http != NULL && http_exposes_token(http);
    assert_int_equal(http != NULL, status == STATUS_OK);
    http_close(http);
    return status;
}

static void only_plain_http_addresses_are_taken(void **state) {
    (void)state;
    bool exposes;
    static const char *const right[] = {"http://127.0.0.1:8080", "https://h.example/base/",
                                        "http://[::1]:1", "http://localhost"};
    static const char *const wrong[] = {"",           "ftp://h",        "file:///etc/passwd",
                                        "gopher://h", "http://u:p@h",   "http://u@h",
                                        "http://h?q", "http://h#f",     "http://h\r\nX: y",
                                        "http://h x", "http://h:99999", "http://"};
    for (size_t i = 0; i < COUNT(right); i++)
        assert_int_equal(opened(right[i], NULL, &exposes), STATUS_OK);
    for (size_t i = 0; i < COUNT(wrong); i++)
        assert_int_equal(opened(wrong[i], NULL, &exposes), STATUS_USAGE);
}

static void a_token_is_exposed_by_plain_http_to_others(void **state) {
    (void)state;
    static const struct {
        const char *url, *token;
        bool exposes;
    } rows[] = {{"http://h.example", "t", true},      {"http://h.example", NULL, false},
                {"https://h.example", "t", false},    {"http://127.0.0.1:1", "t", false},
                {"http://localhost:1", "t", false},   {"http://[::1]:1", "t", false},
                {"http://127.example.org", "t", true}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        bool exposes;
        assert_int_equal(opened(rows[i].url, rows[i].token, &exposes), STATUS_OK);
        assert_int_equal(exposes, rows[i].exposes);
    }
}

static void texts_are_percent_encoded(void **state) {
    (void)state;
    Bytes bytes = {0};
    http_encode(&bytes, "displacement_2,a b&c=%\n\xc3\xa4");
    assert_string_equal(bytes.at, "displacement_2,a%20b%26c%3D%25%0A%C3%A4");
    bytes_clear(&bytes);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_plain_http_addresses_are_taken),
        cmocka_unit_test(a_token_is_exposed_by_plain_http_to_others),
        cmocka_unit_test(texts_are_percent_encoded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
