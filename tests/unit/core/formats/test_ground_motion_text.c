// Small files of our own in each layout, and what is wrong with the bad ones.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "tests/support/test.h"

static Problem problem;
static const GroundMotionOptions nothing = {NAN, CHOICE_ABSENT}, in_g = {NAN, ACCELERATION_G},
                                 whole = {0.02, ACCELERATION_METRES};

#define PEER                                                                                       \
    "PEER STRONG MOTION DATABASE RECORD\nSOMEWHERE 01/02/03, STATION 7, 090\n"                     \
    "ACCELERATION TIME HISTORY IN UNITS OF G\n"

static GroundMotionText good(const char *text, const GroundMotionOptions *request) {
    GroundMotionText import;
    problem_clear(&problem);
    if (ground_motion_text_read(text, strlen(text), RECORD_SAMPLES, request, &import, &problem) !=
        STATUS_OK)
        fail_msg("%s: %s", problem.faults[0].pointer, problem.faults[0].detail);
    return import;
}

// Bytes of their own, so that a sanitizer sees what is read behind them.
static Status read_bytes(const char *text, size_t size, const GroundMotionOptions *request) {
    char *copy = malloc(size > 0 ? size : 1);
    memcpy(copy, text, size);
    GroundMotionText import;
    problem_clear(&problem);
    const Status status =
        ground_motion_text_read(copy, size, RECORD_SAMPLES, request, &import, &problem);
    free(copy);
    assert_true(status == STATUS_OK || (import.samples.at == NULL && import.header == NULL));
    if (status == STATUS_OK)
        ground_motion_text_clear(&import);
    return status;
}

static void bad(const char *text, const GroundMotionOptions *request, const char *place,
                const char *detail) {
    if (read_bytes(text, strlen(text), request) == STATUS_OK)
        fail_msg("passed: %s", text);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, place);
    if (strstr(problem.faults[0].detail, detail) == NULL)
        fail_msg("%s: said \"%s\", not \"%s\"", place, problem.faults[0].detail, detail);
}

static void check(GroundMotionText import, const char *layout, size_t count, double interval,
                  double last) {
    assert_string_equal(import.layout, layout);
    assert_int_equal(import.samples.count, count);
    assert_true(import.interval == interval);
    assert_true(fabs(import.samples.at[count - 1] - last) <= 1e-15 * fabs(last));
    ground_motion_text_clear(&import);
    assert_null(import.samples.at);
}

TEST(peers_old_and_new_headers_are_read) {
    static const char *const headers[] = {
        "NPTS=  6, DT= .01000 SEC\n",    "NPTS=   6, DT=   .0100 SEC,          \n",
        "NPTS=  6, dt=  .01\n",          "npts: 6 dt: 1.D-2\n",
        "NPTS= 6, DT= .01000 SEC\r\r\n", "DT= 0.01 SEC, NPTS= 6\n",
    };
    char text[512];
    for (size_t i = 0; i < COUNT(headers); i++) {
        snprintf(text, sizeof text, PEER "%s  -.1E-02   .2E-02   .3E-02   .4E-02\n .5E-2 -.6E-2",
                 headers[i]);
        GroundMotionText import = good(text, &nothing);
        assert_int_equal(import.unit, ACCELERATION_G);
        assert_int_equal(import.stated_unit, ACCELERATION_G);
        assert_true(import.samples.at[0] == -.1e-2 * 9.80665);
        assert_non_null(strstr(import.header, "STATION 7, 090; ACCELERATION"));
        check(import, "at2", 6, 0.01, -.6e-2 * 9.80665);
    }
    check(good(PEER "3    0.0100    NPTS, DT\n 0.1 0.2\n 0.3\n", &nothing), "at2_value_first", 3,
          0.01, 0.3 * 9.80665);
    check(good(PEER "3 ,   0.0100 ,  NPTS, DT\n 0.1 0.2\n 0.3\n", &nothing), "at2_value_first", 3,
          0.01, 0.3 * 9.80665);
}

TEST(marks_bound_the_numbers) {
    check(good("Prose with 4 points\nThe units are (g)\n*** Begin data ***\n"
               "NPTS=  4, DT= .02000 SEC\n 1 2\n 3 4\n\n\n",
               &nothing),
          "at2", 4, 0.02, 4 * 9.80665);
    check(good("The units are (g)\n1 2\n*** Begin data ***\n 3 4\n 5 6\n*** End data ***\n",
               &(GroundMotionOptions){0.02, CHOICE_ABSENT}),
          "columns", 4, 0.02, 6 * 9.80665);
    check(good("   0.00630   0.00364\n  -0.00128\n*** End Data ***\n\n", &whole), "columns", 3,
          0.02, -0.00128);
    bad("1 2\n*** End data ***\n3 4\n", &whole, "line 3", "must be empty");
}

TEST(a_count_and_an_interval_may_stand_before_one_column) {
    check(good("some motion\n3 0.0100\n2.42E-07\n\n1d-3\n-3",
               &(GroundMotionOptions){NAN, ACCELERATION_METRES}),
          "count_line", 3, 0.01, -3);
    bad("some motion\n4 0.0100\n1\n2\n3\n", &whole, "line 2",
        "must state how many values follow: states 4, but 3 follow, the last on line 5");
}

TEST(times_give_the_interval) {
    const char *const text = "A motion\nTime[s] Accel[g]\n0.0000\t-0.0012\n0.0100\t-0.0007\n"
                             "0.0200\t-0.0003\n0.0300\t0.5";
    check(good(text, &nothing), "time_acceleration", 4, 0.01, 0.5 * 9.80665);
    // Rounded times; their mean is the interval.
    check(good("0.000 1\n0.003 2\n0.007 3\n0.010 4\n0.013 5\n0.017 6\n0.020 7\n", &in_g),
          "time_acceleration", 7, 0.00333333333333, 7 * 9.80665);
    bad("Time[s] Accel[g]\n0 1\n0.01 2\n0.02 3\n0.04 4\n0.05 5\n0.06 6\n0.07 7\n", &nothing,
        "line 5", "times must rise evenly: is 0.04 s after 0.02 s, where steps are 0.01 s");
    // A step that is wrong, but not by an interval, bends the mean more than any before it.
    bad("0 1\n.01 2\n.02 3\n.03 4\n.04 5\n.05 6\n.06 7\n.075 8\n", &in_g, "line 8",
        "times must rise evenly: is 0.075 s after 0.06 s, where steps are 0.01 s");
    bad("0 1\n0.01 2\n0.02 3\n\n0.01 4\n0.02 5\n0.03 6\n", &in_g, "line 5", "is 0.01 s after 0.02");
    bad("Time[s] Accel[g]\n0 1\n0.01 2\n0.02\n0.03 4\n", &nothing, "line 4", "has 1");
    bad("0 1 9\n0.01 2 9\n0.02 3 9\n0.03 4 9\n", &whole, "line 4", "two columns");
    bad(text, &whole, "line 3", "states an interval of 0.01 s, but 0.02 s is given");
}

TEST(columns_of_a_rising_acceleration_are_no_times) {
    check(good(PEER "NPTS= 8, DT= 0.01\n0 1\n2 3\n4 5\n6 7\n", &nothing), "at2", 8, 0.01,
          7 * 9.80665);
}

TEST(units_are_found_or_must_be_given) {
    static const struct {
        const char *header;
        int unit;
    } units[] = {
        {"UNITS OF G. FILTER POINTS: HP=0.2 Hz", ACCELERATION_G},
        {"acceleration, m/s^2", ACCELERATION_METRES},
        {"Accel (m/s/s)", ACCELERATION_METRES},
        {"in m/sec2", ACCELERATION_METRES},
        {"accel. in cm/sec/sec", ACCELERATION_CENTIMETRES},
        {"peak 3 m/s and 0.3 g", CHOICE_ABSENT},
        {"unit: gal", ACCELERATION_CENTIMETRES},
        {"UNITS OF G/10", CHOICE_ABSENT},
        {"mm/s^2", CHOICE_ABSENT},
        {"Gallery G", CHOICE_ABSENT},
    };
    char text[256];
    for (size_t i = 0; i < COUNT(units); i++) {
        snprintf(text, sizeof text, "%s\nNPTS=2, DT=1\n1 2", units[i].header);
        GroundMotionText import = good(text, &nothing);
        if (import.stated_unit != units[i].unit)
            fail_msg("%s", units[i].header);
        assert_int_equal(import.unit,
                         units[i].unit == CHOICE_ABSENT ? ACCELERATION_G : units[i].unit);
        ground_motion_text_clear(&import);
    }
    check(good("unit: gal\n1 2\n3\n", &(GroundMotionOptions){1, CHOICE_ABSENT}), "columns", 3, 1,
          0.03);
    check(good("unit: gal\n1 2\n3\n", &(GroundMotionOptions){1, ACCELERATION_METRES}), "columns", 3,
          1, 3);
    bad("1\n2\n3\n", &(GroundMotionOptions){1, CHOICE_ABSENT}, "line 1",
        "must state the unit, or unit must be given: g, m/s^2");
    bad("units (g)\nor m/s^2\nNPTS=2, DT=1\n1 2", &nothing, "line 2",
        "states another unit than line 1, g");
    bad("VELOCITY TIME HISTORY IN UNITS OF CM/SEC\nNPTS=2, DT=1\n1 2", &nothing, "line 1",
        "must be of an acceleration, is of a velocity");
    bad("DISPLACEMENT TIME SERIES IN UNITS OF CM\nNPTS=2, DT=1\n1 2", &nothing, "line 1",
        "is of a displacement");
}

TEST(what_is_not_told_must_be_given) {
    bad("1\n2\n3\n", &in_g, "line 1", "must state the interval");
    bad(PEER "NPTS= 3\n1 2 3", &nothing, "line 4", "must state the interval");
    check(good(PEER "NPTS= 3\n1 2 3", &(GroundMotionOptions){0.5, CHOICE_ABSENT}), "at2", 3, 0.5,
          3 * 9.80665);
    bad(PEER "NPTS= 3, DT= .01\n1 2 3", &whole, "line 4",
        "states an interval of 0.01 s, but 0.02 s is given");
}

TEST(a_count_that_does_not_match_is_told_with_both_numbers) {
    bad(PEER "NPTS= 4, DT= .01\n1 2\n3\n", &nothing, "line 4",
        "states 4, but 3 follow, the last on line 6");
    bad(PEER "NPTS= 2, DT= .01\n1 2\n3\n", &nothing, "line 4",
        "states 2, but 3 follow, the last on line 6");
    bad(PEER "NPTS= 1e300, DT= .01\n1 2\n3\n", &nothing, "line 4", "states 1e+300, but 3 follow");
    bad(PEER "NPTS= 2.5, DT= .01\n1 2\n", &nothing, "line 4", "whole number");
    bad(PEER "NPTS= -2, DT= .01\n1 2\n", &nothing, "line 4", "at least 1, states -2");
    bad(PEER "NPTS= many, DT= .01\n1 2\n", &nothing, "line 4", "after NPTS");
    bad(PEER "NPTS= 2, DT= 0\n1 2\n", &nothing, "line 4", "interval above 0 s, states 0");
    bad(PEER "NPTS= 2, DT= -1\n1 2\n", &nothing, "line 4", "interval above 0 s, states -1");
    bad("1 2 3\n4 5\n6 7 8\n9\n", &whole, "line 2",
        "must have 3 numbers, as the rows before, has 2");
    bad("1 2 3\n4 5 6 7\n", &whole, "line 2", "has 4");
}

TEST(garbage_is_told_with_line_and_column) {
    static const struct {
        const char *row, *place, *detail;
    } rows[] = {
        {"  0.10000-0.20000\n", "line 2, column 3", "run together, is 0.10000-0.20000"},
        {"1.5.5 1\n", "line 2, column 1", "run together"},
        {"1 ********\n", "line 2, column 3", "stars replace one that was too long"},
        {"1\tNaN\n", "line 2, column 3", "must be a finite number, is NaN"},
        {"-Infinity 2\n", "line 2, column 1", "finite"},
        {"1e999 2\n", "line 2, column 1", "that a double can hold"},
        {"1.0E 2\n", "line 2, column 1", "must be a number, is 1.0E"},
        {"0x10 2\n", "line 2, column 1", "must be"},
        {". 2\n", "line 2, column 1", "must be a number"},
        {"+-2 1\n", "line 2, column 1", "must be a number"},
        {"0,5 1\n", "line 2, column 1", "decimal point"},
        {"1 the end\n", "line 2, column 3", "must be a number, is the"},
        {"1 2 \xff\n", "line 2, column 5", "is ?"},
        {"1 0000000000000000000000000000000000000000000000000000000000000000001\n",
         "line 2, column 3", "at most 63 characters"},
    };
    char text[256];
    for (size_t i = 0; i < COUNT(rows); i++) {
        snprintf(text, sizeof text, "0 0\n%s", rows[i].row);
        bad(text, &whole, rows[i].place, rows[i].detail);
    }
    bad("1 1e308\n", &(GroundMotionOptions){1, ACCELERATION_G}, "line 1", "finite in m/s^2");
    // Commas throughout leave no line of numbers to begin with.
    bad("t, a\n0.00,0.5\n0.01,0.6\n", &whole, "line 2, column 1", "separated by blanks");
    bad("t;a m/s^2\n0.00;0.5\n0.01;0.6\n", &whole, "line 2, column 1", "separated by blanks");
    bad("a motion\nof Nov 5, 1999\n", &whole, "line 2, column 8", "must be a number");
    bad("a motion\nof words\n", &whole, "line 2", "must hold a line of numbers up to here");
}

TEST(what_is_no_text_is_refused) {
    assert_int_equal(read_bytes("1 2\n3\0 4\n", 9, &whole), STATUS_UNREADABLE);
    assert_string_equal(problem.faults[0].pointer, "line 2, column 2");
    assert_string_equal(problem.faults[0].detail,
                        "must be text, holds the byte 0x00 (a binary file, or UTF-16)");
    assert_int_equal(read_bytes("\x7f"
                                "ELF",
                                4, &whole),
                     STATUS_UNREADABLE);
    bad("", &whole, "line 1", "must hold a line of numbers");
    bad("\n\n", &whole, "line 2", "the end of the file");
    bad("words\nand words\n", &whole, "line 2", "must hold a line of numbers");
    bad("5\n", &whole, "line 1", "2 to 4194304 samples from here on, holds 1");
    bad(PEER "NPTS= 1, DT= .01\n5\n", &nothing, "line 5", "holds 1");
    check(good("\xEF\xBB\xBF"
               "1 2\n3 4\n",
               &whole),
          "columns", 4, 0.02, 4);
}

TEST(every_beginning_of_a_file_is_refused) {
    static const char text[] =
        PEER "NPTS=  6, DT= .01000 SEC\n  -.1E-02   .2E-02   .3E-02\n  .4E-02  .5E-02 -.6E-02";
    // A last number that lost digits cannot be told from a whole one.
    const size_t last = (size_t)(strrchr(text, '-') - 4 - text);
    assert_memory_equal(text + last, "-.6E", 4);
    for (size_t size = 0; size <= last; size++)
        if (read_bytes(text, size, &nothing) == STATUS_OK)
            fail_msg("%zu bytes passed", size);
    assert_int_equal(read_bytes(text, sizeof text - 1, &nothing), STATUS_OK);
}

TEST(long_texts_take_time_in_proportion_and_have_their_limit) {
    const size_t size = (size_t)20 << 20;
    char *text = malloc(size);
    memset(text, '1', size);
    assert_int_equal(read_bytes(text, size, &whole), STATUS_UNREADABLE); // one endless word
    for (size_t i = 1; i < size; i += 2)
        text[i] = ' '; // one endless line
    assert_int_equal(read_bytes(text, size, &whole), STATUS_TOO_LARGE);
    for (size_t i = 1; i < size; i += 2)
        text[i] = '\n'; // endless lines
    assert_int_equal(read_bytes(text, size, &whole), STATUS_TOO_LARGE);
    assert_string_equal(problem.faults[0].pointer, "line 8388609");
    memset(text, '\n', size);
    assert_int_equal(read_bytes(text, size, &whole), STATUS_UNREADABLE);
    memset(text, 'x', size);
    assert_int_equal(read_bytes(text, size, &whole), STATUS_UNREADABLE);
    free(text);
}

TEST(a_header_is_kept_to_a_thousand_plain_bytes) {
    char text[4096] = "";
    for (int i = 0; i < 60; i++)
        strcat(text, "A header line of some length, \xc3\xa9\t\n");
    strcat(text, "units g\n1\n2\n");
    GroundMotionText import = good(text, &whole);
    assert_int_equal(strlen(import.header), 1000);
    for (const char *c = import.header; *c != '\0'; c++)
        assert_true(*c >= ' ' && *c <= '~');
    ground_motion_text_clear(&import);
    ground_motion_text_clear(&import);
}
