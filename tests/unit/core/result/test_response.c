#include <stdlib.h>
#include <string.h>

#include "core/result/response.h"
#include "tests/support/test.h"

TEST(channels_and_their_names_are_in_one_order) {
    for (size_t i = 0; i < CHANNEL_COUNT; i++) {
        assert_string_equal(channels[i].name, channel_requests[i + 1]);
        assert_true(channels[i].unit != NULL && channels[i].psd_unit != NULL);
    }
    assert_null(channel_requests[CHANNEL_COUNT + 1]);
    assert_string_equal(channels[CHANNEL_MEAN_ACCELERATION].psd_unit, "(m/s^2)^2/Hz");
    assert_int_equal(channels[CHANNEL_CONTACT_FORCE].owner, CHANNEL_OF_DAMPER);
}

// The order of the contract, which CSV and JSON keep.
TEST(an_impact_has_these_rows) {
    static const char *const names[] = {"kind",
                                        "start",
                                        "end",
                                        "damper",
                                        "side",
                                        "approach_speed",
                                        "separation_speed",
                                        "restitution",
                                        "duration",
                                        "peak_force",
                                        "impulse",
                                        "energy_lost"};
    for (size_t i = 0; i < COUNT(names); i++)
        assert_string_equal(impact_fields[i].name, names[i]);
    assert_int_equal(impact_fields[COUNT(names)].kind, FIELD_KIND_END);
}

TEST(a_response_is_cleared_whole) {
    Response response;
    memset(&response, 0, sizeof response);
    response_clear(&response);
    assert_int_equal(columns_allocate(&response.series, 2, 3, 0, NULL), STATUS_OK);
    response.impacts.at = calloc(4, sizeof(Impact));
    response.impacts.count = 4;
    response_clear(&response);
    assert_null(response.impacts.at);
    assert_null(response.series.block);
    response_clear(NULL);
}
