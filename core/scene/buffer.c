// A buffer is given in exactly one way: e with T_c, e alone, or k_b with c_b. Which of them do
// depends on the law.
#include "core/scene/buffer.h"

#include <stdlib.h>
#include <string.h>

// clang-format off
const Field buffer_fields[] = {
    FIELD_TEXT(Buffer, material, 128, PRESENCE_OPTIONAL, 0, "a material, slug or slug@revision; beside numbers, where they come from"),
    FIELD_REAL(Buffer, restitution, NULL, WITHIN(0, 1), OPTIONAL, "coefficient of restitution e"),
    FIELD_REAL(Buffer, contact_time, "s", ABOVE(0), OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_REAL(Buffer, stiffness, "N/m", ABOVE(0), OPTIONAL, "contact stiffness k_b"),
    FIELD_REAL(Buffer, damping, "N s/m", AT_LEAST(0), OPTIONAL, "contact damping c_b"),
    FIELD_END
};
// clang-format on

static bool has(double value) {
    return !isnan(value);
}

static bool has_numbers(const Buffer *buffer) {
    return has(buffer->restitution) || buffer_has_contact(buffer);
}

bool buffer_is_given(const Buffer *buffer) {
    return buffer->material != NULL || has_numbers(buffer);
}

bool buffer_has_contact(const Buffer *buffer) {
    return has(buffer->contact_time) || has(buffer->stiffness) || has(buffer->damping);
}

static bool is_same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

bool buffer_equals(const Buffer *a, const Buffer *b) {
    const bool is_same_material = a->material == NULL || b->material == NULL
                                      ? a->material == b->material
                                      : strcmp(a->material, b->material) == 0;
    return is_same_material && is_same(a->restitution, b->restitution) &&
           is_same(a->contact_time, b->contact_time) && is_same(a->stiffness, b->stiffness) &&
           is_same(a->damping, b->damping);
}

void buffer_move(Buffer *target, Buffer *source) {
    fields_clear(buffer_fields, target);
    *target = *source;
    source->material = NULL;
    fields_clear(buffer_fields, source);
}

static Status missing(const char *pointer, const char *name, const char *sentence,
                      Problem *problem) {
    char place[sizeof((Fault){0}.pointer)];
    pointer_join(place, sizeof place, pointer, name);
    return problem_add(problem, STATUS_INVALID, place, "%s", sentence);
}

// Whether the numbers make one of the three ways, whatever the law.
static Status check_way(const Buffer *buffer, const char *pointer, Problem *problem) {
    if (!has_numbers(buffer)) {
        char material[64];
        text_quote(material, sizeof material, buffer->material);
        return problem_add(problem, STATUS_INVALID, pointer,
                           "material %s is not resolved to its numbers", material);
    }
    const bool is_measured = has(buffer->restitution) || has(buffer->contact_time);
    const bool is_known = has(buffer->stiffness) || has(buffer->damping);
    if (is_measured && is_known)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "must be given in one way: restitution and contact_time, restitution "
                           "alone, or stiffness and damping");
    if (is_measured && !has(buffer->restitution))
        return missing(pointer, "restitution",
                       "is required beside contact_time: coefficient of restitution e", problem);
    if (is_known && !has(buffer->stiffness))
        return missing(pointer, "stiffness",
                       "is required beside damping: contact stiffness k_b [N/m]", problem);
    if (is_known && !has(buffer->damping))
        return missing(pointer, "damping",
                       "is required beside stiffness: contact damping c_b [N s/m]", problem);
    return STATUS_OK;
}

Status buffer_check(const Buffer *buffer, ContactForm form, const char *pointer, Problem *problem) {
    if (problem_concerns(problem, pointer))
        return STATUS_INVALID;
    TRY(check_way(buffer, pointer, problem));
    if (form == CONTACT_IMPULSIVE && !has(buffer->restitution))
        return missing(pointer, "restitution",
                       "is required by the contact model impulse, which takes no stiffness and "
                       "damping: give a restitution, or choose spring_damper",
                       problem);
    if (form != CONTACT_LINEAR || has(buffer->stiffness))
        return STATUS_OK;
    if (buffer->restitution == 0) {
        char place[sizeof((Fault){0}.pointer)];
        pointer_join(place, sizeof place, pointer, "restitution");
        return problem_add_real(problem, STATUS_INVALID, place, 0, NULL,
                                "must be above 0 for the contact model spring_damper, is 0: its "
                                "damping would be infinite (impulse allows 0)");
    }
    if (!has(buffer->contact_time))
        return missing(pointer, "contact_time",
                       "is required by the contact model spring_damper: contact time T_c of an "
                       "isolated impact [s]",
                       problem);
    return STATUS_OK;
}

void buffer_erase_contact(Buffer *buffer) {
    buffer->contact_time = buffer->stiffness = buffer->damping = (double)NAN;
}
