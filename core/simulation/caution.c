// Two things a run can leave: the time to which rounding, or the solver's steps, let its trajectory
// be the scene's own, and the approach speeds at which its buffers were measured. The second is
// counted from the ledger, which holds every impact of a run that succeeds.
#include "core/simulation/caution.h"

#include <math.h>
#include <stdio.h>

#include "core/base/side.h"

static Status warn_of_horizon(Outcome *outcome) {
    if (isnan(outcome->summary.trust_horizon))
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/duration",
                        "the run goes on beyond t = %.6g s: there rounding has moved the "
                        "displacement by %g of its largest value, and from there on only "
                        "statistics hold",
                        outcome->summary.trust_horizon, RESPONSE_PARTING);
}

// What steps are wrong by is not rounding's.
static Status warn_of_steps(Outcome *outcome) {
    const Summary *summary = &outcome->summary;
    if (isnan(summary->error_estimate))
        return warnings_add(&outcome->warnings, "/accuracy",
                            "the error of these steps is not known: the run beside this one that "
                            "would tell it came to no end");
    if (summary->error_estimate <= RESPONSE_PARTING)
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/accuracy",
                        "with these steps the displacement is wrong by about %.2g of its largest "
                        "value%s: shorter steps, or the solver exact, are closer",
                        summary->error_estimate,
                        summary->error_estimate > 0.1 ? ", and only statistics hold" : "");
}

// The approach speeds that one stop met.
typedef struct Met {
    size_t count, outside;
    double least, most; // [m/s]
} Met;

static bool is_outside(const ContactRows *rows, double speed) {
    return speed < rows->at[0].approach_speed || speed > rows->at[rows->count - 1].approach_speed;
}

static void meet(Met *met, const ContactRows *rows, double speed) {
    met->least = met->count == 0 ? speed : fmin(met->least, speed);
    met->most = met->count == 0 ? speed : fmax(met->most, speed);
    met->count++;
    met->outside += is_outside(rows, speed);
}

static Status warn_of_stop(const Scene *scene, size_t damper, Side side, const Met *met,
                           Warnings *warnings) {
    const Damper *at = &scene->dampers.at[damper];
    const Buffer *buffer = damper_buffer(at, side);
    const ContactRows *rows = &buffer->table;
    char pointer[64], from[32], to[32];
    if (met->outside == 0)
        return STATUS_OK;
    snprintf(pointer, sizeof pointer, "/dampers/%zu/%s/table", damper,
             buffer == &at->buffer        ? "buffer"
             : buffer == &at->left_buffer ? "left_buffer"
                                          : "right_buffer");
    return warnings_add(
        warnings, pointer,
        "%zu of %zu impacts at the %s stop of damper %zu met it at approach speeds outside the "
        "table's, %s to %s m/s, where the nearest row holds: their speeds were %.6g to %.6g m/s",
        met->outside, met->count, side_names[side], damper + 1,
        text_real(from, rows->at[0].approach_speed),
        text_real(to, rows->at[rows->count - 1].approach_speed), met->least, met->most);
}

static Status warn_of_tables(const Scene *scene, const Impacts *impacts, Warnings *warnings) {
    Met met[SCENE_DAMPERS][2] = {0};
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *impact = &impacts->at[i];
        const size_t damper = (size_t)impact->damper - 1;
        const ContactRows *rows =
            &damper_buffer(&scene->dampers.at[damper], (Side)impact->side)->table;
        // A rest has no approach, and what is resumed keeps the parameters with which it began.
        if (rows->count > 0 && impact->kind == IMPACT_IMPACT && !impact->is_resumed)
            meet(&met[damper][impact->side], rows, impact->approach_speed);
    }
    for (size_t d = 0; d < scene->dampers.count; d++)
        for (int side = 0; side < 2; side++)
            TRY(warn_of_stop(scene, d, (Side)side, &met[d][side], warnings));
    return STATUS_OK;
}

Status caution_warn(const Scene *scene, Outcome *outcome) {
    TRY(outcome->response.is_stepped ? warn_of_steps(outcome) : warn_of_horizon(outcome));
    return warn_of_tables(scene, &outcome->response.impacts, &outcome->warnings);
}
