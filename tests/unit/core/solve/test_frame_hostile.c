// Frames from the edges of what doubles hold: every run ends, with an answer or a reason.
#include <math.h>
#include <stdlib.h>

#include "core/solve/exact.h"
#include "core/solve/solver.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

enum { RUNS = IMPACTD_SANITIZED ? 200 : 500 };

static uint64_t seed = 1;
static double uniform(double a, double b) {
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    return a + (b - a) * (double)(seed >> 11) * 0x1p-53;
}

// Any magnitude, often an ordinary one.
static double any(void) {
    return uniform(0, 1) < 0.7 ? pow(10, uniform(-2, 2)) : pow(10, uniform(-300, 300));
}

static Plan *draw(void) {
    const size_t n = 1 + (size_t)uniform(0, 4), m = (size_t)uniform(0, 4);
    Plan *plan = frames_new(n, m, 0.2, uniform(0, 1) < 0.2 ? any() : 200);
    plan->count = (size_t)fmin(plan->duration * plan->sample_rate, 200) + 1;
    plan->duration = fmin(plan->duration, 200 / plan->sample_rate);
    double mass[5], stiffness[5], damping[5];
    for (size_t i = 0; i < n; i++) {
        mass[i] = any();
        stiffness[i] = uniform(0, 1) < 0.2 ? 0 : 1000 * any();
        damping[i] = uniform(0, 1) < 0.3 ? 0 : any();
    }
    frames_shear(plan, mass, stiffness, damping);
    for (size_t d = 0; d < m; d++) {
        frames_damper(plan, d, (size_t)uniform(0, (double)n), any(),
                      uniform(0, 1) < 0.2 ? 0 : 0.01 * any(),
                      uniform(0, 1) < 0.2 ? 1 : uniform(0, 1), 0.01 * any());
        plan->dampers[d].velocity = uniform(0, 1) < 0.5 ? 0 : any();
        plan->dampers[d].position = uniform(-0.5, 0.5) * plan->dampers[d].clearance;
    }
    plan->form = uniform(0, 1) < 0.5 ? CONTACT_IMPULSIVE : CONTACT_LINEAR;
    plan->separation = uniform(0, 1) < 0.5 ? SEPARATION_ZERO_FORCE : SEPARATION_ZERO_PENETRATION;
    for (size_t i = 0; i < n; i++) {
        plan->displacement[i] = uniform(-0.01, 0.01) * any();
        plan->velocity[i] = uniform(-0.1, 0.1) * any();
    }
    return plan;
}

// How many of RUNS scenes a solver answers; the others it must refuse in words.
static void run_all(const Solver *solver, double steps_max, size_t *answered, size_t *refused) {
    seed = 1;
    *answered = *refused = 0;
    for (int i = 0; i < RUNS; i++) {
        Plan *plan = draw();
        double values[7] = {0};
        Base base = {.form = i % 3 == 0 ? BASE_STILL : i % 3 == 1 ? BASE_SINE : BASE_SAMPLED};
        base.amplitude = any();
        base.omega = base.form == BASE_SINE ? any() : 0;
        for (size_t k = 0; k < 7; k++)
            values[k] = uniform(-1, 1) * base.amplitude;
        if (base.form == BASE_SAMPLED) {
            base.values = values;
            base.count = 7;
            base.interval = uniform(0, 1) < 0.5 ? 1 / plan->sample_rate : 0.013;
        }
        Run run = {.plan = plan, .base = &base, .steps_max = steps_max, .impacts_max = 5000};
        Response response = {0};
        Problem problem;
        problem_clear(&problem);
        const Status status = solver == NULL ? exact_run_engine(&run, &response, &problem)
                                             : solver->run(solver, &run, &response, &problem);
        if (status == STATUS_OK) {
            ++*answered;
            if (!isfinite(response.energy.kinetic + response.energy.strain))
                fail_msg("scene %d: energies %g %g, %zu samples %g s rate %g", i,
                         response.energy.kinetic, response.energy.strain, plan->count,
                         plan->duration, plan->sample_rate);
        } else {
            ++*refused;
            if (status != STATUS_UNSTABLE && status != STATUS_LIMIT)
                fail_msg("scene %d: %s", i, problem.detail);
            assert_true(problem.detail[0] != '\0');
        }
        response_clear(&response);
        plan_free(plan);
    }
}

TEST(extreme_frames_end_with_an_answer_or_a_reason) {
    size_t answered, refused;
    run_all(NULL, 20000, &answered, &refused);
    assert_true(answered > RUNS / 5);
    assert_true(refused > RUNS / 70);
}

TEST(so_they_do_by_every_solver_that_steps) {
    for (const Solver *const *solver = solvers; *solver != NULL; solver++) {
        if ((*solver)->run == NULL || *solver == &solver_exact)
            continue;
        size_t answered, refused;
        run_all(*solver, 900000, &answered, &refused);
        assert_true(answered > RUNS / 6);
        assert_true(refused > RUNS / 70);
    }
}
