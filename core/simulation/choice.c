#include "core/simulation/choice.h"

#include <stddef.h>

#include "core/solve/solvers.h"

const Solver *choice_solver(const Simulation *simulation) {
    const Solver *solver = (const Solver *)(const void *)simulation->accuracy->kind;
    return solver->run != NULL ? solver : &solver_exact;
}

const Accuracy *choice_common(const Simulation *simulation) {
    return (const Accuracy *)(const void *)simulation->accuracy;
}

// What the chosen solver is asked for; the settings of "auto" are not the chosen one's.
const Accuracy *choice_settings(const Simulation *simulation) {
    const Variant *accuracy = simulation->accuracy;
    return accuracy->kind == &choice_solver(simulation)->kind
               ? (const Accuracy *)(const void *)accuracy
               : NULL;
}

double choice_base_interval(const Simulation *simulation) {
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    return kind->interval == NULL ? 0 : kind->interval(excitation);
}
