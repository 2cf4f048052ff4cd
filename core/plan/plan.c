#include "core/plan/plan.h"

#include <stdlib.h>
#include <string.h>

static Identified identify(const Plan *plan, const Buffer *buffer) {
    const double mass = effective_mass(plan->mass, plan->damper_mass);
    if (plan->form == CONTACT_LINEAR)
        return isnan(buffer->stiffness)
                   ? identify_measured(mass, buffer->restitution, buffer->contact_time)
                   : identify_given(mass, buffer->stiffness,
                                    isnan(buffer->damping) ? 0 : buffer->damping);
    return (Identified){.effective_mass = mass,
                        .restitution = buffer->restitution,
                        .contact_time = NAN,
                        .stiffness = NAN,
                        .damping = NAN,
                        .damping_ratio = NAN};
}

static Status derive(Plan *plan, const Damper *damper) {
    DerivedList *list = &plan->report.derived;
    list->at = calloc(2, sizeof *list->at);
    if (list->at == NULL)
        return STATUS_NO_MEMORY;
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        const Identified identified = identify(plan, buffer);
        plan->stops[side] =
            (PlanStop){identified.restitution, identified.stiffness, identified.damping};
        Derived *derived = &list->at[list->count++];
        *derived = (Derived){.damper = 1,
                             .side = side,
                             .restitution = identified.restitution,
                             .contact_time = identified.contact_time,
                             .effective_mass = identified.effective_mass,
                             .stiffness = identified.stiffness,
                             .damping = identified.damping,
                             .damping_ratio = identified.damping_ratio};
        if (buffer->material != NULL && (derived->material = strdup(buffer->material)) == NULL)
            return STATUS_NO_MEMORY;
    }
    return STATUS_OK;
}

static Status decide_contact(const Scene *scene, Plan *plan) {
    Decisions *decisions = &plan->report.decisions;
    const Contact *contact = scene_contact(scene);
    const ContactLaw *law = dampers_contact_law(&scene->dampers, contact);
    plan->form = law->form;
    if (!plan->has_damper)
        return decisions_add(decisions, "contact_model", "none", NAN, NULL,
                             "the scene has no damper");
    if (contact_law(contact)->form != CONTACT_CHOSEN)
        return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                             "the scene asks for it");
    if (law->form == CONTACT_IMPULSIVE)
        return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                             "only restitution is known, no contact time");
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(&scene->dampers.at[0], (Side)side);
        if (!isnan(buffer->contact_time))
            return decisions_add(decisions, "contact_model", law->kind.name, buffer->contact_time,
                                 "s", "a contact time is known");
    }
    return decisions_add(decisions, "contact_model", law->kind.name,
                         damper_buffer(&scene->dampers.at[0], SIDE_LEFT)->stiffness, "N/m",
                         "a contact stiffness is known");
}

static Status plan_fill(const Scene *scene, const char *asked, const char *solver, Plan *plan) {
    const StructureSdof *structure = (const StructureSdof *)(const void *)scene_structure(scene);
    const Excitation *excitation = scene_excitation(scene);
    plan->mass = structure->mass;
    plan->stiffness = structure->stiffness;
    plan->damping = structure_damping(structure);
    plan->displacement = excitation->displacement;
    plan->velocity = excitation->velocity;
    plan->duration = scene->duration;
    plan->sample_rate = scene->sample_rate;
    plan->count = scene_sample_count(scene);
    plan->has_damper = scene->dampers.count > 0;
    TRY(decide_contact(scene, plan));
    TRY(decisions_add(&plan->report.decisions, "solver", solver, NAN, NULL, "%s",
                      strcmp(asked, solver) == 0
                          ? "the scene asks for it"
                          : "every contact state is linear, so its motion is known exactly"));
    if (plan->has_damper) {
        const Damper *damper = &scene->dampers.at[0];
        plan->damper_mass = damper->mass;
        plan->clearance = damper->clearance;
        plan->offset = damper->offset;
        plan->position = damper->position;
        plan->relative_velocity = damper->velocity;
        TRY(derive(plan, damper));
    }
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    plan->report.contact_model = strdup(plan->has_damper ? law->kind.name : "none");
    plan->report.solver = strdup(solver);
    return plan->report.contact_model != NULL && plan->report.solver != NULL ? STATUS_OK
                                                                             : STATUS_NO_MEMORY;
}

Status plan_new(const Scene *scene, const char *asked, const char *solver, Plan **plan,
                Problem *problem) {
    *plan = calloc(1, sizeof **plan);
    const Status status = *plan == NULL ? STATUS_NO_MEMORY : plan_fill(scene, asked, solver, *plan);
    if (status == STATUS_OK)
        return STATUS_OK;
    plan_free(*plan);
    *plan = NULL;
    return problem_set(problem, status, "no memory for the plan");
}

void plan_free(Plan *plan) {
    if (plan == NULL)
        return;
    fields_clear(plan_report_fields, &plan->report);
    free(plan);
}
