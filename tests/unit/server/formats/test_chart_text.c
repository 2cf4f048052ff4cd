// Charts as text: Braille patterns and ASCII, labels, what does not fit.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "server/formats/chart.h"
#include "tests/support/test.h"

static char *draw(const ChartSeries *series, size_t count, const ChartText *form) {
    Chart chart = {.width = 100, .title = "a chart"};
    ChartPanel *panel = chart_panel(&chart, "y [m]", 100);
    panel->x.title = "time [s]";
    for (size_t i = 0; i < count; i++)
        chart_add(panel, series[i]);
    Bytes bytes = {0};
    chart_write_text(&chart, 0, form, &bytes);
    chart_clear(&chart);
    char *text = bytes_take(&bytes, NULL);
    assert_non_null(text);
    return text;
}

TEST(a_line_is_drawn_in_braille_with_its_axes) {
    const double x[] = {0, 1, 2, 3}, y[] = {0, 1, 2, 3};
    const ChartSeries line = {CHART_LINE, x, y, NULL, 4, .colour = 0};
    char *text = draw(&line, 1, &(ChartText){.columns = 24, .rows = 4, .is_utf8 = true});
    assert_string_equal(text, "y [m] over time [s]\n"
                              "  │                ⢀⣀⠤⠔⠒\n"
                              "2 ┤          ⢀⣀⠤⠔⠒⠉⠁    \n"
                              "  │    ⢀⣀⠤⠔⠒⠉⠉          \n"
                              "0 ┤⠤⠔⠒⠉⠁                \n"
                              "  └┬────────────┬───────\n"
                              "   0            2\n");
    free(text);
}

TEST(ascii_has_no_other_characters_and_two_dots_in_each) {
    const double x[] = {0, 1, 2, 3}, y[] = {0, 1, 2, 3}, at[] = {1, 2},
                 low[] = {-(double)INFINITY, -(double)INFINITY};
    const ChartSeries series[] = {
        {CHART_LINE, x, y, NULL, 4, .colour = 0},
        {CHART_MARKERS, at, low, NULL, 2, .colour = 1, .shape = CHART_TICK, .legend = "ticks"}};
    char *text = draw(series, 2, &(ChartText){.columns = 40, .rows = 4});
    for (const char *c = text; *c != '\0'; c++)
        assert_true(*c == '\n' || (*c >= ' ' && *c <= '~'));
    assert_non_null(strstr(text, "y [m] over time [s]  ' ticks\n"));
    assert_non_null(strstr(text, "+-----------'-----------'-----------+\n"));
    free(text);
}

TEST(no_line_is_longer_than_asked_for_and_colours_end_where_they_begin) {
    double x[400], y[400], high[400];
    for (size_t i = 0; i < COUNT(x); i++) {
        x[i] = (double)i;
        y[i] = sin(x[i] / 9);
        high[i] = y[i] + 0.1;
    }
    y[7] = (double)NAN;
    const ChartSeries series[] = {
        {CHART_LINE, x, y, NULL, COUNT(x), .colour = 3, .legend = "a line whose legend is long"},
        {CHART_BAND, x, y, high, COUNT(x), .colour = 4, .legend = "and a band with one as well"},
        {CHART_MARKERS, x, y, NULL, 3, .shape = CHART_RING, .legend = "rings"}};
    for (size_t columns = 20; columns < 120; columns += 33) {
        char *text =
            draw(series, 3, &(ChartText){columns, .rows = 5, .is_utf8 = true, .has_colour = true});
        size_t width = 0, painted = 0, ended = 0;
        for (const char *c = text; *c != '\0'; c++) {
            if (*c == '\033') {
                ended += strncmp(c, "\033[0m", 4) == 0;
                painted += strncmp(c, "\033[0m", 4) != 0;
                c = strchr(c, 'm');
                continue;
            }
            width = *c == '\n' ? 0 : width + (((unsigned char)*c & 0xC0) != 0x80);
            assert_true(width <= columns);
        }
        assert_true(painted > 0 && ended > 0 && ended <= painted);
        free(text);
    }
}

TEST(a_map_has_shades_and_its_range) {
    const double values[] = {0, 1, (double)NAN, 3};
    const ChartSeries map = {CHART_MAP, .y = values, .count = 4, .columns = 2};
    char *text = draw(&map, 1, &(ChartText){.columns = 24, .rows = 2});
    assert_non_null(strstr(text, "          #"));
    assert_non_null(strstr(text, " 0 to 3\n"));
    free(text);
}

TEST(what_has_no_value_is_not_known) {
    const double x[] = {1}, y[] = {(double)NAN};
    const ChartSeries line = {CHART_LINE, x, y, NULL, 1, .colour = 0};
    char *text = draw(&line, 1, &(ChartText){.columns = 24, .rows = 2});
    assert_string_equal(text, "y [m] over time [s]\n  not known\n");
    free(text);
}
