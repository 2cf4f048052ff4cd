#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/jobs/documents.h"
#include "server/json/encode.h"

enum { MANY = 1 << 17 };

static bool stop_at_third(void *context, double fraction) {
    (void)fraction;
    return ++*(int *)context < 3;
}

static void impacts_are_written_as_one_list(void **state) {
    (void)state;
    Response response = {.impacts = {.at = test_calloc(MANY, sizeof(Impact)), .count = MANY}};
    Bytes whole = {0}, list = {0};
    assert_true(document_impacts(&whole, &response, NULL));
    encode_list(&list, impact_fields, response.impacts.at, MANY, sizeof(Impact), WRITE_REPORT);
    assert_true(whole.count > list.count + 1);
    assert_string_equal(whole.at + whole.count - list.count - 1 + list.count, "}");
    assert_memory_equal(whole.at + whole.count - list.count - 1, list.at, list.count);
    bytes_clear(&whole);
    bytes_clear(&list);
    test_free(response.impacts.at);
}

// A cancelled job writes no more of its documents.
static void long_documents_stop_soon_when_they_are_told_to(void **state) {
    (void)state;
    Response response = {.impacts = {.at = test_calloc(MANY, sizeof(Impact)), .count = MANY}};
    double *values = test_calloc(2 * MANY, sizeof *values);
    Column column = {.name = "displacement", .unit = "m^2/Hz", .values = values};
    const Spectrum spectrum = {.frequency = values,
                               .densities = {.at = &column, .count = 1, .rows = 2 * MANY}};
    Bytes bytes = {0};
    int looks = 0;
    const Progress watch = {&looks, stop_at_third};
    assert_false(document_impacts(&bytes, &response, &watch));
    assert_int_equal(looks, 3);
    looks = 0;
    assert_false(document_psd(&bytes, &spectrum, &watch));
    assert_int_equal(looks, 3);
    bytes_clear(&bytes);
    assert_true(document_psd(&bytes, &spectrum, NULL));
    size_t commas = 0;
    for (const char *c = strstr(bytes.at, "\"frequency\""); *c != '\0'; c++)
        commas += *c == '0' && c[1] == ',';
    assert_int_equal(commas, 2 * (2 * MANY - 1)); // of both lists, over the parts they are made by
    assert_null(strstr(bytes.at, ",,"));
    bytes_clear(&bytes);
    test_free(values);
    test_free(response.impacts.at);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(impacts_are_written_as_one_list),
        cmocka_unit_test(long_documents_stop_soon_when_they_are_told_to),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
