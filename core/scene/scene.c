// Judging what rows cannot see. Each part is judged on its own, so that all faults are told at
// once; a part that could not be read, or has a fault already, is passed over.
#include "core/scene/scene.h"

#include <stdio.h>

#include "core/contact/identify.h"

enum { STOREYS = 1, DAMPERS = 1 };

// clang-format off
const Field scene_fields[] = {
    FIELD_VARIANT(Scene, structure, &structure_kinds, PRESENCE_REQUIRED, "the primary structure"),
    FIELD_LIST(Scene, dampers, damper_fields, DAMPERS, PRESENCE_DEFAULT, "impact dampers"),
    FIELD_VARIANT(Scene, contact, &contact_kinds, PRESENCE_DEFAULT, "how a free mass and a stop meet"),
    FIELD_VARIANT(Scene, excitation, &excitation_kinds, PRESENCE_DEFAULT, "motion of the base, and the initial state"),
    FIELD_REAL(Scene, duration, "s", ABOVE(0), REQUIRED, "simulated time"),
    FIELD_REAL(Scene, sample_rate, "Hz", ABOVE(0), REQUIRED, "samples per second of simulated time"),
    FIELD_END
};
// clang-format on

// The index of the last sample, not yet an integer type's.
static double last_sample(const Scene *scene) {
    return floor(scene->duration * scene->sample_rate * (1 + 1e-12));
}

size_t scene_sample_count(const Scene *scene) {
    const double last = last_sample(scene);
    if (!(last >= 0))
        return 0;
    return last < 0x1p62 ? (size_t)last + 1 : SIZE_MAX;
}

static bool is_positive(double value) {
    return isfinite(value) && value > 0;
}

static Status check_samples(const Scene *scene, size_t most, Problem *problem) {
    if (!is_positive(scene->duration) || !is_positive(scene->sample_rate) || most == 0 ||
        scene_sample_count(scene) <= most)
        return STATUS_OK;
    char duration[32], rate[32], count[32];
    text_real(duration, scene->duration);
    text_real(rate, scene->sample_rate);
    const double samples = last_sample(scene) + 1;
    snprintf(count, sizeof count, samples < 1e15 ? "%.0f" : "%.3g", samples);
    return problem_add_real(problem, STATUS_INVALID, "/duration", scene->duration, "s",
                            "%s s at a sample_rate of %s Hz are %s samples, must be at most %zu",
                            duration, rate, count, most);
}

// Whether numbers that each are in range come to parameters that doubles can hold, at the edges of
// what a stop may meet.
static bool is_sound(const ContactLaw *law, int separation, double mass,
                     const ContactNumbers *numbers) {
    static const double speeds[] = {CONTACT_SPEED_LEAST, 1, 1e3};
    const ContactStop stop = contact_prepare(law, separation, mass, mass, numbers);
    for (size_t i = 0; i < COUNT(speeds); i++) {
        const ContactParameters frozen = contact_freeze(&stop, speeds[i]);
        if (!is_positive(frozen.stiffness) ||
            !(law->form == CONTACT_POWER || isfinite(frozen.damping)))
            return false;
    }
    return true;
}

static Status check_contact(const Scene *scene, const ContactLaw *law, size_t index, Side side,
                            double own_mass, Problem *problem) {
    const Damper *damper = &scene->dampers.at[index];
    const Buffer *buffer = damper_buffer(damper, side);
    const double mass = damper_identified_mass(damper, own_mass);
    const int separation = scene_contact(scene)->separation;
    ContactNumbers numbers = buffer_numbers(buffer);
    const ContactRows rows = numbers.rows;
    numbers.rows = (ContactRows){NULL, 0};
    for (size_t i = 0; i < (rows.count > 0 ? rows.count : 1); i++) {
        char place[sizeof((Fault){0}.pointer)], row[64] = "";
        if (rows.count > 0) {
            numbers.restitution = rows.at[i].restitution;
            numbers.contact_time = rows.at[i].contact_time;
            snprintf(row, sizeof row, "/table/%zu", i);
        }
        if (isnan(numbers.contact_time) || is_sound(law, separation, mass, &numbers))
            continue;
        snprintf(place, sizeof place, "/dampers/%zu/%s%s/contact_time", index,
                 buffer == &damper->buffer        ? "buffer"
                 : buffer == &damper->left_buffer ? "left_buffer"
                                                  : "right_buffer",
                 row);
        return problem_add_real(problem, STATUS_INVALID, place, numbers.contact_time, "s",
                                "must give a stiffness (m_e (pi^2 + ln(e)^2) / T_c^2 or its like) "
                                "that numbers can hold");
    }
    return STATUS_OK;
}

static Status check_contacts(const Scene *scene, Problem *problem) {
    const StructureSdof *sdof = (const StructureSdof *)(const void *)scene->structure;
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    for (size_t i = 0; law->form != CONTACT_IMPULSIVE && i < scene->dampers.count; i++) {
        const double mass = effective_mass(sdof->mass, scene->dampers.at[i].mass);
        TRY(check_contact(scene, law, i, SIDE_LEFT, mass, problem));
        TRY(check_contact(scene, law, i, SIDE_RIGHT, mass, problem));
    }
    return STATUS_OK;
}

static Status complete_dampers(Scene *scene, Problem *problem) {
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    Status status = STATUS_OK;
    // More than the rows allow were told by the rows.
    for (size_t i = 0; i < scene->dampers.count && i < DAMPERS; i++) {
        char place[sizeof((Fault){0}.pointer)];
        pointer_index(place, sizeof place, "/dampers", i);
        if (damper_complete(&scene->dampers.at[i], law, STOREYS, place, problem) != STATUS_OK)
            status = STATUS_INVALID;
    }
    Contact *contact = (Contact *)(void *)scene->contact;
    if (law->form != CONTACT_LINEAR)
        contact->separation = CHOICE_ABSENT;
    else if (contact->separation == CHOICE_ABSENT)
        contact->separation = SEPARATION_ZERO_PENETRATION;
    return status;
}

// Without dampers nothing ever meets: whatever was said of contacts means the same.
static Status reset_contact(Scene *scene, Problem *problem) {
    Variant *usual = variant_new(contact_kinds.at(0));
    if (usual == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a scene");
    variant_free(scene->contact);
    scene->contact = usual;
    return STATUS_OK;
}

static Status complete_excitation(Scene *scene, size_t most_samples, Problem *problem) {
    Excitation *excitation = (Excitation *)(void *)scene->excitation;
    const ExcitationKind *kind = excitation_kind(excitation);
    if (kind->complete == NULL || !is_positive(scene->duration) ||
        !is_positive(scene->sample_rate) || problem_concerns(problem, "/duration"))
        return STATUS_OK;
    const Span span = {scene->duration, scene->sample_rate, most_samples};
    return kind->complete(excitation, &span, "/excitation", problem);
}

Status scene_complete(Scene *scene, size_t most_samples, Problem *problem) {
    Status faults[4] = {STATUS_OK};
    if (scene->structure != NULL)
        faults[0] =
            structure_complete((Structure *)(void *)scene->structure, "/structure", problem);
    if (scene->contact != NULL)
        faults[1] = scene->dampers.count > 0 ? complete_dampers(scene, problem)
                                             : reset_contact(scene, problem);
    faults[2] = check_samples(scene, most_samples, problem);
    if (scene->excitation != NULL)
        faults[3] = complete_excitation(scene, most_samples, problem);
    for (size_t i = 0; i < COUNT(faults); i++)
        TRY(faults[i]);
    if (problem_concerns(problem, "/structure") || problem_concerns(problem, "/dampers") ||
        scene->structure == NULL || scene->contact == NULL)
        return STATUS_OK;
    return check_contacts(scene, problem);
}
