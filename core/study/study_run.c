#include "core/study/study_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/accuracy_target.h"
#include "core/solve/solvers.h"

Status study_run_copy(const Simulation *simulation, Simulation *target, Problem *problem) {
    if (fields_copy(simulation_fields, simulation, target) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of the study");
    Texts *sampled = &target->output.channels;
    for (size_t i = 0; i < sampled->count; i++)
        free(sampled->at[i]);
    free(sampled->at);
    *sampled = (Texts){NULL, 0};
    return STATUS_OK;
}

Status study_run_fix_solver(Simulation *target, Problem *problem) {
    if (!aim_is_asked(target))
        return STATUS_OK;
    Variant *accuracy = variant_new(solver_kinds.at(0));
    if (accuracy == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of the study");
    variant_free(target->accuracy);
    target->accuracy = accuracy;
    ((AccuracyAuto *)(void *)accuracy)->metric = CHOICE_ABSENT; // as a completed scene has it
    return STATUS_OK;
}

bool study_run_has_force(const Simulation *simulation) {
    const Scene *scene = &simulation->scene;
    return scene->dampers.count > 0 &&
           dampers_contact_law(&scene->dampers, scene_contact(scene))->form != CONTACT_IMPULSIVE;
}

char *study_run_why(const Problem *fault) {
    char text[sizeof(Fault)];
    if (fault->count > 0)
        snprintf(text, sizeof text, "%s: %s", fault->faults[0].pointer, fault->faults[0].detail);
    else
        snprintf(text, sizeof text, "%s", fault->detail);
    return strdup(text);
}

// What the fold needs; the ledger and all else goes at once.
static void study_run_keep(Outcome *outcome, StudyPart *part) {
    part->steps = outcome->steps;
    part->summary = outcome->summary;
    part->spectrum = outcome->spectrum;
    outcome->spectrum = (Spectrum){0};
    outcome_unref(outcome);
}

Status study_run_make(const Simulation *member, const StudyTools *tools, StudyPart *part,
                      Problem *problem) {
    Outcome *outcome = NULL;
    *part = (StudyPart){.steps = (double)NAN};
    (void)fields_default(summary_fields, &part->summary); // absent: nothing to allocate
    part->status =
        simulation_run(member, tools->limits, tools->progress, tools->workspace, &outcome, problem);
    if (part->status == STATUS_OK) {
        study_run_keep(outcome, part);
        return STATUS_OK;
    }
    if (study_run_ends_all(part->status))
        return part->status;
    part->why = study_run_why(problem);
    problem_clear(problem);
    return part->why != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of the study");
}

void study_run_clear(StudyPart *part) {
    free(part->why);
    spectrum_clear(&part->spectrum);
    *part = (StudyPart){.why = NULL};
}
