// A damper may have one buffer for both stops, one for each, or one for both and another for one of
// them. What all of these mean is kept in one form, so that equal dampers are written equally.
#include "core/scene/damper.h"
#include "core/base/json_pointer.h"

#include <stdlib.h>

#include "core/contact/identification.h"

const char *const identified_for_names[] = {
    [IDENTIFIED_FOR_SCENE] = "scene", [IDENTIFIED_FOR_RIG] = "rig", NULL};

// clang-format off
static const Field rig_fields[] = {
    FIELD_REAL(Rig, impactor_mass, "kg", ABOVE(0), REQUIRED, "mass that struck the buffer in the test"),
    FIELD_REAL(Rig, base_mass, "kg", ABOVE(0), OPTIONAL, "mass that it struck; a fixed base if not given"),
    FIELD_END
};

const Field damper_fields[] = {
    FIELD_REAL(Damper, mass, "kg", ABOVE(0), REQUIRED, "free mass m"),
    FIELD_REAL(Damper, clearance, "m", AT_MIN(0), REQUIRED, "total clearance d between the stops"),
    FIELD_REAL(Damper, offset, "m", ANY, 0, "of the stops' middle, relative to the structure"),
    FIELD_REAL(Damper, position, "m", ANY, 0, "initial, of the free mass relative to the stops' middle"),
    FIELD_REAL(Damper, velocity, "m/s", ANY, 0, "initial, of the free mass relative to the structure"),
    FIELD_COUNT(Damper, storey, NULL, AT_MIN(1), OPTIONAL, "storey that carries it, from 1 at the ground; default: the top one"),
    FIELD_ITEM(Damper, buffer, buffer_fields, "material", PRESENCE_OPTIONAL, "the buffer at both stops"),
    FIELD_ITEM(Damper, left_buffer, buffer_fields, "material", PRESENCE_OPTIONAL, "the buffer at the left stop"),
    FIELD_ITEM(Damper, right_buffer, buffer_fields, "material", PRESENCE_OPTIONAL, "the buffer at the right stop"),
    FIELD_CHOICE(Damper, identified_for, identified_for_names, 0, "the pair of masses for which restitution and contact time hold"),
    FIELD_ITEM(Damper, rig, rig_fields, NULL, PRESENCE_OPTIONAL, "masses of the test that measured the buffers, for identified_for rig: the parameters identified there are carried over; if absent those of the material's revision"),
    FIELD_END
};
// clang-format on

enum { BUFFERS = 3 };
static const char *const buffer_names[BUFFERS] = {"buffer", "left_buffer", "right_buffer"};

static Buffer *damper_buffer_at(Damper *damper, size_t index) {
    Buffer *const buffers[BUFFERS] = {&damper->buffer, &damper->left_buffer, &damper->right_buffer};
    return buffers[index];
}

const Buffer *damper_buffer(const Damper *damper, Side side) {
    const Buffer *own = side == SIDE_LEFT ? &damper->left_buffer : &damper->right_buffer;
    return buffer_is_given(own) ? own : &damper->buffer;
}

const ContactLaw *dampers_contact_law(const Dampers *dampers, const Contact *contact) {
    const ContactLaw *law = contact_law(contact);
    if (law->form != CONTACT_CHOSEN)
        return law;
    for (size_t i = 0; i < dampers->count; i++)
        if (buffer_has_contact_data(damper_buffer(&dampers->at[i], SIDE_LEFT)) ||
            buffer_has_contact_data(damper_buffer(&dampers->at[i], SIDE_RIGHT)))
            return &contact_spring_damper;
    return &contact_impulse;
}

static Status damper_check_buffers(Damper *damper, const ContactLaw *law, const char *pointer,
                                   Problem *problem) {
    char places[BUFFERS][sizeof((Fault){0}.pointer)];
    bool is_given[BUFFERS], has_fault = false;
    for (size_t i = 0; i < BUFFERS; i++) {
        json_pointer_join(places[i], sizeof places[i], pointer, buffer_names[i]);
        is_given[i] = buffer_is_given(damper_buffer_at(damper, i));
        has_fault = has_fault || problem_concerns(problem, places[i]);
    }
    Status status = STATUS_OK;
    for (size_t i = 0; i < BUFFERS; i++)
        if (is_given[i] &&
            buffer_validate(damper_buffer_at(damper, i), law, places[i], problem) != STATUS_OK)
            status = STATUS_INVALID;
    // A buffer that could not be read may be the one that seems to be missing.
    if (has_fault)
        return STATUS_INVALID;
    if (is_given[0] && is_given[1] && is_given[2])
        return problem_add(problem, STATUS_INVALID, places[0],
                           "is used by neither side: left_buffer and right_buffer are given too");
    if (!is_given[0] && !(is_given[1] && is_given[2]))
        return problem_add(problem, STATUS_INVALID, places[0],
                           "is required: there is no buffer at the %s (a material, restitution and "
                           "contact_time, or stiffness and damping)",
                           is_given[1]   ? "right stop"
                           : is_given[2] ? "left stop"
                                         : "stops");
    return status;
}

static Status damper_check_position(const Damper *damper, const char *pointer, Problem *problem) {
    const double most = damper->clearance / 2;
    if (!(most >= 0) || !isfinite(damper->position) || fabs(damper->position) <= most)
        return STATUS_OK;
    const RealText limit = real_text(most);
    return json_pointer_fault_real(problem, pointer, "position", damper->position, "m",
                                   "must be between the stops, within [-%s, %s] m, is %s", limit.at,
                                   limit.at, real_text(damper->position).at);
}

// A power law's parameters are those of an approach speed; between stops that always touch there is
// none.
static Status damper_check_clearance(const Damper *damper, const ContactLaw *law,
                                     const char *pointer, Problem *problem) {
    if (law->form != CONTACT_POWER || damper->clearance != 0)
        return STATUS_OK;
    return json_pointer_fault_real(
        problem, pointer, "clearance", 0, "m",
        "must be above 0 m for the contact model %s, is 0: its parameters are "
        "those of an approach speed (spring_damper and impulse allow 0)",
        law->kind.name);
}

// A sum of finite numbers may not be finite.
static Status damper_check_stops(const Damper *damper, const char *pointer, Problem *problem) {
    const double furthest = fabs(damper->offset) + damper->clearance;
    if (!isfinite(damper->offset) || !isfinite(damper->clearance) || isfinite(furthest))
        return STATUS_OK;
    return json_pointer_fault_real(problem, pointer, "offset", damper->offset, "m",
                                   "puts a stop beyond all numbers");
}

static Status damper_check_storey(const Damper *damper, size_t storeys, const char *pointer,
                                  Problem *problem) {
    if (storeys == 0 || damper->storey <= storeys)
        return STATUS_OK;
    return json_pointer_fault_real(problem, pointer, "storey", (double)damper->storey, NULL,
                                   "must be at most %zu, the number of storeys, is %llu", storeys,
                                   (unsigned long long)damper->storey);
}

double damper_identified_mass(const Damper *damper, double own) {
    if (damper->identified_for != IDENTIFIED_FOR_RIG)
        return own;
    return isnan(damper->rig.base_mass)
               ? damper->rig.impactor_mass
               : contact_effective_mass(damper->rig.impactor_mass, damper->rig.base_mass);
}

// Restitution alone, and stiffness and damping, hold for any pair of masses.
static bool damper_is_carried(const Damper *damper, const ContactLaw *law) {
    return law->form != CONTACT_IMPULSIVE &&
           (buffer_is_measured(damper_buffer(damper, SIDE_LEFT)) ||
            buffer_is_measured(damper_buffer(damper, SIDE_RIGHT)));
}

static bool rig_is_given(const Damper *damper) {
    return !isnan(damper->rig.impactor_mass) || !isnan(damper->rig.base_mass);
}

static bool rig_is_same(const Rig *a, const Rig *b) {
    return real_same(a->impactor_mass, b->impactor_mass) && real_same(a->base_mass, b->base_mass);
}

// The masses of the tests that measured the buffers. False: there is no such test, they had
// different masses, or one does not state them: then *unstated is its buffer, else NULL.
static bool damper_tested_rig(const Damper *damper, Rig *rig, const Buffer **unstated) {
    bool is_found = false;
    *unstated = NULL;
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        if (!buffer_is_measured(buffer))
            continue;
        const BufferTest *test = &buffer->test;
        const Rig own = {test->impactor_mass,
                         isinf(test->base_mass) ? (double)NAN : test->base_mass};
        if (isnan(buffer_test_mass(buffer)))
            *unstated = buffer;
        if (*unstated != NULL || (is_found && !rig_is_same(rig, &own)))
            return false;
        *rig = own;
        is_found = true;
    }
    return is_found;
}

// A rig that is not given is that of the materials' tests.
static void rig_fill(Damper *damper, const ContactLaw *law) {
    const Buffer *unstated;
    Rig tested;
    if (damper->identified_for == IDENTIFIED_FOR_RIG && !rig_is_given(damper) &&
        damper_is_carried(damper, law) && damper_tested_rig(damper, &tested, &unstated))
        damper->rig = tested;
}

void damper_reset_rig(const Damper *base, Damper *damper) {
    const Buffer *unstated;
    Rig tested;
    if (base->identified_for != IDENTIFIED_FOR_RIG || !rig_is_same(&base->rig, &damper->rig) ||
        !damper_tested_rig(base, &tested, &unstated) || !rig_is_same(&base->rig, &tested))
        return;
    for (int side = 0; side < 2; side++) {
        const Buffer *buffer = damper_buffer(damper, (Side)side);
        if (buffer_is_measured(buffer) && buffer->material == NULL)
            return; // its numbers were changed, not its test
    }
    fields_clear(rig_fields, &damper->rig);
}

// Why the materials could not stand for it.
static Status rig_refuse(const Damper *damper, const char *place, Problem *problem) {
    const Buffer *unstated;
    Rig tested;
    (void)damper_tested_rig(damper, &tested, &unstated);
    if (unstated == NULL)
        return problem_add(problem, STATUS_INVALID, place,
                           "is required by identified_for \"rig\": %.64s and %.64s were measured "
                           "with other masses, and a damper has one rig",
                           damper_buffer(damper, SIDE_LEFT)->material,
                           damper_buffer(damper, SIDE_RIGHT)->material);
    if (unstated->material == NULL)
        return problem_add(problem, STATUS_INVALID, place,
                           "is required by identified_for \"rig\": the impactor_mass [kg] and, "
                           "unless it was fixed, the base_mass of the test that measured "
                           "restitution and contact time");
    return problem_add(problem, STATUS_INVALID, place,
                       "is required by identified_for \"rig\": %.64s does not state %s; give the "
                       "impactor_mass [kg] and, unless it was fixed, the base_mass of its test",
                       unstated->material,
                       !isnan(unstated->test.base_mass) ? "the mass of the impactor"
                       : !isnan(unstated->test.impactor_mass)
                           ? "the base that it lay on"
                           : "the masses that it was tested with");
}

static Status rig_check(const Damper *damper, const ContactLaw *law, const char *pointer,
                        Problem *problem) {
    const JsonPointer place = json_pointer_of(pointer, "rig");
    const bool is_given = rig_is_given(damper);
    if (!damper_is_carried(damper, law) || problem_concerns(problem, place.at) ||
        is_given == (damper->identified_for == IDENTIFIED_FOR_RIG))
        return STATUS_OK;
    if (is_given)
        return problem_add(problem, STATUS_INVALID, place.at,
                           "is used only with identified_for \"rig\": give that, or leave out the "
                           "rig");
    return rig_refuse(damper, place.at, problem);
}

static void rig_normalise(Damper *damper, const ContactLaw *law) {
    if (damper_is_carried(damper, law))
        return;
    damper->identified_for = IDENTIFIED_FOR_SCENE;
    fields_clear(rig_fields, &damper->rig);
}

static void damper_normalise_buffers(Damper *damper, const ContactLaw *law) {
    for (size_t i = 0; i < BUFFERS; i++)
        if (buffer_is_given(damper_buffer_at(damper, i)))
            buffer_normalise(damper_buffer_at(damper, i), law);
    if (buffer_is_given(&damper->buffer)) {
        if (buffer_is_given(&damper->left_buffer))
            buffer_move(&damper->right_buffer, &damper->buffer);
        else if (buffer_is_given(&damper->right_buffer))
            buffer_move(&damper->left_buffer, &damper->buffer);
    }
    if (buffer_is_given(&damper->left_buffer) &&
        buffer_equals(&damper->left_buffer, &damper->right_buffer)) {
        buffer_move(&damper->buffer, &damper->left_buffer);
        fields_clear(buffer_fields, &damper->right_buffer);
    }
}

Status damper_complete(Damper *damper, const ContactLaw *law, size_t storeys, const char *pointer,
                       Problem *problem) {
    if (damper->storey == COUNT_ABSENT && storeys > 0)
        damper->storey = storeys;
    if (damper->identified_for == CHOICE_ABSENT)
        damper->identified_for = IDENTIFIED_FOR_SCENE;
    rig_fill(damper, law);
    const Status faults[] = {
        damper_check_position(damper, pointer, problem),
        damper_check_stops(damper, pointer, problem),
        damper_check_clearance(damper, law, pointer, problem),
        damper_check_storey(damper, storeys, pointer, problem),
        damper_check_buffers(damper, law, pointer, problem),
        rig_check(damper, law, pointer, problem),
    };
    TRY(status_first(faults, COUNT(faults)));
    damper_normalise_buffers(damper, law);
    rig_normalise(damper, law);
    return STATUS_OK;
}
