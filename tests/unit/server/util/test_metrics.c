// Counters and histograms, and their text.
#include <pthread.h>
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

TEST(families_are_written_as_prometheus_reads_them) {
    Bytes bytes = {0};
    metrics_counter(&bytes, "a_total", "Counted.", UINT64_C(18446744073709551615));
    metrics_gauge(&bytes, "b", "Now.", 0.1);
    assert_string_equal(bytes.at, "# HELP a_total Counted.\n# TYPE a_total counter\n"
                                  "a_total 18446744073709551615\n"
                                  "# HELP b Now.\n# TYPE b gauge\nb 0.1\n");
    bytes_clear(&bytes);
}

static void *count(void *context) {
    for (int i = 0; i < 100000; i++)
        counter_add(context, 1);
    return NULL;
}

TEST(threads_lose_no_count) {
    Counter counter = 0;
    pthread_t threads[4];
    for (size_t i = 0; i < COUNT(threads); i++)
        assert_int_equal(pthread_create(&threads[i], NULL, count, &counter), 0);
    for (size_t i = 0; i < COUNT(threads); i++)
        pthread_join(threads[i], NULL);
    assert_int_equal(counter_get(&counter), 400000);
}
