// The digits of dtoa_write: their form, and that they read back to the same bits.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <float.h>
#include <math.h>

#include "core/base/status.h"
#include "server/util/dtoa.h"
#include "tests/support/test.h"

enum { PATTERNS = IMPACTD_SANITIZED ? 300000 : 10000000 };

static const char *written(double value) {
    static char text[SHORTEST_SIZE + 1];
    memset(text, '#', sizeof text);
    const size_t length = dtoa_write(text, value);
    assert_in_range(length, 1, SHORTEST_SIZE);
    text[length] = '\0';
    return text;
}

TEST(numbers_are_written_as_people_would) {
    static const struct {
        double value;
        const char *text;
    } cases[] = {
        {0, "0"},
        {-0.0, "-0.0"},
        {1, "1"},
        {-0.5, "-0.5"},
        {0.015, "0.015"},
        {10001, "10001"},
        {865, "865"},
        {1.35, "1.35"},
        {-59.999, "-59.999"},
        {12345678.9, "12345678.9"},
        {-123456789.01234567, "-123456789.01234567"},
        {-1234567890123456.5, "-1234567890123456.5"},
        {300, "300"},
        {0.1 + 0.2, "0.30000000000000004"},
        {1e-5, "0.00001"},
        {1.25e-5, "0.0000125"},
        {9.9e-6, "9.9e-6"},
        {1e-9, "1e-9"},
        {1.5e-7, "1.5e-7"},
        {-1.5e-7, "-1.5e-7"},
        {1e16, "10000000000000000"},
        {12345678901234567e0, "12345678901234568"},
        {1e17, "1e+17"},
        {1.5e22, "1.5e+22"},
        {9007199254740993.0, "9007199254740992"},
        {DBL_MAX, "1.7976931348623157e+308"},
        {-DBL_MIN, "-2.2250738585072014e-308"},
        {4.9406564584124654e-324, "5e-324"},
    };
    for (size_t i = 0; i < COUNT(cases); i++)
        assert_string_equal(written(cases[i].value), cases[i].text);
}

TEST(a_list_is_its_numbers_with_commas_between) {
    static const double values[] = {0.25, (double)NAN, -0.0, 1e-9, -(double)INFINITY, 60};
    char text[COUNT(values) * (SHORTEST_SIZE + 1)];
    size_t length = dtoa_list(text, values, COUNT(values));
    text[length] = '\0';
    assert_string_equal(text, "0.25,null,-0.0,1e-9,null,60");
    length = dtoa_list(text, values, 1);
    text[length] = '\0';
    assert_string_equal(text, "0.25");
    assert_int_equal(dtoa_list(text, values, 0), 0);
}

// JSON's number: -?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]+)?
static const char *skip_digits(const char *at) {
    while (*at >= '0' && *at <= '9')
        at++;
    return at;
}

static int is_json_number(const char *at) {
    at += *at == '-';
    const char *end = skip_digits(at);
    if (end == at || (*at == '0' && end != at + 1))
        return 0;
    at = end;
    if (*at == '.') {
        end = skip_digits(at + 1);
        if (end == at + 1)
            return 0;
        at = end;
    }
    if (*at == 'e') {
        at += at[1] == '+' || at[1] == '-' ? 2 : 1;
        end = skip_digits(at);
        if (end == at)
            return 0;
        at = end;
    }
    return *at == '\0';
}

static uint64_t bits_of(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static void check_round_trip(double value) {
    const char *text = written(value);
    if (!is_json_number(text) || bits_of(strtod(text, NULL)) != bits_of(value))
        fail_msg("%a is written as %s", value, text);
}

TEST(any_bits_read_back_to_the_same_bits) {
    uint64_t seed = 0x9E3779B97F4A7C15u;
    for (size_t i = 0; i < PATTERNS; i++) {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        double value;
        memcpy(&value, &seed, sizeof value);
        if (isfinite(value))
            check_round_trip(value);
    }
}

TEST(powers_and_their_neighbours_read_back) {
    for (int e = -1074; e <= 1023; e++) {
        const double value = ldexp(1, e);
        check_round_trip(value);
        check_round_trip(nextafter(value, 0));
        check_round_trip(nextafter(value, 2 * value));
    }
    for (int e = -323; e <= 308; e++) {
        char text[16];
        snprintf(text, sizeof text, "1e%d", e);
        const double value = strtod(text, NULL);
        check_round_trip(value);
        check_round_trip(-nextafter(value, INFINITY));
        check_round_trip(nextafter(value, 0));
    }
    for (int i = 0; i < 100000; i++) {
        check_round_trip(i);
        check_round_trip(i / 1000.0);
    }
}
