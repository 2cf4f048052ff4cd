// What a drop test may say, and what is said of one that contradicts itself.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/identification.h"
#include "server/util/bytes.h"
#include "tests/support/drops.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static Problem problem;
static DropTest test;

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static void accept(const char *text) {
    const Status status = drops_read(text, &test, &problem);
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        print_error("%s: %s\n", problem.faults[i].pointer, problem.faults[i].detail);
    assert_int_equal(status, STATUS_OK);
    assert_int_equal(problem.count, 0);
}

// Exactly this one fault.
static void refuse(const char *text, const char *pointer, const char *says) {
    assert_int_equal(drops_read(text, &test, &problem), STATUS_INVALID);
    fields_clear(drop_test_fields, &test);
    const char *detail = detail_at(&problem, pointer);
    if (problem.count != 1 || strstr(detail, says) == NULL)
        fail_msg("%s: %zu faults, at %s: %s (first at %s: %s)", text, problem.count, pointer,
                 detail, problem.faults[0].pointer, problem.faults[0].detail);
}

TEST(heights_and_speeds_tell_how_fast) {
    accept("{\"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.025}, "
           "{\"approach_speed\": 2, \"rebound_speed\": 1, \"contact_time\": 1e-3}]}");
    assert_near(drop_approach_speed(&test.drops.at[0]), sqrt(2 * 9.80665 * 0.1), 1e-15);
    assert_near(drop_rebound_speed(&test, &test.drops.at[0]), sqrt(2 * 9.80665 * 0.025), 1e-15);
    assert_near(drop_approach_speed(&test.drops.at[1]), 2, 0);
    assert_near(drop_rebound_speed(&test, &test.drops.at[1]), 1, 0);
    fields_clear(drop_test_fields, &test);
}

// m v = M w - m u: with e the bodies part at e v.
TEST(a_free_base_takes_part_of_the_rebound) {
    accept("{\"impactor_mass\": 0.1, \"base\": \"free\", \"base_mass\": 0.9, "
           "\"drops\": [{\"approach_speed\": 2, \"rebound_height\": 0.01}]}");
    const double rise = sqrt(2 * 9.80665 * 0.01), base = (0.1 * 2 + 0.1 * rise) / 0.9;
    assert_near(drop_rebound_speed(&test, &test.drops.at[0]), rise + base, 1e-15);
    assert_near(drop_test_effective_mass(&test), contact_effective_mass(0.1, 0.9), 0);
    test.base = 0;
    assert_near(drop_test_effective_mass(&test), 0.1, 0);
    test.base = CHOICE_ABSENT;
    assert_true(isnan(drop_test_effective_mass(&test)));
    fields_clear(drop_test_fields, &test);
    refuse("{\"base\": \"free\", \"drops\": [{\"drop_height\": 1, \"rebound_height\": 0.01}]}",
           "/drops/0/rebound_height", "needs impactor_mass and base_mass");
}

TEST(what_says_nothing_is_refused) {
    refuse("{}", "/drops", "at least one drop");
    refuse("{\"drops\": [], \"traces\": []}", "/drops", "at least one drop");
    refuse("{\"drops\": [{}]}", "/drops/0", "must have a rebound");
    refuse("{\"drops\": [{\"drop_height\": 1}]}", "/drops/0", "must have a rebound");
    refuse("{\"drops\": [{\"rebound_height\": 1}]}", "/drops/0/drop_height", "with a rebound");
    refuse("{\"drops\": [{\"rebound_speed\": 1}]}", "/drops/0/approach_speed", "with a rebound");
    refuse("{\"traces\": [{\"interval\": 1e-4}]}", "/traces/0/force", "at least one");
}

TEST(a_rebound_above_the_drop_is_refused) {
    refuse("{\"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.05}, "
           "{\"drop_height\": 0.1, \"rebound_height\": 0.1000001}]}",
           "/drops/1/rebound_height", "at most the drop_height of 0.1 m");
    refuse("{\"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 1.5}]}",
           "/drops/0/rebound_speed", "at most the speed of approach");
    refuse("{\"drops\": [{\"approach_speed\": 1, \"rebound_height\": 1}]}",
           "/drops/0/rebound_height", "at most the speed of approach");
    accept("{\"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.1}, "
           "{\"drop_height\": 0.1, \"rebound_height\": 0}]}");
    fields_clear(drop_test_fields, &test);
    // Kept all the same, where it does not count: that may be why.
    accept("{\"drops\": [{\"drop_height\": 0.1, \"rebound_height\": 0.4, "
           "\"excluded\": \"struck the edge\"}]}");
    fields_clear(drop_test_fields, &test);
}

TEST(heights_and_speeds_must_agree) {
    refuse("{\"drops\": [{\"drop_height\": 0.1, \"approach_speed\": 3, \"contact_time\": 1e-3}]}",
           "/drops/0/approach_speed", "within 20 % of the 1.4 m/s");
    refuse(
        "{\"drops\": [{\"drop_height\": 0.1, \"rebound_speed\": 0.2, \"rebound_height\": 0.05}]}",
        "/drops/0/rebound_speed", "within 20 %");
    accept("{\"drops\": [{\"drop_height\": 0.1, \"approach_speed\": 1.35, \"contact_time\": 1}]}");
    fields_clear(drop_test_fields, &test);
}

TEST(numbers_out_of_range_are_told_one_by_one) {
    refuse("{\"drops\": [{\"drop_height\": 0, \"rebound_height\": 0}]}", "/drops/0/drop_height",
           "above 0 m");
    refuse("{\"drops\": [{\"drop_height\": -1, \"rebound_height\": 0.1}]}", "/drops/0/drop_height",
           "above 0 m");
    refuse("{\"drops\": [{\"contact_time\": 0}]}", "/drops/0/contact_time", "above 0 s");
    refuse("{\"impactor_mass\": 0, \"drops\": [{\"contact_time\": 1}]}", "/impactor_mass",
           "above 0 kg");
    refuse("{\"temperature\": -300, \"drops\": [{\"contact_time\": 1}]}", "/temperature",
           "-273.15");
    refuse("{\"gravity\": -9.81, \"drops\": [{\"contact_time\": 1}]}", "/gravity", "[0, 1000]");
    refuse("{\"traces\": [{\"interval\": 0, \"force\": [1]}]}", "/traces/0/interval", "[1e-09, 1]");
    refuse("{\"base_mass\": 2, \"drops\": [{\"contact_time\": 1}]}", "/base_mass",
           "\"base\": \"free\"");
    refuse("{\"base\": \"fixed\", \"base_mass\": 2, \"drops\": [{\"contact_time\": 1}]}",
           "/base_mass", "does not move");
    refuse("{\"base\": \"fix\", \"drops\": [{\"contact_time\": 1}]}", "/base",
           "one of fixed, free");
    refuse("{\"drops\": [{\"hight\": 1, \"contact_time\": 1}]}", "/drops/0/hight", "unknown");
}

TEST(a_date_is_one_of_the_calendar) {
    static const char *const good[] = {"2026-11-21", "2024-02-29", "2026-11-21T09:30:00Z",
                                       "2026-11-21T09:30:00.25+01:00", "2000-02-29"};
    static const char *const bad[] = {"2026-13-01",
                                      "2026-02-29",
                                      "1900-02-29",
                                      "21.11.2026",
                                      "2026-11-21T25:00:00Z",
                                      "2026-11-21T09:30",
                                      "2026-11-21T09:30:00",
                                      "",
                                      "2026-11-2",
                                      "2026-11-21x"};
    char text[120];
    for (size_t i = 0; i < COUNT(good); i++) {
        snprintf(text, sizeof text, "{\"date\": \"%s\", \"drops\": [{\"contact_time\": 1}]}",
                 good[i]);
        accept(text);
        fields_clear(drop_test_fields, &test);
    }
    for (size_t i = 0; i < COUNT(bad); i++) {
        snprintf(text, sizeof text, "{\"date\": \"%s\", \"drops\": [{\"contact_time\": 1}]}",
                 bad[i]);
        refuse(text, "/date", "must be a date");
    }
}

TEST(more_drops_than_the_limit_are_refused) {
    Bytes bytes = {0};
    bytes_text(&bytes, "{\"drops\": [{\"contact_time\": 1}");
    for (size_t i = 0; i < DROPS_MAX; i++)
        bytes_text(&bytes, ", {\"contact_time\": 1}");
    bytes_text(&bytes, "]}");
    char *text = bytes_take(&bytes, NULL);
    assert_non_null(text);
    assert_int_equal(drops_read(text, &test, &problem), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/drops"), "1000"));
    fields_clear(drop_test_fields, &test);
    free(text);
}
