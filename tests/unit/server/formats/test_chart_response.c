#include <stdlib.h>
#include <string.h>

#include "core/study/response_curve.h"
#include "server/formats/study_formats.h"
#include "tests/support/test.h"

static ResponsePoint point_make(uint64_t branch, double value, double peak, bool is_stable) {
    ResponsePoint point;
    assert_int_equal(fields_default(response_point_fields, &point), STATUS_OK);
    point.branch = branch;
    point.value = value;
    point.direction = CURVE_UP;
    point.period = 1;
    point.stable = is_stable;
    point.peak_displacement = peak;
    point.undamped_peak_displacement = 2 * peak;
    return point;
}

TEST(a_point_is_a_row_of_the_table) {
    ResponsePoint points[] = {point_make(1, 3, 0.01, true), point_make(2, 3.1, 0.012, false)};
    points[1].period = COUNT_ABSENT;
    points[0].index = 0;
    points[0].impacts_per_period = 2;
    const ResponseCurve curve = {.variant = {study_response.answer}, .points = {points, 2}};
    const TableFormat *csv = study_format_find(study_response.answer, "csv");
    Bytes bytes = {0};
    study_format_write(csv, &(StudyDocument){.answer = &curve.variant}, &bytes);
    assert_false(bytes.is_failed);
    assert_non_null(strstr(bytes.at, "index,branch,value,direction,period,stable"));
    assert_non_null(strstr(bytes.at, "0,1,3,up,1,1,2,nan,0.01,"));
    assert_non_null(strstr(bytes.at, "0.012"));
    bytes_clear(&bytes);
}

static char *draw(ResponsePoint *points, size_t count) {
    static char pointer[] = "/excitation/frequency", unit[] = "Hz";
    const ResponseCurve curve = {
        .member.pointer = pointer, .unit = unit, .points = {points, count}};
    Bytes bytes = {0};
    Chart chart;
    chart_response(&curve.variant, &chart);
    chart_write(&chart, &bytes);
    char *text = bytes_take(&bytes, NULL);
    assert_non_null(text);
    assert_null(strstr(text, "nan"));
    assert_string_equal(text + strlen(text) - 7, "</svg>\n");
    return text;
}

TEST(unstable_orbits_are_dashed_and_sections_have_a_panel) {
    double section[] = {0.001, 0.01};
    Reals row = {section, 2};
    ResponsePoint points[] = {point_make(1, 3, 0.01, true),     point_make(1, 3.1, 0.012, true),
                              point_make(1, 3.2, 0.013, false), point_make(1, 3.3, 0.012, false),
                              point_make(2, 3.4, 0.02, false),  point_make(3, 3.5, 0.02, true)};
    points[4].period = COUNT_ABSENT;
    points[4].section = (Rows){&row, 1};
    char *text = draw(points, COUNT(points));
    assert_non_null(strstr(text, "wanted"));
    assert_non_null(strstr(text, "without dampers"));
    assert_non_null(strstr(text, "no period found"));
    assert_non_null(strstr(text, "zero crossings"));
    assert_non_null(strstr(text, "/excitation/frequency [Hz]"));
    free(text);
}

TEST(a_chart_of_no_points_is_whole) {
    char *text = draw(NULL, 0);
    assert_null(strstr(text, "inf"));
    free(text);
}
