// Addresses that a client accepts; exchanges are in contract/test_client.py.
#include <stdlib.h>

#include "server/cli/client.h"
#include "tests/support/test.h"

static Status opened(const char *url, const char *token, bool *exposes) {
    char address[100];
    snprintf(address, sizeof address, "%s", url);
    ApiCall call = {.settings = &(ClientSettings){.server = address}};
    if (token != NULL)
        setenv("IMPACTD_TOKEN", token, 1);
    else
        unsetenv("IMPACTD_TOKEN");
    const Status status = api_open(&call, NULL);
    *exposes = status == STATUS_OK && api_exposes_token(&call);
    api_close(&call);
    return status;
}

TEST(only_plain_http_addresses_are_taken) {
    bool exposes;
    static const char *const right[] = {"http://127.0.0.1:8080", "https://h.example/base/",
                                        "http://[::1]:1", "http://localhost"};
    static const char *const wrong[] = {
        "ftp://h",    "file:///etc/passwd", "gopher://h", "http://u:p@h",
        "http://u@h", "http://h?q",         "http://h#f", "http://h\r\nX: y",
        "http://h x", "http://h:99999",     "http://"};
    for (size_t i = 0; i < COUNT(right); i++)
        assert_int_equal(opened(right[i], NULL, &exposes), STATUS_OK);
    for (size_t i = 0; i < COUNT(wrong); i++)
        assert_int_equal(opened(wrong[i], NULL, &exposes), STATUS_USAGE);
}

TEST(a_token_is_exposed_by_plain_http_to_others) {
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
