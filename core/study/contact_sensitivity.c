// k_b and c_b are in proportion to m_e, 1 / m_e = 1 / m + (M^-1)_jj: by the free mass they change
// by m_e / m, by all masses of the structure together by the rest. What a rig measured does not
// change with the scene's masses.
#include "core/study/contact_sensitivity.h"

#include <stdlib.h>
#include <string.h>

#include "core/contact/identification_sensitivity.h"
#include "core/study/input_uncertainty.h"

// Why there are no closed forms; NULL: there are.
static const char *refuse(const ContactLaw *law, const Buffer *buffer) {
    if (law->form == CONTACT_IMPULSIVE)
        return "impulses have no stiffness and no damping";
    if (law->form == CONTACT_POWER)
        return "the stiffness of a power law is that of each approach speed";
    if (buffer->table.count > 0)
        return "the buffer is a table: its numbers are those of each approach speed";
    if (isnan(buffer->contact_time))
        return "stiffness and damping are given themselves";
    return NULL;
}

static SensitivityBuffer place_of(const Damper *damper, Side side) {
    if (damper_buffer(damper, side) == &damper->buffer)
        return SENSITIVITY_BOTH;
    return side == SIDE_LEFT ? SENSITIVITY_LEFT : SENSITIVITY_RIGHT;
}

static void tell(const SensitivityStudy *study, const Damper *damper, Separation separation,
                 SensitivityStop *stop) {
    const Propagation by = propagate(stop->restitution, separation);
    const SensitivityBuffer place = place_of(damper, (Side)stop->side);
    const size_t number = (size_t)stop->damper - 1;
    const double e = spread_of(study, number, place, SENSITIVITY_RESTITUTION);
    const double T = spread_of(study, number, place, SENSITIVITY_CONTACT_TIME);
    const bool is_rig = damper->identified_for == IDENTIFIED_FOR_RIG;
    stop->stiffness_by_restitution = by.stiffness_by_restitution;
    stop->stiffness_by_contact_time = by.stiffness_by_contact_time;
    stop->damping_by_restitution = by.damping_by_restitution;
    stop->damping_by_contact_time = by.damping_by_contact_time;
    stop->by_damper_mass = is_rig ? 0 : stop->effective_mass / damper->mass;
    stop->by_structure_mass = is_rig ? 0 : 1 - stop->effective_mass / damper->mass;
    if (e > 0 || T > 0) {
        stop->stiffness_deviation =
            hypot(by.stiffness_by_restitution * e, by.stiffness_by_contact_time * T);
        stop->damping_deviation =
            hypot(by.damping_by_restitution * e, by.damping_by_contact_time * T);
    }
}

Status sensitivity_contact(const SensitivityStudy *study, const Simulation *simulation,
                           const DerivedList *derived, SensitivityStops *stops, Problem *problem) {
    const Scene *scene = &simulation->scene;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    *stops = (SensitivityStops){calloc(derived->count + 1, sizeof *stops->at), 0};
    bool is_whole = stops->at != NULL;
    for (size_t i = 0; i < derived->count && is_whole; i++) {
        const Derived *from = &derived->at[i];
        const Damper *damper = &scene->dampers.at[from->damper - 1];
        const char *why = refuse(law, damper_buffer(damper, (Side)from->side));
        const double none = (double)NAN;
        SensitivityStop *stop = &stops->at[stops->count++];
        *stop = (SensitivityStop){from->damper,
                                  from->side,
                                  from->restitution,
                                  from->contact_time,
                                  from->effective_mass,
                                  from->stiffness,
                                  from->damping,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  none,
                                  NULL};
        if (why == NULL)
            tell(study, damper, (Separation)scene_contact(scene)->separation, stop);
        else
            is_whole = (stop->why = strdup(why)) != NULL;
    }
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}
