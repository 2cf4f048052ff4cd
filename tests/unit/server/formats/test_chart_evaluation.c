// Charts of evaluations at their borders: nothing to draw, one reading, no speeds, hostile texts.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/study_formats.h"
#include "tests/support/drops.h"
#include "tests/support/test.h"

static Problem problem;

// Of the test in that text; freed by the caller.
static char *draw(const char *text) {
    DropTest test;
    if (drops_read(text, &test, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    const Measurement one = {COUNT_ABSENT, &test};
    Evaluation evaluation;
    assert_int_equal(
        evaluation_run(&one, 1, SEPARATION_ZERO_PENETRATION, NULL, &evaluation, &problem),
        STATUS_OK);
    Bytes bytes = {.most = 1 << 20};
    chart_evaluation(&evaluation, "felt", &bytes);
    evaluation_clear(&evaluation);
    fields_clear(drop_test_fields, &test);
    char *svg = bytes_take(&bytes, NULL);
    assert_non_null(svg);
    assert_null(strstr(svg, "nan"));
    assert_null(strstr(svg, "inf\""));
    assert_non_null(strstr(svg, "</svg>"));
    return svg;
}

static size_t count_of(const char *text, const char *word) {
    size_t count = 0;
    for (const char *at = strstr(text, word); at != NULL; at = strstr(at + 1, word))
        count++;
    return count;
}

TEST(what_is_not_known_has_no_frame) {
    char *svg = draw("{\"drops\": [{\"drop_height\": 1, \"rebound_height\": 0.25}]}");
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 1);
    assert_int_equal(count_of(svg, "class=\"frame\""), 1);
    assert_non_null(strstr(svg, "Contact time T_c: not known"));
    free(svg);
}

TEST(readings_without_a_speed_are_drawn) {
    char *svg = draw("{\"drops\": [{\"contact_time\": 0.001}, {\"contact_time\": 0.002}]}");
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 2);
    free(svg);
    svg = draw("{\"drops\": [{\"contact_time\": 0.001}, {\"contact_time\": 0.001}]}");
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 2);
    free(svg);
}

TEST(what_does_not_count_is_a_cross_and_its_words_are_no_markup) {
    char *svg = draw("{\"drops\": [{\"drop_height\": 1, \"rebound_height\": 2, "
                     "\"excluded\": \"<b>&\\\"'</b>\"}]}");
    assert_int_equal(count_of(svg, "class=\"cross\""), 1);
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 0);
    assert_null(strstr(svg, "<b>"));
    free(svg);
}

TEST(a_change_with_speed_is_a_line) {
    char *svg = draw("{\"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 0.7}, "
                     "{\"approach_speed\": 2, \"rebound_speed\": 1.3}, "
                     "{\"approach_speed\": 3, \"rebound_speed\": 1.801}, "
                     "{\"approach_speed\": 4, \"rebound_speed\": 2.2}]}");
    assert_int_equal(count_of(svg, "class=\"line s1 trend\""), 1);
    free(svg);
}
