#include "core/plan/contact_setup.h"

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
    derived->damping = stop->law->form == CONTACT_POWER ? (double)NAN : own->damping;
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

Status stops_make(const Scene *scene, Plan *plan, size_t index) {
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

void stops_clear(Plan *plan) {
    for (size_t i = 0; i < plan->damper_count; i++)
        for (int side = 0; side < 2; side++)
            free(plan->dampers[i].stops[side].contact.numbers.rows.at);
}

static bool varies(const PlanStop *stop) {
    return stop->contact.numbers.rows.count > 0 ||
           (stop->contact.law != NULL && stop->contact.law->form == CONTACT_POWER);
}

bool stops_vary(const PlanDamper *damper) {
    return varies(&damper->stops[SIDE_LEFT]) || varies(&damper->stops[SIDE_RIGHT]);
}

ContactParameters stops_freeze(const PlanStop *stop, double approach_speed) {
    if (varies(stop))
        return contact_freeze(&stop->contact, approach_speed);
    return (ContactParameters){
        .restitution = stop->restitution, .stiffness = stop->stiffness, .damping = stop->damping};
}
