// An impact from near has the ledger's peak and impulse: of every law, structure and base among the
// examples, and of contacts that overlap.
#include "core/simulation/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/cli/files.h"
#include "server/jobs/jobs.h"
#include "tests/support/test.h"

static void read_scene(const char *text, size_t size, StudyRequest *inquiry) {
    Db *store = NULL;
    Warnings warnings = {NULL, 0};
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(db_open(NULL, &store, &problem), STATUS_OK);
    const Status status = jobs_prepare(store, text, size, NULL, inquiry, &warnings, &problem);
    if (status != STATUS_OK)
        print_error("%s\n", problem.detail);
    assert_int_equal(status, STATUS_OK);
    db_close(store);
    warnings_clear(&warnings);
}

static void open_example(const char *name, StudyRequest *inquiry) {
    char path[512];
    Bytes text;
    snprintf(path, sizeof path, "%s/schema/examples/%s.json", IMPACTD_SOURCE_DIR, name);
    assert_int_equal(input_read(path, &text, NULL), STATUS_OK);
    read_scene(text.at, text.count, inquiry);
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
    ImpactHistory closeup;
    Problem problem;
    problem_clear(&problem);
    const Status status =
        impact_history_make(simulation, number, points, NULL, NULL, NULL, &closeup, &problem);
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
    assert_true(impact->start == impacts->at[number - 1].start);
    assert_true(impact->impulse == impacts->at[number - 1].impulse);
    if (impact->kind == IMPACT_IMPACT && !isnan(impact->end)) {
        assert_in_range(columns->rows, points * 9 / 10, points * 11 / 10);
        misses->start = larger(misses->start, fabs(columns->at[0].values[0] - impact->start));
        misses->end =
            larger(misses->end, fabs(columns->at[0].values[columns->rows - 1] - impact->end));
    }
    if (impact->impulse > 0) {
        misses->peak = larger(misses->peak, fabs(peak / impact->peak_force - 1));
        misses->impulse =
            larger(misses->impulse, fabs(fabs(integral_of(columns)) / impact->impulse - 1));
    }
    impact_history_clear(&closeup);
}

// The first few impacts of an example, one in the middle and the last.
static Misses compare_example(const char *name, size_t points) {
    StudyRequest inquiry;
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
    outcome_unref(outcome);
    study_request_clear(&inquiry);
    return misses;
}

// By trapezes, an impulse has the error of their number; where damping sets in with infinite slope
// (Jankowski) more.
TEST(every_law_base_and_structure_keeps_peak_and_impulse) {
    static const struct {
        const char *name;
        double peak, impulse;
    } cases[] = {
        {"paper_free_sponge", 1e-9, 1e-6},
        {"paper_free_aluminium", 1e-9, 1e-6},
        {"paper_random_sponge", 1e-9, 1e-6},
        {"paper_random_aluminium", 1e-9, 1e-6},
        {"paper_sine_sponge", 1e-9, 1e-6},
        {"paper_sine_aluminium", 1e-9, 1e-6},
        {"contact_flores", 1e-9, 1e-6},
        {"contact_hertz", 1e-9, 1e-6},
        {"contact_hunt_crossley", 1e-9, 1e-6},
        {"contact_hunt_crossley_textbook", 1e-9, 1e-6},
        {"contact_jankowski", 1e-9, 1e-4},
        {"contact_lankarani_nikravesh", 1e-9, 1e-6},
        {"contact_rig", 1e-9, 1e-6},
        {"contact_table", 1e-9, 1e-6},
        {"contact_zero_force", 1e-9, 1e-6},
        {"frame_two_dampers", 1e-9, 1e-6},
        {"half_sine", 1e-9, 1e-6},
        {"triangular", 1e-9, 1e-6},
        {"chirp", 1e-9, 1e-6},
        {"record_inline", 1e-9, 1e-6},
        {"matrices", 1e-9, 1e-6},
        {"all_keys", 1e-9, 1e-6},
        {"accuracy_target", 1e-6, 1e-6}, // its contacts are followed to a tolerance
        {"solver_rk4", 5e-2, 5e-2},      // and these by steps of their own
        {"solver_newmark", 1e-1, 1e-1},
        {"solver_precise", 5e-2, 5e-2},
        {"solver_adaptive", 5e-2, 5e-2},
    };
    for (size_t i = 0; i < COUNT(cases); i += IMPACTD_SANITIZED ? 4 : 1) {
        const Misses misses = compare_example(cases[i].name, 2001);
        if (!(misses.peak < cases[i].peak) || !(misses.impulse < cases[i].impulse))
            fail_msg("%s: the peak is off by %g, the impulse by %g", cases[i].name, misses.peak,
                     misses.impulse);
    }
}

static ImpactHistory look(const Simulation *simulation, size_t number, size_t points) {
    ImpactHistory closeup;
    assert_int_equal(
        impact_history_make(simulation, number, points, NULL, NULL, NULL, &closeup, NULL),
        STATUS_OK);
    return closeup;
}

TEST(the_rows_go_from_touch_to_release) {
    StudyRequest inquiry;
    open_example("paper_free_sponge", &inquiry);
    ImpactHistory closeup = look(&inquiry.simulation, 1, IMPACT_HISTORY_POINTS);
    const Column *column = closeup.columns.at;
    const Impact *impact = &closeup.impact;
    const size_t last = closeup.columns.rows - 1;
    // Damping pushes at once, and pulls at the end.
    assert_true(fabs(column[0].values[0] - impact->start) < 1e-14);
    assert_true(column[2].values[0] == 0 && column[2].values[last] == 0);
    assert_true(fabs(column[3].values[0] - impact->approach_speed) < 1e-14);
    assert_true(fabs(column[1].values[0] - 4.0457377 * impact->approach_speed) < 1e-6);
    assert_true(fabs(column[0].values[last] - impact->end) < 1e-14);
    assert_true(fabs(column[3].values[last] + impact->separation_speed) < 1e-12);
    assert_true(fabs(column[1].values[last] + 4.0457377 * impact->separation_speed) < 1e-6);
    for (size_t i = 1; i < last; i++) {
        const double k = 1655.6191, c = 4.0457377;
        assert_true(fabs(column[1].values[i] - k * column[2].values[i] - c * column[3].values[i]) <
                    1e-5);
    }
    impact_history_clear(&closeup);
    study_request_clear(&inquiry);
}

// Carried along by a base that accelerates, the mass comes to rest at the left stop, and is pushed
// there: m times the acceleration.
TEST(a_rest_has_a_force_too) {
    static const char scene[] =
        "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 30}, \"dampers\": "
        "[{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": {\"restitution\": 0.3}}], "
        "\"contact\": {\"model\": \"impulse\"}, \"excitation\": {\"kind\": \"record\", "
        "\"samples\": [2, 2], \"interval\": 5}, \"duration\": 5, \"sample_rate\": 1000}";
    StudyRequest inquiry;
    Outcome *outcome = NULL;
    read_scene(scene, strlen(scene), &inquiry);
    const Simulation *simulation = &inquiry.simulation;
    assert_int_equal(simulation_run(simulation, NULL, NULL, NULL, &outcome, NULL), STATUS_OK);
    const Impacts *impacts = &outcome->response.impacts;
    size_t number = impacts->count;
    assert_true(number > 1);
    assert_int_equal(impacts->at[number - 1].kind, IMPACT_RESTING);
    ImpactHistory closeup = look(simulation, number, 101);
    assert_in_range(closeup.columns.rows, 98, 103);
    const double *force = closeup.columns.at[1].values;
    assert_true(fabs(force[closeup.columns.rows - 1] - 0.1107 * 2) < 1e-6);
    impact_history_clear(&closeup);
    outcome_unref(outcome);
    study_request_clear(&inquiry);
}

static void assert_refused(const Simulation *simulation, size_t number, Status expected,
                           const char *words) {
    ImpactHistory closeup;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(
        impact_history_make(simulation, number, 401, NULL, NULL, NULL, &closeup, &problem),
        expected);
    assert_non_null(strstr(problem.detail, words));
    assert_int_equal(closeup.columns.count, 0);
}

// The run itself is within the limit; with the states of all storeys at each sample it is not.
TEST(more_memory_than_allowed_is_refused) {
    StudyRequest inquiry;
    open_example("paper_free_sponge", &inquiry);
    Simulation *simulation = &inquiry.simulation;
    texts_clear(&simulation->output.channels);
    simulation->scene.sample_rate = 1e5;
    const double bytes = simulation_cost(simulation).bytes;
    const SimulationLimits limits = {.bytes = 1.01 * bytes};
    ImpactHistory closeup;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(
        impact_history_make(simulation, 1, 401, &limits, NULL, NULL, &closeup, &problem),
        STATUS_LIMIT);
    assert_non_null(strstr(problem.detail, "MB are allowed"));
    assert_int_equal(closeup.columns.count, 0);
    study_request_clear(&inquiry);
}

static bool never(void *context, double fraction) {
    (void)context, (void)fraction;
    return false;
}

TEST(what_is_not_there_is_told) {
    StudyRequest inquiry;
    open_example("paper_free_sponge", &inquiry);
    assert_refused(&inquiry.simulation, 0, STATUS_NOT_FOUND, "from 1 to 22");
    assert_refused(&inquiry.simulation, 23, STATUS_NOT_FOUND, "from 1 to 22");
    ImpactHistory closeup;
    const Progress progress = {NULL, never};
    assert_int_equal(
        impact_history_make(&inquiry.simulation, 1, 401, NULL, &progress, NULL, &closeup, NULL),
        STATUS_CANCELLED);
    study_request_clear(&inquiry);
    open_example("paper_free_impulse_sponge", &inquiry);
    assert_refused(&inquiry.simulation, 1, STATUS_NOT_FOUND, "impulse");
    study_request_clear(&inquiry);
    open_example("no_damper", &inquiry);
    assert_refused(&inquiry.simulation, 1, STATUS_NOT_FOUND, "no impacts");
    study_request_clear(&inquiry);
}
