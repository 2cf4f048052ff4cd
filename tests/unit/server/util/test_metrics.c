// Counters and histograms, and their text.
#include <string.h>

#include "core/base/status.h"
#include "server/util/metrics.h"
#include "tests/support/test.h"

TEST(a_histogram_counts_each_sample_under_its_edge) {
    Histogram histogram = {0};
    histogram_add(&histogram, 0);
    histogram_add(&histogram, 100000); // on the edge: within
    histogram_add(&histogram, 100001);
    histogram_add(&histogram, 59000000000);
    histogram_add(&histogram, 61000000000);
    histogram_add(&histogram, -5); // a clock may not go back, but a count must not be lost
    assert_int_equal(histogram_count(&histogram), 6);
    Bytes bytes = {0};
    metrics_histogram(&bytes, "x_seconds", "a=\"b\"", &histogram);
    assert_non_null(strstr(bytes.at, "x_seconds_bucket{a=\"b\",le=\"0.0001\"} 3\n"));
    assert_non_null(strstr(bytes.at, "x_seconds_bucket{a=\"b\",le=\"0.00025\"} 4\n"));
    assert_non_null(strstr(bytes.at, "x_seconds_bucket{a=\"b\",le=\"60\"} 5\n"));
    assert_non_null(strstr(bytes.at, "x_seconds_bucket{a=\"b\",le=\"+Inf\"} 6\n"));
    assert_non_null(strstr(bytes.at, "x_seconds_count{a=\"b\"} 6\n"));
    assert_non_null(strstr(bytes.at, "x_seconds_sum{a=\"b\"} 120.000"));
    bytes_clear(&bytes);
}
