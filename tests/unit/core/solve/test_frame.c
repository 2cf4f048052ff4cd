// The general engine against the single one: a frame of one storey is the paper's structure.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/math/fourier.h"
#include "core/solve/frame.h"
#include "tests/support/paper.h"

enum { CHANNELS = 7 };
static const ChannelId wanted[CHANNELS] = {
    CHANNEL_DISPLACEMENT,        CHANNEL_VELOCITY,        CHANNEL_ACCELERATION,
    CHANNEL_MEAN_ACCELERATION,   CHANNEL_DAMPER_VELOCITY, CHANNEL_DAMPER_DISPLACEMENT,
    CHANNEL_CONTACT_FORCE};

typedef struct Answer {
    double *values;
    size_t count;
    Response response;
    double steps;
} Answer;

static Answer run(Simulation *simulation, Status (*solve)(Run *, Response *, Problem *)) {
    Problem problem;
    problem_clear(&problem);
    Plan *plan;
    Base base = {0};
    Answer answer = {0};
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const Span span = {simulation->scene.duration, simulation->scene.sample_rate, 0};
    assert_int_equal(plan_new(&simulation->scene, "exact", "exact", &plan, &problem), STATUS_OK);
    assert_int_equal(excitation_kind(excitation)->make(excitation, &span, NULL, &base, &problem),
                     STATUS_OK);
    answer.count = plan->count;
    answer.values = calloc(CHANNELS * plan->count, sizeof *answer.values);
    assert_non_null(answer.values);
    RunColumn columns[CHANNELS];
    for (size_t i = 0; i < CHANNELS; i++)
        columns[i] = (RunColumn){wanted[i], 0, answer.values + i * plan->count};
    Run with = {.plan = plan, .base = &base, .columns = columns, .column_count = CHANNELS};
    const Status status = solve(&with, &answer.response, &problem);
    if (status != STATUS_OK)
        fail_msg("%s", problem.detail);
    answer.steps = with.steps;
    plan_free(plan);
    base_clear(&base);
    return answer;
}

static void answer_clear(Answer *answer) {
    free(answer->values);
    response_clear(&answer->response);
}

static double scale(const double *values, size_t count) {
    double most = 0;
    for (size_t i = 0; i < count; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}

int main(void) {
    fourier_start();
    for (int b = 0; b < 5; b++)
        for (int model = 0; model < 2; model++)
            for (int base = 0; base < 3; base++) {
                Simulation simulation;
                Warnings warnings = {0};
                paper_scene(&simulation, paper_buffers[b].restitution, paper_buffers[b].contact_time, 5);
                paper_model(&simulation, model == 0 ? "spring_damper" : "impulse");
                if (base == 1) paper_random(&simulation, 1, 1);
                if (base == 2) paper_sine(&simulation, 1, 1);
                assert_int_equal(simulation_complete(&simulation, NULL, &warnings, NULL), STATUS_OK);
                Answer one = run(&simulation, solver_exact.run), other = run(&simulation, frame_run);
                printf("%s %d %d: impacts %zu %zu steps %.0f %.0f res %.1e %.1e:", paper_buffers[b].name, model, base, one.response.impacts.count,
                       other.response.impacts.count, one.steps, other.steps, one.response.energy.residual, other.response.energy.residual);
                for (size_t c = 0; c < CHANNELS; c++) {
                    double most = 0;
                    for (size_t i = 0; i < one.count; i++)
                        most = fmax(most, fabs(one.values[c * one.count + i] - other.values[c * one.count + i]));
                    printf(" %.1e", most / scale(one.values + c * one.count, one.count));
                }
                printf("\n");
                answer_clear(&one);
                answer_clear(&other);
                simulation_clear(&simulation);
                warnings_clear(&warnings);
            }
    return 0;
}
