// Stored numbers come back bit for bit, and what was cut or changed does not come back at all.
#include "server/jobs/jobs_private.h"
#include "tests/support/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static Outcome *sample(void) {
    Outcome *outcome = outcome_new();
    assert_non_null(outcome);
    Response *response = &outcome->response;
    response->sample_rate = 1000;
    response->count = 5;
    response->impact_count = 2;
    response->energy.residual = 1e-14;
    response->impacts.at = calloc(2, sizeof *response->impacts.at);
    assert_non_null(response->impacts.at);
    response->impacts.count = 2;
    response->impacts.at[1] = (Impact){.start = 0.1, .end = (double)NAN, .damper = 3, .side = 1};
    assert_int_equal(columns_allocate(&response->series, 2, 5, 0, NULL), STATUS_OK);
    columns_name(&response->series, 0, "displacement", "m");
    columns_name(&response->series, 1, "contact_force", "N");
    for (size_t i = 0; i < 10; i++)
        response->series.block[i] = 1.0 / (double)(i + 1);
    Spectrum *spectrum = &outcome->spectrum;
    spectrum->settings.segment = 4;
    spectrum->frequency = calloc(3, sizeof(double));
    assert_non_null(spectrum->frequency);
    spectrum->frequency[2] = 500;
    assert_int_equal(columns_allocate(&spectrum->densities, 1, 3, 0, NULL), STATUS_OK);
    columns_name(&spectrum->densities, 0, "mean_acceleration", "(m/s^2)^2/Hz");
    for (size_t i = 0; i < 3; i++)
        spectrum->densities.block[i] = (double)i;
    return outcome;
}

TEST(an_outcomes_numbers_come_back) {
    Outcome *outcome = sample();
    Bytes bytes = {.most = 1 << 20}, series = {.most = 1 << 20}, again = {.most = 1 << 20};
    outcome->summary.impacts = 2;
    outcome->summary.trust_horizon = (double)NAN;
    outcome_blob_write(&bytes, outcome);
    Outcome *read = outcome_blob_read(bytes.at, bytes.count);
    assert_non_null(read);
    assert_int_equal(read->response.count, 5);
    assert_int_equal(read->response.series.count, 0);
    assert_int_equal(read->response.impacts.at[1].damper, 3);
    assert_int_equal(read->response.impacts.at[1].side, 1);
    assert_true(isnan(read->response.impacts.at[1].end));
    assert_true(read->response.energy.residual == 1e-14);
    assert_int_equal(read->summary.impacts, 2);
    assert_true(isnan(read->summary.trust_horizon));
    assert_true(read->spectrum.frequency[2] == 500);
    outcome_blob_write(&again, read);
    assert_int_equal(bytes.count, again.count);
    assert_memory_equal(bytes.at, again.at, bytes.count);

    series_blob_write(&series, &outcome->response.series);
    assert_true(series_blob_read(series.at, series.count, &read->response.series));
    assert_string_equal(read->response.series.at[1].name, "contact_force");
    assert_string_equal(read->response.series.at[1].unit, "N");
    assert_memory_equal(read->response.series.block, outcome->response.series.block,
                        10 * sizeof(double));
    bytes_clear(&bytes);
    bytes_clear(&series);
    bytes_clear(&again);
    outcome_unref(outcome);
    outcome_unref(read);
}

TEST(what_is_cut_or_has_wild_counts_is_not_read) {
    enum { IMPACTS = 32, RECORD_BYTES = 6 }; // places in the head
    Outcome *outcome = sample();
    Columns columns;
    Bytes bytes = {.most = 1 << 20}, series = {.most = 1 << 20};
    outcome_blob_write(&bytes, outcome);
    series_blob_write(&series, &outcome->response.series);
    for (size_t size = 0; size < bytes.count; size++)
        assert_null(outcome_blob_read(bytes.at, size));
    for (size_t size = 0; size < series.count; size++)
        assert_false(series_blob_read(series.at, size, &columns));
    const uint64_t wild[] = {UINT64_MAX, UINT64_MAX / 8, 1ULL << 61, 4000000000, 1};
    const Columns *densities = &outcome->spectrum.densities;
    const size_t tail =
        (densities->rows * (1 + densities->count) + 2) * sizeof(double) +
        densities->count * (sizeof densities->at->name + sizeof densities->at->unit);
    const size_t places[] = {IMPACTS, bytes.count - tail - sizeof(uint64_t), RECORD_BYTES};
    for (size_t i = 0; i < COUNT(places); i++)
        for (size_t k = 0; k < COUNT(wild); k++) {
            uint64_t before;
            memcpy(&before, bytes.at + places[i], sizeof before);
            memcpy(bytes.at + places[i], &wild[k], sizeof before);
            assert_null(outcome_blob_read(bytes.at, bytes.count));
            memcpy(bytes.at + places[i], &before, sizeof before);
        }
    for (size_t i = 0; i < 2; i++)
        for (size_t k = 0; k < COUNT(wild); k++) {
            uint64_t before;
            memcpy(&before, series.at + i * sizeof before, sizeof before);
            memcpy(series.at + i * sizeof before, &wild[k], sizeof before);
            assert_false(series_blob_read(series.at, series.count, &columns));
            memcpy(series.at + i * sizeof before, &before, sizeof before);
        }
    Outcome *read = outcome_blob_read(bytes.at, bytes.count);
    assert_non_null(read);
    outcome_unref(read);
    bytes.at[0] = 'x';
    assert_null(outcome_blob_read(bytes.at, bytes.count));
    bytes_clear(&bytes);
    bytes_clear(&series);
    outcome_unref(outcome);
}
