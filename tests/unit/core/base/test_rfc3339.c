// Dates against known ones, and what only looks like one.
#include "core/base/rfc3339.h"

#include "core/base/status.h"
#include "tests/support/test.h"

TEST(days_and_times_are_read_and_nonsense_is_not) {
    static const struct {
        const char *text;
        int64_t unix_ms;
    } right[] = {
        {"1970-01-01T00:00:00Z", 0},
        {"1970-01-01", 0},
        {"2026-11-21T09:00:00.123Z", 1795251600123},
        {"2026-11-21T10:00:00.1234567+01:00", 1795251600123},
        {"2026-11-21t10:00:00.123 01:00", 1795251600123}, // a "+" in a query
        {"2026-11-21T03:30:00.123-05:30", 1795251600123},
        {"2000-02-29", 951782400000},
        {"1969-12-31T23:59:59.999Z", -1},
    };
    for (size_t i = 0; i < COUNT(right); i++) {
        int64_t unix_ms = 7;
        assert_true(rfc3339_read(right[i].text, &unix_ms));
        assert_int_equal(unix_ms, right[i].unix_ms);
    }
    static const char *const wrong[] = {"",
                                        "2026",
                                        "2026-13-01",
                                        "2026-02-29",
                                        "2100-02-29",
                                        "2026-1-01",
                                        "2026-11-21T",
                                        "2026-11-21T09:00:00",
                                        "2026-11-21T24:00:00Z",
                                        "2026-11-21T09:60:00Z",
                                        "2026-11-21T09:00:00.Z",
                                        "2026-11-21T09:00:00Zx",
                                        "2026-11-21T09:00:00+25:00",
                                        "0000-01-01",
                                        "-2026-11-21"};
    for (size_t i = 0; i < COUNT(wrong); i++) {
        int64_t unix_ms;
        assert_false(rfc3339_read(wrong[i], &unix_ms));
    }
}
