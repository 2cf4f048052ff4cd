// Charts at their borders: nothing to draw, gaps, many points.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/tradeoff.h"
#include "server/formats/chart.h"
#include "server/formats/study_formats.h"
#include "tests/support/drops.h"
#include "tests/support/test.h"

static TradeoffPoint point_make(char *name, char *solver, double cpu, double error) {
    TradeoffPoint point;
    assert_int_equal(fields_default(tradeoff_point_fields, &point), STATUS_OK);
    point.name = name;
    point.solver = solver;
    point.cpu_minimum = cpu;
    point.errors.displacement = error;
    return point;
}

static char *draw(TradeoffPoint *points, size_t count, double error, uint64_t choice) {
    const Tradeoff tradeoff = {.metric = METRIC_DISPLACEMENT,
                               .error = error,
                               .points = {points, count},
                               .recommendation = {choice, "because a < b & c"}};
    Bytes bytes = {0};
    Chart chart;
    chart_tradeoff((const Variant *)(const void *)&tradeoff, &chart);
    chart_write(&chart, &bytes);
    char *text = bytes_take(&bytes, NULL);
    assert_non_null(text);
    assert_null(strstr(text, "nan"));
    assert_null(strstr(text, "inf"));
    return text;
}

static size_t count_of(const char *text, const char *part) {
    size_t count = 0;
    for (const char *at = text; (at = strstr(at, part)) != NULL; at++)
        count++;
    return count;
}

TEST(an_error_of_0_stands_on_the_floor) {
    TradeoffPoint points[] = {point_make("exact", "exact", 1e-5, 0),
                              point_make("rk4", "rk4", 1e-3, 3)};
    char *text = draw(points, COUNT(points), 0, COUNT_ABSENT);
    assert_null(strstr(text, ">wanted"));
    assert_int_equal(count_of(text, "class=\"mark s0\""), 2);
    assert_non_null(strstr(text, " 374.0)")); // at the bottom of the plot
    free(text);
}

TEST(there_may_be_nothing_to_draw) {
    char *text = draw(NULL, 0, 1e-3, COUNT_ABSENT);
    assert_int_equal(count_of(text, "class=\"mark"), 0);
    free(text);
    TradeoffPoint one = point_make("exact", "exact", 1e-5, 1e-3);
    text = draw(&one, 1, 1e-3, 7); // no such number
    assert_int_equal(count_of(text, "class=\"mark"), 2);
    free(text);
}

TEST(more_groups_than_colours_repeat_them) {
    TradeoffPoint points[20];
    char names[20][8];
    for (size_t i = 0; i < COUNT(points); i++) {
        snprintf(names[i], sizeof names[i], "s%zu", i);
        points[i] = point_make(names[i], names[i], 1e-5 * (double)(i + 1), 1e-3);
    }
    char *text = draw(points, COUNT(points), 1e-3, 20);
    assert_int_equal(count_of(text, "<title>s"), 20);
    free(text);
}

// A panel of 100 by 100 pixels with one line over 0, 1, 2 and so on.
static char *draw_line(const double *y, const double *high, size_t count, bool is_logarithmic) {
    Chart chart = {.width = 120, .left = 10, .right = 10, .title = "a < b"};
    ChartPanel *panel = chart_panel(&chart, NULL, 100);
    double *x = chart_new(&chart, count, sizeof *x);
    assert_non_null(x);
    for (size_t i = 0; i < count; i++)
        x[i] = (double)i;
    panel->y.is_logarithmic = is_logarithmic;
    chart_add(panel, (ChartSeries){CHART_LINE, x, y, high, count, .colour = 0});
    Bytes bytes = {0};
    chart_write(&chart, &bytes);
    char *text = bytes_take(&bytes, NULL);
    assert_non_null(text);
    assert_non_null(strstr(text, "<title>a &lt; b</title>"));
    return text;
}

TEST(a_line_is_interrupted_where_a_value_is_missing) {
    const double y[] = {0, 1, (double)NAN, 1, 0};
    char *text = draw_line(y, NULL, COUNT(y), false);
    assert_non_null(
        strstr(text, "class=\"line s0\" d=\"M10.0 107.5L35.0 16.5M85.0 16.5L110.0 107.5\""));
    free(text);
    text = draw_line(y, y, COUNT(y), false);
    assert_non_null(strstr(text, "class=\"line area s0\" d=\"M10.0 107.5L35.0 16.5L35.0 16.5L10.0 "
                                 "107.5M85.0 16.5L110.0 107.5L110.0 107.5L85.0 16.5\""));
    free(text);
    text = draw_line(y + 2, NULL, 1, false);
    assert_non_null(strstr(text, "not known"));
    free(text);
}

TEST(many_points_take_limited_room_and_peaks_remain) {
    enum { POINTS = 100000 };
    double *low = calloc(POINTS, sizeof *low), *high = calloc(POINTS, sizeof *high);
    assert_true(low != NULL && high != NULL);
    for (size_t i = 0; i < POINTS; i++)
        low[i] = 1 + (double)(i % 7);
    char *text = draw_line(low, NULL, POINTS, true), *again = draw_line(low, NULL, POINTS, true);
    assert_string_equal(text, again); // equal bytes
    assert_true(count_of(text, "L") < 700);
    assert_non_null(strstr(text, ">10</text>"));
    free(text);
    free(again);
    for (size_t i = 0; i < 5; i++)
        high[i] = low[i] = i == 2 ? 2 : 0;
    low[2] = -2;
    text = draw_line(low, high, 5, false);
    assert_non_null(strstr(text, "L60.0 107.5L")); // to both ends
    assert_non_null(strstr(text, "L60.0 16.5L"));
    free(text);
    free(low);
    free(high);
}

// --- evaluations ---

static Problem problem;

// Of the test in that text; freed by the caller.
static char *draw_evaluation(const char *text) {
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

TEST(an_empty_panel_says_so) {
    char *svg = draw_evaluation("{\"drops\": [{\"drop_height\": 1, \"rebound_height\": 0.25}]}");
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 1);
    assert_int_equal(count_of(svg, ">not known</text>"), 1);
    assert_non_null(strstr(svg, "Contact time T_c: not known"));
    free(svg);
}

TEST(readings_without_a_speed_are_drawn) {
    char *svg =
        draw_evaluation("{\"drops\": [{\"contact_time\": 0.001}, {\"contact_time\": 0.002}]}");
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 2);
    free(svg);
    svg = draw_evaluation("{\"drops\": [{\"contact_time\": 0.001}, {\"contact_time\": 0.001}]}");
    assert_int_equal(count_of(svg, "class=\"mark s0\""), 2);
    free(svg);
}

TEST(a_change_with_speed_is_a_line) {
    char *svg = draw_evaluation("{\"drops\": [{\"approach_speed\": 1, \"rebound_speed\": 0.7}, "
                                "{\"approach_speed\": 2, \"rebound_speed\": 1.3}, "
                                "{\"approach_speed\": 3, \"rebound_speed\": 1.801}, "
                                "{\"approach_speed\": 4, \"rebound_speed\": 2.2}]}");
    assert_int_equal(count_of(svg, "class=\"line s1 trend\""), 1);
    free(svg);
}
