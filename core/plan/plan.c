#include "core/plan/plan.h"

#include <stdlib.h>
#include <string.h>

static Identified identify(const Plan *plan, double mass, const Buffer *buffer) {
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

// The stops' parameters of one damper, into the plan and its report.
static Status derive(Plan *plan, size_t index, const Damper *damper) {
    DerivedList *list = &plan->report.derived;
    PlanDamper *planned = &plan->dampers[index];
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        const Identified identified = identify(plan, planned->effective_mass, buffer);
        planned->stops[side] =
            (PlanStop){identified.restitution, identified.stiffness, identified.damping};
        Derived *derived = &list->at[list->count++];
        *derived = (Derived){.damper = index + 1,
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
    const ContactLaw *law = plan->law;
    if (plan->damper_count == 0)
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

// Room for matrices, vectors and dampers; one block each, so that plan_free need not know sizes.
static Status plan_room(Plan *plan, size_t storeys, size_t dampers) {
    plan->storeys = storeys;
    plan->mass = calloc(storeys, (3 * storeys + 3) * sizeof *plan->mass);
    plan->dampers = calloc(dampers > 0 ? dampers : 1, sizeof *plan->dampers);
    plan->report.derived.at =
        calloc(dampers > 0 ? 2 * dampers : 1, sizeof *plan->report.derived.at);
    if (plan->mass == NULL || plan->dampers == NULL || plan->report.derived.at == NULL)
        return STATUS_NO_MEMORY;
    plan->stiffness = plan->mass + storeys * storeys;
    plan->damping = plan->stiffness + storeys * storeys;
    plan->influence = plan->damping + storeys * storeys;
    plan->displacement = plan->influence + storeys;
    plan->velocity = plan->displacement + storeys;
    return STATUS_OK;
}

static Status plan_damper(Plan *plan, size_t index, const Damper *damper) {
    const size_t storey = (size_t)damper->storey - 1;
    plan->dampers[index] = (PlanDamper){
        .storey = storey,
        .mass = damper->mass,
        .effective_mass = effective_mass(plan->mass[storey * plan->storeys + storey], damper->mass),
        .clearance = damper->clearance,
        .offset = damper->offset,
        .position = damper->position,
        .velocity = damper->velocity,
    };
    plan->damper_count = index + 1;
    return derive(plan, index, damper);
}

static Status plan_fill(const Scene *scene, const char *asked, const char *solver, Plan *plan) {
    const StructureSdof *structure = (const StructureSdof *)(const void *)scene_structure(scene);
    const Excitation *excitation = scene_excitation(scene);
    TRY(plan_room(plan, 1, scene->dampers.count));
    plan->mass[0] = structure->mass;
    plan->stiffness[0] = structure->stiffness;
    plan->damping[0] = structure_damping(structure);
    plan->influence[0] = 1;
    plan->displacement[0] = excitation->displacement;
    plan->velocity[0] = excitation->velocity;
    plan->duration = scene->duration;
    plan->sample_rate = scene->sample_rate;
    plan->count = scene_sample_count(scene);
    plan->law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    plan->form = plan->law->form;
    for (size_t i = 0; i < scene->dampers.count; i++)
        TRY(plan_damper(plan, i, &scene->dampers.at[i]));
    TRY(decide_contact(scene, plan));
    TRY(decisions_add(&plan->report.decisions, "solver", solver, NAN, NULL, "%s",
                      strcmp(asked, solver) == 0
                          ? "the scene asks for it"
                          : "every contact state is linear, so its motion is known exactly"));
    plan->report.contact_model = strdup(plan->damper_count > 0 ? plan->law->kind.name : "none");
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
    free(plan->mass);
    free(plan->dampers);
    free(plan);
}
