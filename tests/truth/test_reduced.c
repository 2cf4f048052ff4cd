// A frame with some of its modes against the same reduced system, integrated here mode by mode with
// short steps of Runge and Kutta's: x = sum of phi_k q_k over the modes kept, and a free mass that
// meets the storey so moved. Its modes are found here too, by Jacobi's rotations.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "core/simulation/simulation.h"
#include "core/solve/solver.h"
#include "server/json/parse.h"
#include "tests/support/test.h"

enum { N = 5, SAMPLES = 101, DAMPED = 4 }; // storeys; samples; storey of the damper, from 0
static const double RATE = 50, RATIO = 0.03, TURN = 6.283185307179586;
static const double masses[N] = {900, 1100, 1000, 700, 400};
static const double springs[N] = {4e5, 5e5, 3e5, 3e5, 2e5};
static const double AMPLITUDE = 1.5, FREQUENCY = 1.7;
static const double FREE_MASS = 60, CLEARANCE = 0.02, RESTITUTION = 0.5, CONTACT_TIME = 0.05;

typedef struct Reduced {
    size_t kept;
    double omega[N], shape[N][N], share[N]; // shape[storey][mode]
    double stiffness, damping;              // of a contact; 0: no damper
} Reduced;

// Of M^-1/2 K M^-1/2, rising.
static void find_modes(Reduced *of) {
    double a[N][N] = {{0}}, v[N][N] = {{0}};
    for (size_t i = 0; i < N; i++) {
        v[i][i] = 1;
        a[i][i] = (springs[i] + (i + 1 < N ? springs[i + 1] : 0)) / masses[i];
        if (i > 0)
            a[i][i - 1] = a[i - 1][i] = -springs[i] / sqrt(masses[i] * masses[i - 1]);
    }
    for (int sweep = 0; sweep < 60; sweep++)
        for (size_t p = 0; p < N; p++)
            for (size_t q = p + 1; q < N; q++) {
                if (a[p][q] == 0)
                    continue;
                const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
                const double c = 1 / sqrt(t * t + 1), s = t * c;
                for (size_t k = 0; k < N; k++) {
                    const double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (size_t k = 0; k < N; k++) {
                    const double x = a[p][k], y = a[q][k], vx = v[k][p], vy = v[k][q];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                    v[k][p] = c * vx - s * vy;
                    v[k][q] = s * vx + c * vy;
                }
            }
    for (size_t k = 0; k < N; k++) {
        size_t rank = 0;
        for (size_t j = 0; j < N; j++)
            rank += a[j][j] < a[k][k];
        of->omega[rank] = sqrt(a[k][k]);
        of->share[rank] = 0;
        for (size_t i = 0; i < N; i++) {
            of->shape[i][rank] = v[i][k] / sqrt(masses[i]);
            of->share[rank] += masses[i] * of->shape[i][rank];
        }
    }
}

enum { SIZE = 2 * N + 2 };

static double ground(double t) {
    return AMPLITUDE * sin(TURN * FREQUENCY * t);
}

// y = (q, q', z, z'), z relative to the base.
static double force(const Reduced *of, const double *y) {
    double r = y[2 * N], w = y[2 * N + 1];
    for (size_t k = 0; k < of->kept; k++) {
        r -= of->shape[DAMPED][k] * y[k];
        w -= of->shape[DAMPED][k] * y[N + k];
    }
    const double depth = fabs(r) - CLEARANCE / 2;
    if (!(depth > 0) || of->stiffness == 0)
        return 0;
    return of->stiffness * (r > 0 ? depth : -depth) + of->damping * w;
}

static void rate(const Reduced *of, double t, const double *y, double *out) {
    const double push = force(of, y), base = ground(t);
    memset(out, 0, SIZE * sizeof *out);
    for (size_t k = 0; k < of->kept; k++) {
        out[k] = y[N + k];
        out[N + k] = -2 * RATIO * of->omega[k] * y[N + k] - of->omega[k] * of->omega[k] * y[k] -
                     of->share[k] * base + of->shape[DAMPED][k] * push;
    }
    out[2 * N] = y[2 * N + 1];
    out[2 * N + 1] = -base - push / FREE_MASS;
}

static void step(const Reduced *of, double t, double h, double *y) {
    double slope[4][SIZE], at[SIZE];
    static const double node[4] = {0, 0.5, 0.5, 1};
    for (int range = 0; range < 4; range++) {
        for (size_t i = 0; i < SIZE; i++)
            at[i] = y[i] + (range > 0 ? node[range] * h * slope[range - 1][i] : 0);
        rate(of, t + node[range] * h, at, slope[range]);
    }
    for (size_t i = 0; i < SIZE; i++)
        y[i] += h / 6 * (slope[0][i] + 2 * (slope[1][i] + slope[2][i]) + slope[3][i]);
}

typedef struct Answer {
    double x[N][SAMPLES], v[N][SAMPLES], a[N][SAMPLES], z[SAMPLES];
} Answer;

static void integrate(const Reduced *of, size_t steps, Answer *answer) {
    double y[SIZE] = {0}, now[SIZE];
    const double interval = 1 / RATE, h = interval / (double)steps;
    for (size_t i = 0; i < SAMPLES; i++) {
        const double t = (double)i * interval;
        rate(of, t, y, now);
        answer->z[i] = y[2 * N];
        for (size_t j = 0; j < N; j++) {
            answer->x[j][i] = answer->v[j][i] = 0;
            answer->a[j][i] = ground(t); // absolute: what is left out goes with the base
            for (size_t k = 0; k < of->kept; k++) {
                answer->x[j][i] += of->shape[j][k] * y[k];
                answer->v[j][i] += of->shape[j][k] * y[N + k];
                answer->a[j][i] += of->shape[j][k] * now[N + k];
            }
        }
        for (size_t s = 0; s < steps; s++)
            step(of, t + (double)s * h, h, y);
    }
}

static Outcome *run(const char *accuracy, bool has_contact, double clearance, const char *base) {
    static Problem problem;
    char text[4096], damper[512];
    snprintf(damper, sizeof damper,
             "\"dampers\": [{\"storey\": %d, \"mass\": %.17g, \"clearance\": %.17g, \"buffer\": "
             "{\"restitution\": %.17g, \"contact_time\": %.17g}}], ",
             DAMPED + 1, FREE_MASS, clearance, RESTITUTION, CONTACT_TIME);
    const int length = snprintf(
        text, sizeof text,
        "{\"structure\": {\"kind\": \"frame\", \"masses\": [900, 1100, 1000, 700, 400], "
        "\"stiffnesses\": [4e5, 5e5, 3e5, 3e5, 2e5], \"damping_ratio\": %.17g}, %s"
        "\"excitation\": %s, \"duration\": 2, \"sample_rate\": %.17g, \"accuracy\": {%s}, "
        "\"output\": {\"psd\": null, \"channels\": [%s\"displacement_1\", \"displacement_2\", "
        "\"displacement_3\", \"displacement_4\", \"displacement_5\", \"velocity_1\", "
        "\"velocity_2\", \"velocity_3\", \"velocity_4\", \"velocity_5\", \"acceleration_1\", "
        "\"acceleration_2\", \"acceleration_3\", \"acceleration_4\", \"acceleration_5\"]}}",
        RATIO, has_contact ? damper : "", base, RATE, accuracy,
        has_contact ? "\"damper_displacement_1\", " : "");
    Simulation simulation;
    Outcome *outcome = NULL;
    problem_clear(&problem);
    (void)json_parse(text, (size_t)length, simulation_fields, &simulation, &problem);
    if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.detail, problem.count > 0 ? problem.faults[0].detail : "");
    simulation_clear(&simulation);
    return outcome;
}

static const char sine[] =
    "{\"kind\": \"sine\", \"frequency\": 1.7, \"amplitude\": 1.5}"; // as ground()

// The largest difference over the largest value.
static double miss(const double *values, const double *wanted, size_t rows) {
    double most = 0, size = 0;
    for (size_t i = 0; i < rows; i++) {
        most = fmax(most, fabs(values[i] - wanted[i]));
        size = fmax(size, fabs(wanted[i]));
    }
    return most / size;
}

static double compare(const Outcome *outcome, const Answer *answer, bool has_contact) {
    const Column *at = outcome->response.series.at;
    double most = has_contact ? miss(at++->values, answer->z, SAMPLES) : 0;
    for (size_t j = 0; j < N; j++) {
        most = fmax(most, miss(at[j].values, answer->x[j], SAMPLES));
        most = fmax(most, miss(at[N + j].values, answer->v[j], SAMPLES));
        most = fmax(most, miss(at[2 * N + j].values, answer->a[j], SAMPLES));
    }
    return most;
}

static const struct {
    const char *accuracy;
    double flight, contact; // errors allowed
} solvers_tried[] = {
    {"\"solver\": \"exact\"", 1e-10, 1e-4},
    {"\"solver\": \"auto\"", 1e-10, 1e-4},
    {"\"solver\": \"precise\", \"step\": 2e-5", 1e-6, 2e-3},
    {"\"solver\": \"rk4\", \"step\": 2e-5", 1e-9, 2e-3},
    {"\"solver\": \"newmark\", \"step\": 2e-5", 1e-5, 2e-3},
    {"\"solver\": \"adaptive\", \"tolerance\": 1e-11", 1e-7, 1e-4},
};

TEST(every_solver_moves_the_modes_that_are_kept) {
    static Answer answer;
    Reduced reduced = {.kept = 0};
    find_modes(&reduced);
    for (reduced.kept = 1; reduced.kept <= N; reduced.kept++) {
        integrate(&reduced, 400, &answer);
        for (size_t i = 0; i < sizeof solvers_tried / sizeof *solvers_tried; i++) {
            char accuracy[128];
            snprintf(accuracy, sizeof accuracy, "%s, \"modes\": %zu", solvers_tried[i].accuracy,
                     reduced.kept);
            Outcome *outcome = run(accuracy, false, 0, sine);
            const double error = compare(outcome, &answer, false);
            if (!(error <= solvers_tried[i].flight))
                fail_msg("%s: %.2g", accuracy, error);
            outcome_unref(outcome);
        }
    }
}

TEST(a_free_mass_meets_the_storey_that_they_move) {
    static Answer answer;
    Reduced reduced = {.kept = 0};
    find_modes(&reduced);
    // As for the whole structure: the buffer is what it is.
    const double mass = 1 / (1 / FREE_MASS + 1 / masses[DAMPED]);
    const double half = log(RESTITUTION) / CONTACT_TIME, pi = TURN / 2;
    reduced.stiffness = mass * (pi * pi / (CONTACT_TIME * CONTACT_TIME) + half * half);
    reduced.damping = -2 * mass * half;
    for (reduced.kept = 1; reduced.kept <= N; reduced.kept += 2) {
        integrate(&reduced, 20000, &answer);
        for (size_t i = 0; i < sizeof solvers_tried / sizeof *solvers_tried; i++) {
            char accuracy[128];
            snprintf(accuracy, sizeof accuracy, "%s, \"modes\": %zu", solvers_tried[i].accuracy,
                     reduced.kept);
            Outcome *outcome = run(accuracy, true, CLEARANCE, sine);
            const double error = compare(outcome, &answer, true);
            if (!(error <= solvers_tried[i].contact))
                fail_msg("%s: %.2g", accuracy, error);
            assert_true(outcome->summary.impacts > 2);
            if (i < 2)
                assert_true(outcome->summary.energy_residual < 1e-12);
            outcome_unref(outcome);
        }
    }
}

TEST(a_mass_that_meets_nothing_stays_where_it_is) {
    for (size_t i = 0; i < sizeof solvers_tried / sizeof *solvers_tried; i++) {
        char accuracy[128];
        snprintf(accuracy, sizeof accuracy, "%s, \"modes\": 2", solvers_tried[i].accuracy);
        Outcome *outcome = run(accuracy, true, 100, sine);
        const double *z = outcome->response.series.at[0].values, turning = TURN * FREQUENCY;
        for (size_t k = 0; k < SAMPLES; k++) {
            const double t = (double)k / RATE;
            const double wanted = AMPLITUDE / turning * (sin(turning * t) / turning - t);
            assert_true(fabs(z[k] - wanted) <= 1e-5 * AMPLITUDE / turning);
        }
        assert_true(outcome->summary.energy_residual < 1e-4);
        outcome_unref(outcome);
    }
}

// Peaks and rms are of all storeys, and of the same motion as the samples.
TEST(the_summary_is_of_the_same_motion) {
    static const char *const bases[] = {
        sine,
        "{\"kind\": \"random\", \"band\": [0, 20], \"rms\": 1}",
        "{\"kind\": \"half_sine\", \"amplitude\": 1, \"length\": 0.3}",
        "{\"displacement\": [0.01, 0, 0, 0.02, 0]}",
    };
    for (size_t b = 0; b < sizeof bases / sizeof *bases; b++)
        for (int has_contact = 0; has_contact < 2; has_contact++) {
            Outcome *outcome = run("\"modes\": 2", has_contact, CLEARANCE, bases[b]);
            const Column *at = outcome->response.series.at + (has_contact != 0);
            const Summary *summary = &outcome->summary;
            double peaks[2] = {0}, rms[2] = {0};
            for (size_t j = 0; j < N; j++)
                for (int i = 0; i < 2; i++) {
                    const double *values = at[(i == 0 ? 0 : 2 * N) + j].values;
                    double sum = 0;
                    for (size_t k = 0; k < SAMPLES; k++) {
                        peaks[i] = fmax(peaks[i], fabs(values[k]));
                        sum += values[k] * values[k];
                    }
                    rms[i] = fmax(rms[i], sqrt(sum / SAMPLES));
                }
            assert_true(fabs(summary->rms_displacement - rms[0]) <= 1e-12 * rms[0]);
            assert_true(fabs(summary->rms_acceleration - rms[1]) <= 1e-12 * rms[1]);
            assert_true(summary->peak_displacement >= peaks[0] * (1 - 1e-12));
            assert_true(summary->peak_acceleration >= peaks[1] * (1 - 1e-12));
            if (has_contact == 0) { // no events: peaks are samples'
                assert_true(summary->peak_displacement <= peaks[0] * (1 + 1e-12));
                assert_true(summary->peak_acceleration <= peaks[1] * (1 + 1e-12));
            }
            assert_true(summary->energy_residual < 1e-12);
            assert_true(summary->error_estimate > 1e-4);
            outcome_unref(outcome);
        }
}

// Three equal masses on a line, pushed alike, with a damper in the middle: the mode (1, 0, -1) is
// seen by none of these.
static size_t run_line(bool is_cut, double *values, size_t *impacts) {
    static Problem problem;
    static const char text[] =
        "{\"structure\": {\"kind\": \"matrices\", \"mass\": [[10, 0, 0], [0, 10, 0], [0, 0, 10]], "
        "\"stiffness\": [[2000, -1000, 0], [-1000, 2000, -1000], [0, -1000, 2000]], \"damping\": "
        "[[4, -1, 0], [-1, 3, -1], [0, -1, 4]]}, \"dampers\": [{\"storey\": 2, \"mass\": 1, "
        "\"clearance\": 0.01, \"buffer\": {\"restitution\": 0.5, \"contact_time\": 0.01}}], "
        "\"excitation\": {\"kind\": \"sine\", \"frequency\": 1.7, \"amplitude\": 1.5}, "
        "\"duration\": 2, \"sample_rate\": 50}";
    const Base base = {.form = BASE_SINE, .amplitude = AMPLITUDE, .omega = TURN * FREQUENCY};
    Simulation simulation;
    Response response = {0};
    RunColumn columns[4];
    Plan *plan;
    problem_clear(&problem);
    (void)json_parse(text, strlen(text), simulation_fields, &simulation, &problem);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(plan_new(&simulation.scene, "exact", "exact", &plan, &problem), STATUS_OK);
    if (is_cut)
        assert_int_equal(plan_keep(plan, &simulation.scene, 0, NULL, &problem), STATUS_OK);
    for (size_t i = 0; i < 4; i++)
        columns[i] = (RunColumn){i < 3 ? CHANNEL_ACCELERATION : CHANNEL_CONTACT_FORCE,
                                 i < 3 ? i : 0, values + i * SAMPLES};
    Run run_of = {.plan = plan, .base = &base, .columns = columns, .column_count = 4};
    assert_int_equal(solver_exact.run(&solver_exact, &run_of, &response, &problem), STATUS_OK);
    const size_t modes = plan->modes.count;
    *impacts = response.impacts.count;
    response_clear(&response);
    plan_free(plan);
    simulation_clear(&simulation);
    return modes;
}

TEST(a_mode_that_nothing_sees_makes_no_difference) {
    static double all[4 * SAMPLES], seen[4 * SAMPLES];
    size_t impacts[2];
    assert_int_equal(run_line(false, all, &impacts[0]), 3);
    assert_int_equal(run_line(true, seen, &impacts[1]), 2);
    assert_true(impacts[0] > 5 && impacts[0] == impacts[1]);
    for (size_t i = 0; i < 4; i++)
        assert_true(miss(seen + i * SAMPLES, all + i * SAMPLES, SAMPLES) < 1e-10);
}

TEST(fewer_modes_are_fewer_steps) {
    for (int has_contact = 0; has_contact < 2; has_contact++) {
        double last = INFINITY;
        for (size_t kept = N; kept > 0; kept--) {
            char accuracy[32];
            snprintf(accuracy, sizeof accuracy, "\"modes\": %zu", kept);
            Outcome *outcome = run(accuracy, has_contact, 100, sine);
            assert_true(outcome->steps > 0 && outcome->steps < last);
            last = outcome->steps;
            outcome_unref(outcome);
        }
    }
}
