// Quantities with units.
#include "core/base/status.h"
#include "server/util/units.h"
#include "tests/support/test.h"

#include <string.h>

static char reason[QUANTITY_REASON];

// The value of a text that is accepted.
static double read_in(const char *unit, const char *text) {
    double value = -1;
    if (!quantity_read(text, unit, &value, reason))
        fail_msg("%s: %s", text, reason);
    return value;
}

TEST(a_quantity_is_the_same_double_as_its_digits_in_si) {
    assert_true(read_in("m", "35mm") == 0.035);
    assert_true(read_in("m", "2.3 mm") == 0.0023);
    assert_true(read_in("m", "-1e1cm") == -0.1);
    assert_true(read_in("m", "0.5") == 0.5);
    assert_true(read_in("kg", "1350g") == 1.35);
    assert_true(read_in("kg", "0.11 t") == 110);
    assert_true(read_in("s", "300us") == 0.0003);
    assert_true(read_in("s", "300\xC2\xB5s") == 0.0003 && read_in("m", "15\xCE\xBCm") == 15e-6);
    assert_true(read_in("s", "2min") == 120);
    assert_true(read_in("Hz", "1.5kHz") == 1500);
    assert_true(read_in("N/m", "12N/mm") == 12000);
    assert_true(read_in("N/m", "0.865 kN/m") == 865);
    assert_true(read_in("N s/m", "1.092 N*s/m") == 1.092);
    assert_true(read_in(NULL, "5%") == 0.05);
    assert_true(read_in("samples", "4096") == 4096);
}

TEST(g_is_a_gram_or_the_standard_gravity_by_the_row) {
    assert_true(read_in("kg", "2g") == 0.002);
    assert_true(read_in("m/s^2", "2g") == 2 * 9.80665);
    assert_true(read_in("m/s^2", "2gn") == 2 * 9.80665);
    assert_true(read_in("m/s^2", "981 cm/s^2") == 9.81);
}

TEST(a_wrong_unit_is_explained_by_its_dimension) {
    static const struct {
        const char *unit, *text, *reason;
    } rows[] = {
        {"m", "10kg", "is a length in m, 10kg is a mass; write 10mm"},
        {"kg", "2 mm", "is a mass in kg, 2 mm is a length; write 2g"},
        {NULL, "2 mm", "has no unit, 2 mm is a length; write 2"},
        {"m", "5%", "is a length in m, 5% is a ratio; write 5mm"},
        {"samples", "5s", "is a number in samples, 5s is a time; write 5samples"},
        {"m", "10 miles", "is a length in m, \"miles\" is not a unit; write mm, cm, um, m"},
        {"m", "ten", "must be a number [m], is ten"},
        {NULL, "", "must be a number, is "},
        {"s", "inf", "must be a number [s], is inf"},
        {"s", "0x10", "is a time in s, \"x10\" is not a unit; write ms, us, s, min"},
        {"s", "1e999", "must be a number [s], is 1e999"},
        {"s", "1-2", "must be a number [s], is 1-2"},
    };
    for (size_t i = 0; i < COUNT(rows); i++) {
        double value;
        assert_false(quantity_read(rows[i].text, rows[i].unit, &value, reason));
        assert_string_equal(reason, rows[i].reason);
    }
}
