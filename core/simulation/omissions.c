// Savings are parts of what the run would be foretold to cost with the thing in it, in solver steps
// as simulation_cost counts them. What that does not count has weights here, measured beside a
// step: a value written is a tenth of one, a row of the ledger ten, and a sample of flight under a
// moving base three times as much as in closed form.
#include "core/simulation/omissions.h"

#include <math.h>

#include "core/simulation/request_channels.h"

static const double VALUE_STEPS = 0.1, ROW_STEPS = 10, FORCED_SHARE = 2.0 / 3;
static const double SEARCH_SHARE = 0.1; // of a stepping solver's work: what step ends ask of stops
static const double ROWS_A_SECOND = 7;  // of a damper, at a guess
enum { SEGMENT = 4096 };

static double part(double left_out, double remaining) {
    return left_out > 0 ? left_out / (left_out + remaining) : 0;
}

// Of the run as it is asked for.
static double asked_steps(const Simulation *simulation) {
    return simulation_cost(simulation).steps + VALUE_STEPS *
                                                   (double)simulation->output.channels.count *
                                                   (double)scene_sample_count(&simulation->scene);
}

static Status tell_output(const Simulation *simulation, const Plan *plan, Decisions *decisions) {
    const Output *output = &simulation->output;
    const double asked = asked_steps(simulation), samples = (double)plan->count;
    const size_t usual = request_usual_count(&simulation->scene);
    if (output->channels.count < usual) {
        const double values = (double)(usual - output->channels.count) * samples;
        TRY(decisions_omit(
            decisions, "channels", values, "values", part(VALUE_STEPS * values, asked),
            "%zu of the %zu usual channels are asked for", output->channels.count, usual));
    }
    if (output->psd.channels.count == 0) {
        const double length = fmin(SEGMENT, samples), overlap = floor(length / 2);
        const double segments = floor((samples - overlap) / (length - overlap));
        TRY(decisions_omit(decisions, "psd", segments, "segments",
                           part(segments * length / 3, asked), "no spectrum is asked for"));
    }
    if (!output->impacts && plan->damper_count > 0) {
        const double rows = ROWS_A_SECOND * plan->duration * (double)plan->damper_count;
        TRY(decisions_omit(decisions, "impacts", rows, "rows", part(ROW_STEPS * rows, asked),
                           "no ledger is asked for: impacts are counted, not listed"));
    }
    return STATUS_OK;
}

// What writing the samples down does not take.
static double moving_share(const Simulation *simulation) {
    const double asked = asked_steps(simulation), steps = simulation_cost(simulation).steps;
    return asked > 0 ? steps / asked : 0;
}

// What contacts are foretold to cost; a solver that steps takes its steps all the same.
static double contact_steps(const Simulation *simulation, const Solver *solver) {
    if (solver->cost != NULL)
        return SEARCH_SHARE * simulation_cost(simulation).steps;
    Simulation bare = *simulation; // a borrowed view: nothing is cleared
    bare.scene.dampers.count = 0;
    return fmax(simulation_cost(simulation).steps - simulation_cost(&bare).steps, 0);
}

static Status tell_contacts(const Simulation *simulation, const Solver *solver, const Plan *plan,
                            const Regime *regime, Decisions *decisions) {
    if (plan->damper_count == 0)
        return STATUS_OK;
    if (regime == NULL)
        return decisions_add(
            decisions, "contacts", "open", NAN, NULL,
            "whether a mass can reach a stop is looked into when the base's motion "
            "is made");
    if (!regime->is_clear)
        return STATUS_OK;
    return decisions_omit(decisions, "contacts", regime->reach, NULL,
                          part(contact_steps(simulation, solver),
                               asked_steps(simulation) - contact_steps(simulation, solver)),
                          "%s at most %.3g of the way to a stop",
                          plan->damper_count == 1 ? "the mass comes" : "the masses come",
                          regime->reach);
}

Status omissions_tell(const Simulation *simulation, const Solver *solver, const Plan *plan,
                      const Regime *regime, Decisions *decisions) {
    TRY(tell_output(simulation, plan, decisions));
    if (regime != NULL && regime->is_at_rest)
        return decisions_omit(decisions, "motion", 0, "J", moving_share(simulation),
                              "nothing moves and nothing sets it moving");
    TRY(tell_contacts(simulation, solver, plan, regime, decisions));
    // Others step all the same.
    const bool has_closed_form =
        solver == &solver_exact && (plan_is_single(plan) || (regime != NULL && regime->is_clear &&
                                                             plan_is_single_in_flight(plan)));
    if (regime == NULL || !regime->is_unforced || !has_closed_form)
        return STATUS_OK;
    const double samples = (double)plan->count;
    return decisions_omit(
        decisions, "forcing", 0, "m/s^2",
        part(samples * FORCED_SHARE, asked_steps(simulation) - samples * FORCED_SHARE),
        "the base is still: flight goes in closed form");
}
