#include "core/plan/plan.h"

#include <stdlib.h>
#include <string.h>

// What an isolated contact of this pair of masses comes to, if that is one thing at all speeds.
static void report_parameters(const ContactStop *stop, double mass, Derived *derived) {
    const ContactParameters *own = &stop->parameters;
    const bool is_carried = stop->mass != mass;
    derived->effective_mass = mass;
    derived->identified_mass = is_carried ? stop->mass : (double)NAN;
    derived->restitution = own->restitution;
    derived->contact_time = stop->numbers.contact_time;
    derived->stiffness =
        stop->law->form == CONTACT_POWER ? stop->numbers.stiffness : own->stiffness;
    derived->damping = own->damping;
    derived->exponent = own->exponent;
    derived->damping_ratio = derived->factor = (double)NAN;
    derived->reached_restitution = derived->reached_contact_time = (double)NAN;
    if (stop->law->form == CONTACT_IMPULSIVE || stop->numbers.rows.count > 0)
        return;
    if (stop->law->form == CONTACT_POWER) {
        derived->factor = own->factor;
        derived->reached_restitution = stop->law->reached(own->factor, own->exponent);
        derived->reached_contact_time =
            stop->numbers.contact_time * pow(mass / stop->mass, 1 / (own->exponent + 1));
        return;
    }
    const Identified found =
        identify_given(mass, own->stiffness, own->damping, (Separation)stop->separation);
    derived->damping_ratio = found.damping_ratio;
    if (isnan(stop->numbers.contact_time)) {
        derived->restitution = found.restitution;
        derived->contact_time = found.contact_time;
    } else if (is_carried) {
        derived->reached_restitution = found.restitution;
        derived->reached_contact_time = found.contact_time;
    }
}

// The plan outlives the scene, whose rows are the numbers'.
static Status keep_rows(ContactRows *rows) {
    if (rows->count == 0)
        return STATUS_OK;
    ContactRow *own = malloc(rows->count * sizeof *own);
    if (own != NULL)
        memcpy(own, rows->at, rows->count * sizeof *own);
    rows->at = own;
    return own != NULL ? STATUS_OK : STATUS_NO_MEMORY;
}

// The stops' parameters of one damper, into the plan and its report.
static Status derive(const Scene *scene, Plan *plan, size_t index) {
    const Damper *damper = &scene->dampers.at[index];
    PlanDamper *planned = &plan->dampers[index];
    const double mass = planned->effective_mass;
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        const ContactNumbers numbers = buffer_numbers(buffer);
        PlanStop *stop = &planned->stops[side];
        stop->contact = contact_prepare(plan->law, scene_contact(scene)->separation,
                                        damper_identified_mass(damper, mass), mass, &numbers);
        TRY(keep_rows(&stop->contact.numbers.rows));
        stop->restitution = stop->contact.parameters.restitution;
        stop->stiffness = stop->contact.parameters.stiffness;
        stop->damping = stop->contact.parameters.damping;
        Derived *derived = &plan->report.derived.at[plan->report.derived.count++];
        derived->damper = index + 1;
        derived->side = side;
        report_parameters(&stop->contact, mass, derived);
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
        if (buffer->table.count > 0)
            return decisions_add(decisions, "contact_model", law->kind.name, NAN, NULL,
                                 "contact times over approach speed are known");
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

static Status plan_damper(const Scene *scene, Plan *plan, size_t index) {
    const Damper *damper = &scene->dampers.at[index];
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
    return derive(scene, plan, index);
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
    plan->separation = plan->form == CONTACT_LINEAR ? (Separation)scene_contact(scene)->separation
                                                    : SEPARATION_ZERO_PENETRATION;
    for (size_t i = 0; i < scene->dampers.count; i++)
        TRY(plan_damper(scene, plan, i));
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
    for (size_t i = 0; i < plan->damper_count; i++)
        for (int side = 0; side < 2; side++)
            free(plan->dampers[i].stops[side].contact.numbers.rows.at);
    free(plan->mass);
    free(plan->dampers);
    free(plan);
}
