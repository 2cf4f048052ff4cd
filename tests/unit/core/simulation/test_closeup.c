// An impact from near has the ledger's peak and impulse: of every law, structure and base among the
// examples, and of contacts that overlap.
#include "core/simulation/closeup.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/excite/excitation.h"
#include "server/command/scene_file.h"
#include "server/jobs/intake.h"
#include "tests/support/scenes.h"

static void open_example(const char *name, Inquiry *inquiry) {
    char path[512];
    Bytes text;
    Store *store = NULL;
    Warnings warnings = {NULL, 0};
    Problem problem;
    problem_clear(&problem);
    snprintf(path, sizeof path, "%s/schema/examples/%s.json", IMPACTD_SOURCE_DIR, name);
    assert_int_equal(scene_file_read(path, &text, &problem), STATUS_OK);
    assert_int_equal(store_open(NULL, &store, &problem), STATUS_OK);
    assert_int_equal(intake_prepare(store, text.at, text.count, NULL, inquiry, &warnings, &problem),
                     STATUS_OK);
    store_close(store);
    warnings_clear(&warnings);
    bytes_clear(&text);
}

// The rows' force over their time, by trapezes.
static double integral_of(const Columns *columns) {
    const double *time = columns->at[0].values, *force = columns->at[1].values;
    double sum = 0;
    for (size_t i = 1; i < columns->rows; i++)
        sum += 0.5 * (force[i] + force[i - 1]) * (time[i] - time[i - 1]);
    return sum;
}

typedef struct Misses {
    double peak, impulse, start, end;
} Misses;

static double larger(double a, double b) {
    return a > b || isnan(a) ? a : b;
}

static void compare(const Simulation *simulation, const Impacts *impacts, size_t number,
                    size_t points, Misses *misses) {
    Closeup closeup;
    Problem problem;
    problem_clear(&problem);
    const Status status =
        closeup_make(simulation, number, points, NULL, NULL, NULL, &closeup, &problem);
    if (status != STATUS_OK)
        print_error("impact %zu: %s\n", number, problem.detail);
    assert_int_equal(status, STATUS_OK);
    const Columns *columns = &closeup.columns;
    const Impact *impact = &closeup.impact;
    double peak = 0;
    for (size_t i = 0; i < columns->rows; i++) {
        peak = fmax(peak, fabs(columns->at[1].values[i]));
        if (i > 0)
            assert_true(columns->at[0].values[i] > columns->at[0].values[i - 1]);
    }
    assert_string_equal(columns->at[1].name, "contact_force");
    // The path is the same to the last bit.
    assert_memory_equal(impact, &impacts->at[number - 1], sizeof *impact);
    if (impact->kind == IMPACT_IMPACT && !isnan(impact->end)) {
        assert_in_range(columns->rows, points - 1, points + 1);
        misses->start = larger(misses->start, fabs(columns->at[0].values[0] - impact->start));
        misses->end =
            larger(misses->end, fabs(columns->at[0].values[columns->rows - 1] - impact->end));
    }
    if (impact->impulse > 0) {
        misses->peak = larger(misses->peak, fabs(peak / impact->peak_force - 1));
        misses->impulse =
            larger(misses->impulse, fabs(fabs(integral_of(columns)) / impact->impulse - 1));
    }
    closeup_clear(&closeup);
}

// The first few impacts of an example, one in the middle and the last.
static Misses compare_example(const char *name, size_t points) {
    Inquiry inquiry;
    Outcome *outcome = NULL;
    Misses misses = {0};
    open_example(name, &inquiry);
    Simulation *simulation = &inquiry.simulation;
    simulation->output.impacts = true;
    assert_int_equal(simulation_run(simulation, NULL, NULL, NULL, &outcome, NULL), STATUS_OK);
    const size_t count = outcome->response.impacts.count;
    const size_t numbers[] = {1, 2, 3, 4, 5, count / 2, count - 1, count};
    for (size_t i = 0; i < COUNT(numbers); i++)
        if (numbers[i] >= 1 && numbers[i] <= count)
            compare(simulation, &outcome->response.impacts, numbers[i], points, &misses);
    print_message("%s: %zu impacts; peak %.2g impulse %.2g start %.2g end %.2g\n", name, count,
                  misses.peak, misses.impulse, misses.start, misses.end);
    outcome_drop(outcome);
    inquiry_clear(&inquiry);
    return misses;
}

static void every_law_base_and_structure_keeps_peak_and_impulse(void **state) {
    (void)state;
    static const char *const names[] = {"paper_free_sponge",
                                        "paper_free_aluminium",
                                        "paper_random_sponge",
                                        "paper_random_aluminium",
                                        "paper_sine_sponge",
                                        "paper_sine_aluminium",
                                        "contact_flores",
                                        "contact_hertz",
                                        "contact_hunt_crossley",
                                        "contact_hunt_crossley_textbook",
                                        "contact_jankowski",
                                        "contact_lankarani_nikravesh",
                                        "contact_rig",
                                        "contact_table",
                                        "contact_zero_force",
                                        "frame_two_dampers",
                                        "frame_modes",
                                        "half_sine",
                                        "triangular",
                                        "chirp",
                                        "record_inline",
                                        "matrices",
                                        "all_keys",
                                        "accuracy_target"};
    for (size_t i = 0; i < COUNT(names); i++) {
        const Misses misses = compare_example(names[i], 2001);
        (void)misses;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_law_base_and_structure_keeps_peak_and_impulse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
