// What a run can leave: the error of modes that it left out; the time to which rounding, or the
// solver's steps, let its trajectory be the scene's own, and the approach speeds at which its
// buffers were measured. The second is counted by the ledger, of every impact of a run that
// succeeds.
#include "core/simulation/caution.h"

#include <math.h>
#include <stdio.h>

#include "core/base/side.h"

// The scene asked for it; the number is foretold, and dampers can make more of it.
static Status warn_of_modes(Outcome *outcome) {
    const double error = outcome->response.given_up;
    if (!(error > RESPONSE_PARTING))
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/accuracy/modes",
                        "with the modes left out the displacement is wrong by up to %.2g of its "
                        "largest value%s: more modes are closer",
                        error, error > 0.1 ? ", and only statistics hold" : "");
}

static Status warn_of_horizon(Outcome *outcome) {
    if (isnan(outcome->summary.trust_horizon) || outcome->response.given_up > RESPONSE_PARTING)
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
    const double error = summary->error_estimate - outcome->response.given_up;
    if (error <= RESPONSE_PARTING)
        return STATUS_OK;
    return warnings_add(&outcome->warnings, "/accuracy",
                        "with these steps the displacement is wrong by about %.2g of its largest "
                        "value%s: shorter steps, a smaller tolerance, or the solver exact "
                        "without one, are closer",
                        error, error > 0.1 ? ", and only statistics hold" : "");
}

static Status warn_of_stop(const Scene *scene, size_t damper, Side side, const Approaches *met,
                           Warnings *warnings) {
    const Damper *at = &scene->dampers.at[damper];
    const Buffer *buffer = damper_buffer(at, side);
    char pointer[64], from[32], to[32];
    if (met->outside == 0)
        return STATUS_OK;
    snprintf(pointer, sizeof pointer, "/dampers/%zu/%s/table", damper,
             buffer == &at->buffer        ? "buffer"
             : buffer == &at->left_buffer ? "left_buffer"
                                          : "right_buffer");
    return warnings_add(
        warnings, pointer,
        "%llu of %llu impacts at the %s stop of damper %zu met it at approach speeds outside the "
        "table's, %s to %s m/s, where the nearest row holds: their speeds were %.6g to %.6g m/s",
        (unsigned long long)met->outside, (unsigned long long)met->count, side_names[side],
        damper + 1, text_real(from, met->from), text_real(to, met->to), met->least, met->most);
}

static Status warn_of_tables(const Scene *scene, const Approaches *met, Warnings *warnings) {
    for (size_t i = 0; met != NULL && i < 2 * scene->dampers.count; i++)
        TRY(warn_of_stop(scene, i / 2, (Side)(i % 2), &met[i], warnings));
    return STATUS_OK;
}

Status caution_warn(const Scene *scene, Outcome *outcome) {
    TRY(warn_of_modes(outcome));
    TRY(outcome->response.is_stepped ? warn_of_steps(outcome) : warn_of_horizon(outcome));
    return warn_of_tables(scene, outcome->response.approaches, &outcome->warnings);
}
