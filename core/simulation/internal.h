// Functions shared by the files of core/simulation. Calls go from dispatch.c down to
// accuracy_target.c, run.c, cost_model.c and validate.c, never up.
#ifndef CORE_SIMULATION_INTERNAL_H
#define CORE_SIMULATION_INTERNAL_H

#include "core/simulation/simulation.h"
#include "core/solve/exact.h"

enum { SPECTRUM_SEGMENT = 4096 }; // default length [samples]

// The solver that runs: "auto" is exact.
static inline const Solver *simulation_solver(const Simulation *simulation) {
    const Solver *solver = (const Solver *)(const void *)simulation->accuracy->kind;
    return solver->run != NULL ? solver : &solver_exact;
}

// Settings of the solver that runs; NULL: its defaults, since those of "auto" are not its own.
static inline const Accuracy *simulation_settings(const Simulation *simulation) {
    const Variant *accuracy = simulation->accuracy;
    return accuracy->kind == &simulation_solver(simulation)->kind
               ? (const Accuracy *)(const void *)accuracy
               : NULL;
}

// Number of modes that a run keeps.
static inline size_t simulation_modes(const Simulation *simulation, size_t storeys) {
    return accuracy_modes((const Accuracy *)(const void *)simulation->accuracy, storeys);
}

// Interval between the samples of the base motion; 0: it has a closed form [s].
static inline double simulation_base_interval(const Simulation *simulation) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    return kind->interval == NULL ? 0 : kind->interval(excitation);
}

static inline const ContactLaw *simulation_law(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    return dampers_contact_law(&scene->dampers, scene_contact(scene));
}

// simulation_complete without a check of the cost and without warnings of implausible values.
Status simulation_validate(Simulation *simulation, const SimulationLimits *limits,
                           Warnings *warnings, Problem *problem);

enum { CHANNEL_NAME = 64 };

// The one name of a channel in a completed scene; `number` is that of the storey or damper, from 1.
void channel_names_write(const Scene *scene, ChannelId channel, size_t number,
                         char target[CHANNEL_NAME]);

// Replaces CHANNEL_USUAL by the names of the default channels, or of the default spectrum's one,
// and validates all names; their pointers are below `pointer`. Names are not compared with the
// numbers of storeys and dampers where a fault leaves these unknown.
Status channel_names_complete(const Scene *scene, Texts *names, bool is_spectrum,
                              const char *pointer, Problem *problem);

// Number of channels that CHANNEL_USUAL stands for in a completed scene.
size_t channel_names_usual_count(const Scene *scene);

// Warns of implausible values of a completed simulation. STATUS_OK or STATUS_NO_MEMORY.
Status scene_warnings_of_input(const Simulation *simulation, Warnings *warnings);
// Adds to the outcome the warnings that depend on its response and summary. Same status.
Status scene_warnings_of_result(const Scene *scene, const DerivedList *derived, Outcome *outcome);

// Plan, cost and run of a completed simulation that has no accuracy target. `output.reduction` is
// ignored.
Status plan_scene(const Simulation *simulation, PlanReport *report, Problem *problem);
Cost cost_scene(const Simulation *simulation);
double cost_step(const Simulation *simulation);       // steps for one that the solver counts
double cost_truncation(const Simulation *simulation); // steps to predict the error of fewer modes
double cost_spectra(const SpectrumRequest *psd, size_t samples); // predicted steps

// Plan and base motion of a run.
typedef struct RunInputs {
    Plan *plan; // its report has moved to the outcome
    Base base;
    bool has_base; // it was made
} RunInputs;

// `inputs`, if not NULL, receives the plan and base of the run, also after a failure. They are
// cleared by run_inputs_clear. If it has a base already, the run uses that.
Status run_scene(const Simulation *simulation, const SimulationLimits *limits,
                 const Progress *progress, Workspace *workspace, RunInputs *inputs,
                 Outcome **outcome, Problem *problem);
void run_inputs_clear(RunInputs *inputs);

// The same of a simulation with an accuracy target.
Status accuracy_target_plan(const Simulation *simulation, PlanReport *report, Problem *problem);
Cost accuracy_target_cost(const Simulation *simulation);
// `settled`, if not NULL, receives the simulation with the settings of the last run and without a
// target. It is cleared by simulation_clear, also after a failure.
Status accuracy_target_run(const Simulation *simulation, const SimulationLimits *limits,
                           const Progress *progress, Workspace *workspace, Simulation *settled,
                           Outcome **outcome, Problem *problem);

#endif
