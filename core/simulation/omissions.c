// Savings are parts of what the run would be foretold to cost with the thing in it: differences of
// simulation_cost between the simulation as it is asked for and one with more or less. What that
// does not tell apart has shares here, as measured: closed form takes a third of flight under a
// moving base, a row of the ledger a tenth of its contact, and what step ends ask of stops a tenth
// of a step.
#include "core/simulation/omissions.h"

#include <math.h>

#include "core/simulation/channel_names.h"

static const double FORCED_SHARE = 2.0 / 3, ROW_SHARE = 0.1, SEARCH_SHARE = 0.1;
static const double ROWS_A_SECOND = 7; // of a damper, at a guess
enum { SEGMENT = 4096 };

static double part(double left_out, double remaining) {
    return left_out > 0 ? left_out / (left_out + fmax(remaining, 0)) : 0;
}

// The usual spectrum's segments, where none is asked for.
static void add_psd(Simulation *view) {
    const size_t count = scene_sample_count(&view->scene);
    SpectrumRequest *psd = &view->output.psd;
    psd->channels.count = 1;
    psd->segment = count < SEGMENT ? count : SEGMENT;
    psd->overlap = psd->segment / 2;
}

// Views borrow all from the simulation, and nothing of them is cleared.
static double steps_of(const Simulation *view) {
    return simulation_cost(view).steps;
}

static double steps_with_channels(const Simulation *simulation, size_t count) {
    Simulation view = *simulation;
    view.output.channels.count = count;
    return steps_of(&view);
}

// Of flight alone.
static double flight_steps(const Simulation *simulation) {
    Simulation view = *simulation;
    view.output.channels.count = view.output.psd.channels.count = view.scene.dampers.count = 0;
    return steps_of(&view);
}

// What contacts are foretold to cost; a solver that steps takes its steps all the same.
static double contact_steps(const Simulation *simulation, const Solver *solver) {
    if (solver->cost != NULL)
        return SEARCH_SHARE * steps_of(simulation);
    Simulation view = *simulation;
    view.scene.dampers.count = 0;
    return fmax(steps_of(simulation) - steps_of(&view), 0);
}

static Status tell_output(const Simulation *simulation, const Solver *solver, const Plan *plan,
                          Decisions *decisions) {
    const Output *output = &simulation->output;
    const size_t usual = request_usual_count(&simulation->scene);
    if (output->channels.count < usual) {
        const double asked = steps_of(simulation);
        const double saved = steps_with_channels(simulation, usual) - asked;
        TRY(decisions_omit(decisions, "channels",
                           (double)(usual - output->channels.count) * (double)plan->count, "values",
                           part(saved, asked), "%zu of the %zu usual channels are asked for",
                           output->channels.count, usual));
    }
    if (output->psd.channels.count == 0) {
        Simulation view = *simulation;
        add_psd(&view);
        const SpectrumRequest *psd = &view.output.psd;
        const double asked = steps_of(simulation);
        TRY(decisions_omit(
            decisions, "psd",
            floor((double)(plan->count - psd->overlap) / (double)(psd->segment - psd->overlap)),
            "segments", part(steps_of(&view) - asked, asked), "no spectrum is asked for"));
    }
    if (!output->impacts && plan->damper_count > 0)
        TRY(decisions_omit(
            decisions, "impacts", ROWS_A_SECOND * plan->duration * (double)plan->damper_count,
            "rows", part(ROW_SHARE * contact_steps(simulation, solver), steps_of(simulation)),
            "no ledger is asked for: impacts are counted, not listed"));
    return STATUS_OK;
}

// What writing the samples down does not take.
static double moving_share(const Simulation *simulation) {
    const double asked = steps_of(simulation);
    return part(steps_with_channels(simulation, 0), asked - steps_with_channels(simulation, 0));
}

static Status tell_contacts(const Simulation *simulation, const Solver *solver, const Plan *plan,
                            const Regime *regime, Decisions *decisions) {
    if (plan->damper_count == 0)
        return STATUS_OK;
    if (regime == NULL)
        return decisions_add(decisions, "contacts", "open", NAN, NULL,
                             "whether a mass can reach a stop is looked into when the base's "
                             "motion is made");
    if (!regime->is_clear)
        return STATUS_OK;
    const double saved = contact_steps(simulation, solver);
    return decisions_omit(
        decisions, "contacts", regime->reach, NULL, part(saved, steps_of(simulation) - saved),
        "%s at most %.3g of the way to a stop",
        plan->damper_count == 1 ? "the mass comes" : "the masses come", regime->reach);
}

Status omissions_tell(const Simulation *simulation, const Solver *solver, const Plan *plan,
                      const Regime *regime, Decisions *decisions) {
    TRY(tell_output(simulation, solver, plan, decisions));
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
    const double saved = FORCED_SHARE * flight_steps(simulation);
    return decisions_omit(decisions, "forcing", 0, "m/s^2",
                          part(saved, steps_of(simulation) - saved),
                          "the base is still: flight goes in closed form");
}
