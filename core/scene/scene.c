// Validation beyond single fields. Each part is validated on its own, so that all faults are
// reported at once; a part that could not be read, or already has a fault, is skipped.
#include "core/scene/scene.h"
#include "core/base/json_pointer.h"

#include <stdio.h>

#include "core/contact/identification.h"

// clang-format off
const Field scene_fields[] = {
    FIELD_VARIANT(Scene, structure, &structure_kinds, PRESENCE_REQUIRED, "the primary structure"),
    FIELD_LIST(Scene, dampers, damper_fields, SCENE_DAMPERS, PRESENCE_DEFAULT, "impact dampers"),
    FIELD_VARIANT(Scene, contact, &contact_kinds, PRESENCE_DEFAULT, "how a free mass and a stop meet"),
    FIELD_VARIANT(Scene, excitation, &excitation_kinds, PRESENCE_DEFAULT, "motion of the base, and the initial state"),
    FIELD_REAL(Scene, duration, "s", ABOVE(0), REQUIRED, "simulated time"),
    FIELD_REAL(Scene, sample_rate, "Hz", ABOVE(0), REQUIRED, "samples per second of simulated time"),
    FIELD_END
};
// clang-format on

// The index of the last sample, not yet an integer type's.
static double scene_last_sample(const Scene *scene) {
    return floor(scene->duration * scene->sample_rate * (1 + 1e-12));
}

size_t scene_sample_count(const Scene *scene) {
    const double last = scene_last_sample(scene);
    if (!(last >= 0))
        return 0;
    return last < 0x1p62 ? (size_t)last + 1 : SIZE_MAX;
}

static bool scene_is_positive(double value) {
    return isfinite(value) && value > 0;
}

static Status scene_check_samples(const Scene *scene, size_t most, Problem *problem) {
    if (!scene_is_positive(scene->duration) || !scene_is_positive(scene->sample_rate) ||
        most == 0 || scene_sample_count(scene) <= most)
        return STATUS_OK;
    char count[32];
    const double samples = scene_last_sample(scene) + 1;
    snprintf(count, sizeof count, samples < 1e15 ? "%.0f" : "%.3g", samples);
    return problem_add_real(problem, STATUS_INVALID, "/duration", scene->duration, "s",
                            "%s s at a sample_rate of %s Hz are %s samples, must be at most %zu",
                            real_text(scene->duration).at, real_text(scene->sample_rate).at, count,
                            most);
}

// Whether numbers that are in range give parameters that doubles can hold: of a power law
// between a slow impact and a fast one, an isolated contact lasting 1 to 1e3 of its own units.
static bool scene_is_sound(const ContactLaw *law, int separation, double mass,
                           const ContactNumbers *numbers) {
    if (law->form == CONTACT_POWER) {
        const double n = numbers->exponent, T_c = numbers->contact_time;
        return scene_is_positive(mass * pow(1 / T_c, n + 1) * pow(1e3, 1 - n)) &&
               scene_is_positive(mass * pow(1e3 / T_c, n + 1) * pow(CONTACT_SPEED_MIN, 1 - n));
    }
    const Identification found = identification_from_restitution(
        mass, numbers->restitution, numbers->contact_time, (Separation)separation);
    return scene_is_positive(found.stiffness) && isfinite(found.damping);
}

static Status scene_check_contact(const Scene *scene, const ContactLaw *law, size_t index,
                                  Side side, double own_mass, Problem *problem) {
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
        if (isnan(numbers.contact_time) || scene_is_sound(law, separation, mass, &numbers))
            continue;
        snprintf(place, sizeof place, "/dampers/%zu/%s%s/contact_time", index,
                 buffer == &damper->buffer        ? "buffer"
                 : buffer == &damper->left_buffer ? "left_buffer"
                                                  : "right_buffer",
                 row);
        return problem_add_real(problem, STATUS_INVALID, place, numbers.contact_time, "s",
                                "must give a stiffness (m_e (pi^2 + ln(e)^2) / T_c^2 or similar) "
                                "that numbers can hold");
    }
    return STATUS_OK;
}

static Status scene_check_contacts(const Scene *scene, Problem *problem) {
    const Structure *structure = scene_structure(scene);
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    for (size_t i = 0; law->form != CONTACT_IMPULSIVE && i < scene->dampers.count; i++) {
        const Damper *damper = &scene->dampers.at[i];
        if (damper->storey < 1 || damper->storey > structure_storeys(structure))
            continue; // reported by the rows
        double moved;
        const Status found =
            structure_kind(structure)->moved_mass(structure, (size_t)damper->storey - 1, &moved);
        if (found == STATUS_NO_MEMORY)
            return problem_set(problem, found, "no memory for a scene");
        const double mass = contact_effective_mass(moved, damper->mass);
        TRY(scene_check_contact(scene, law, i, SIDE_LEFT, mass, problem));
        if (damper_buffer(damper, SIDE_RIGHT) != damper_buffer(damper, SIDE_LEFT))
            TRY(scene_check_contact(scene, law, i, SIDE_RIGHT, mass, problem));
    }
    return STATUS_OK;
}

static Status scene_complete_dampers(Scene *scene, size_t storeys, Problem *problem) {
    const ContactLaw *law = dampers_contact_law(&scene->dampers, scene_contact(scene));
    Status status = STATUS_OK;
    // Dampers beyond the limit were reported by the rows.
    for (size_t i = 0; i < scene->dampers.count && i < SCENE_DAMPERS; i++) {
        const JsonPointer place = json_pointer_at("/dampers", i);
        if (damper_complete(&scene->dampers.at[i], law, storeys, place.at, problem) != STATUS_OK)
            status = STATUS_INVALID;
    }
    Contact *contact = (Contact *)(void *)scene->contact;
    if (law->form != CONTACT_LINEAR)
        contact->separation = CHOICE_ABSENT;
    else if (contact->separation == CHOICE_ABSENT)
        contact->separation = SEPARATION_ZERO_PENETRATION;
    return status;
}

// Without dampers there are no contacts, so every contact model means the same.
static Status scene_reset_contact(Scene *scene, Problem *problem) {
    Variant *usual = variant_new(contact_kinds.at(0));
    if (usual == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a scene");
    variant_free(scene->contact);
    scene->contact = usual;
    return STATUS_OK;
}

// The initial state has one number per storey; a single 0 means rest for any number of storeys.
static Status scene_complete_start(Reals *start, const char *name, const char *unit, size_t storeys,
                                   Problem *problem) {
    if (start->count == 0 || (start->count == 1 && start->at[0] == 0))
        return structure_zeros(start, storeys, problem);
    if (start->count != 1 || storeys == 1)
        return structure_validate_count(start, storeys, "/excitation", name, problem);
    return json_pointer_fault_real(problem, "/excitation", name, start->at[0], unit,
                                   "must be a list of %zu numbers, one per storey, or 0", storeys);
}

static Status scene_complete_starts(Scene *scene, size_t storeys, Problem *problem) {
    Excitation *excitation = (Excitation *)(void *)scene->excitation;
    if (storeys == 0)
        return STATUS_OK;
    const Status displacement =
        scene_complete_start(&excitation->displacement, "displacement", "m", storeys, problem);
    const Status velocity =
        scene_complete_start(&excitation->velocity, "velocity", "m/s", storeys, problem);
    return displacement != STATUS_OK ? displacement : velocity;
}

static Status scene_complete_excitation(Scene *scene, size_t most_samples, Problem *problem) {
    Excitation *excitation = (Excitation *)(void *)scene->excitation;
    const ExcitationKind *kind = excitation_kind(excitation);
    if (kind->check != NULL)
        TRY(kind->check(excitation, "/excitation", problem));
    if (kind->complete == NULL || !scene_is_positive(scene->duration) ||
        !scene_is_positive(scene->sample_rate) || problem_concerns(problem, "/duration"))
        return STATUS_OK;
    const Span span = {
        .duration = scene->duration, .sample_rate = scene->sample_rate, .most = most_samples};
    return kind->complete(excitation, &span, "/excitation", problem);
}

size_t scene_storeys(const Scene *scene, const Problem *problem) {
    return scene->structure == NULL || problem_concerns(problem, "/structure")
               ? 0
               : structure_storeys(scene_structure(scene));
}

Status scene_complete(Scene *scene, size_t most_samples, Problem *problem) {
    Status faults[5] = {STATUS_OK};
    if (scene->structure != NULL)
        faults[0] =
            structure_complete((Structure *)(void *)scene->structure, "/structure", problem);
    const size_t storeys = scene_storeys(scene, problem);
    if (scene->contact != NULL)
        faults[1] = scene->dampers.count > 0 ? scene_complete_dampers(scene, storeys, problem)
                                             : scene_reset_contact(scene, problem);
    faults[2] = scene_check_samples(scene, most_samples, problem);
    if (scene->excitation != NULL) {
        faults[3] = scene_complete_excitation(scene, most_samples, problem);
        faults[4] = scene_complete_starts(scene, storeys, problem);
    }
    TRY(status_first(faults, COUNT(faults)));
    if (problem_concerns(problem, "/structure") || problem_concerns(problem, "/dampers") ||
        scene->structure == NULL || scene->contact == NULL)
        return STATUS_OK;
    return scene_check_contacts(scene, problem);
}
