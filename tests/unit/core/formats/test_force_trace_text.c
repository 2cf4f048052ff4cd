// Force traces as loggers write them.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/drop_test.h"
#include "core/formats/force_trace_text.h"
#include "tests/support/test.h"

static Problem problem;

// Bytes of their own, so that a sanitizer sees what is read behind them.
static Status read_text(const char *text, double interval, Trace *trace) {
    const size_t size = strlen(text);
    char *copy = malloc(size > 0 ? size : 1);
    memcpy(copy, text, size);
    *trace = (Trace){.interval = interval};
    problem_clear(&problem);
    const Status status = force_trace_text_read(copy, size, TRACE_SAMPLES_MAX, &trace->interval,
                                                &trace->force, &problem);
    free(copy);
    assert_true(status == STATUS_OK || trace->force.at == NULL);
    return status;
}

static void good(const char *text, double given, double interval, size_t count, double last) {
    Trace trace;
    if (read_text(text, given, &trace) != STATUS_OK)
        fail_msg("%s %s", text, problem.detail);
    assert_true(trace.interval == interval);
    assert_int_equal(trace.force.count, count);
    assert_true(trace.force.at[count - 1] == last);
    free(trace.force.at);
}

static void bad(const char *text, double given, const char *words) {
    Trace trace;
    if (read_text(text, given, &trace) == STATUS_OK)
        fail_msg("passed: %s", text);
    const char *place = problem.count > 0 ? problem.faults[0].pointer : "";
    const char *said = problem.count > 0 ? problem.faults[0].detail : problem.detail;
    if (strstr(said, words) == NULL && strstr(place, words) == NULL)
        fail_msg("%s: said \"%s\" at \"%s\", not \"%s\"", text, said, place, words);
}

TEST(times_tell_the_interval) {
    const double none = (double)NAN;
    good("time [s],force [N]\n0,0.5\n0.001,1.5\n0.002,-2\n", none, 0.001, 3, -2);
    good("0;1\n1e-5;2\n2e-5;3", none, 1e-5, 3, 3);
    good("\xEF\xBB\xBF"
         "a logger's title\n\nt (s)\tF (N)\r\n10.00 1\r\n10.25 2\r\n10.5 3\r\n\r\n",
         none, 0.25, 3, 3);
    // Rounded to four places, an interval of 0.00025.
    good("0.0000 1\n0.0002 1\n0.0005 1\n0.0008 1\n0.0010 7\n", none, 0.00025, 5, 7);
    good("0 1\n0.5 2\n", 0.5, 0.5, 2, 2);
}

TEST(forces_alone_need_an_interval) {
    good("force [N]\n1\n2\n3\n", 1e-4, 1e-4, 3, 3);
    good("1,\n2,\n", 2e-4, 2e-4, 2, 2);
    bad("1\n2\n3\n", (double)NAN, "--interval");
}

TEST(what_cannot_be_meant_is_told_with_its_line) {
    const double none = (double)NAN;
    bad("", none, "no line of numbers");
    bad("force [N]\n", none, "no line of numbers");
    bad("0 1\n", none, "1 samples");
    bad("time [s],force [kN]\n0,1\n1,2\n", none, "kN");
    bad("time [ms],force [N]\n0,1\n1,2\n", none, "line 1");
    bad("0 1\n1 2\n2 3 4\n", none, "line 3");
    bad("0 1 2\n1 2 3\n", none, "the force alone");
    bad("0 1\n1 2\n2\n", none, "as many numbers");
    bad("0 1\n1 2\n1 3\n2 4\n", none, "evenly");
    bad("0 1\n1 2\n2 3\n9 4\n", none, "line 4");
    bad("0 1\n1 2\n2 3\n1.5 3\n4 3\n", none, "line 4");
    bad("1 1\n0 2\n-1 2\n", none, "evenly");
    bad("0 1\n1 x\n", none, "line 2, column 3");
    bad("0 1\n1 nan\n", none, "line 2");
    bad("0 1\n1 1e999\n", none, "line 2");
    bad("0 1\n0.5 2\n1 3\n", 0.25, "0.25 s is given");
    bad("0,5;1\n1,5;2\n", none, "has 3 numbers");
    bad("0 1\n\x01 2\n", none, "0x01");
}

TEST(a_trace_has_a_most) {
    const size_t count = (size_t)TRACE_SAMPLES_MAX + 1;
    char *text = malloc(2 * count + 1);
    for (size_t i = 0; i < count; i++)
        memcpy(text + 2 * i, "1\n", 2);
    text[2 * count] = '\0';
    Trace trace;
    assert_int_equal(read_text(text, 1e-4, &trace), STATUS_TOO_LARGE);
    text[2 * count - 2] = '\0';
    assert_int_equal(read_text(text, 1e-4, &trace), STATUS_OK);
    assert_int_equal(trace.force.count, TRACE_SAMPLES_MAX);
    free(trace.force.at);
    free(text);
}
