// A buffer is given in exactly one way: e with T_c, once or as a table, e alone, k_b with c_b, or e
// with the k of a power law. Which of them do depends on the law.
#include "core/scene/buffer.h"
#include "core/base/json_pointer.h"

#include <stdlib.h>
#include <string.h>

#include "core/contact/identification.h"
#include "core/contact/power_law.h"

// clang-format off
static const Field row_fields[] = {
    FIELD_REAL(ContactRow, approach_speed, "m/s", AT_MIN(0), REQUIRED, "at which these were measured, rising from row to row"),
    FIELD_REAL(ContactRow, restitution, NULL, WITHIN(0, 1), REQUIRED, "coefficient of restitution e"),
    FIELD_REAL(ContactRow, contact_time, "s", ABOVE(0), OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_END
};

static const Field test_fields[] = {
    FIELD_HIDDEN_REAL(BufferTest, least_speed),
    FIELD_HIDDEN_REAL(BufferTest, most_speed),
    FIELD_HIDDEN_REAL(BufferTest, impactor_mass),
    FIELD_HIDDEN_REAL(BufferTest, base_mass),
    FIELD_HIDDEN_REAL(BufferTest, restitution_deviation),
    FIELD_HIDDEN_REAL(BufferTest, contact_time_deviation),
    FIELD_END
};

const Field buffer_fields[] = {
    FIELD_TEXT(Buffer, material, 128, PRESENCE_OPTIONAL, 0, "a material, slug or slug@revision; with numbers, their source"),
    FIELD_REAL(Buffer, restitution, NULL, WITHIN(0, 1), OPTIONAL, "coefficient of restitution e"),
    FIELD_REAL(Buffer, contact_time, "s", ABOVE(0), OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_LIST(Buffer, table, row_fields, BUFFER_ROWS, PRESENCE_OPTIONAL, "restitution and contact time over approach speed, linear between the rows and constant beyond them"),
    FIELD_REAL(Buffer, stiffness, "N/m", ABOVE(0), OPTIONAL, "contact stiffness k_b; k in N/m^n with a restitution under a power law"),
    FIELD_REAL(Buffer, damping, "N s/m", AT_MIN(0), OPTIONAL, "contact damping c_b"),
    FIELD_REAL(Buffer, exponent, NULL, WITHIN(1, 10), OPTIONAL, "exponent n of a power law, 1.5 if not given"),
    FIELD_BASE(Buffer, test, test_fields),
    FIELD_END
};
// clang-format on

static bool buffer_has(double value) {
    return !isnan(value);
}

bool buffer_is_measured(const Buffer *buffer) {
    return buffer->table.count > 0 || buffer_has(buffer->contact_time);
}

static bool buffer_has_numbers(const Buffer *buffer) {
    return buffer_has(buffer->restitution) || buffer_has_contact_data(buffer) ||
           buffer->table.count > 0;
}

bool buffer_is_given(const Buffer *buffer) {
    return buffer->material != NULL || buffer_has_numbers(buffer);
}

bool buffer_has_contact_data(const Buffer *buffer) {
    for (size_t i = 0; i < buffer->table.count; i++)
        if (buffer_has(buffer->table.at[i].contact_time))
            return true;
    return buffer_has(buffer->contact_time) || buffer_has(buffer->stiffness) ||
           buffer_has(buffer->damping);
}

static bool buffer_has_same_table(const ContactRows *a, const ContactRows *b) {
    if (a->count != b->count)
        return false;
    for (size_t i = 0; i < a->count; i++)
        if (!real_same(a->at[i].approach_speed, b->at[i].approach_speed) ||
            !real_same(a->at[i].restitution, b->at[i].restitution) ||
            !real_same(a->at[i].contact_time, b->at[i].contact_time))
            return false;
    return true;
}

bool buffer_equals(const Buffer *a, const Buffer *b) {
    return text_same(a->material, b->material) && real_same(a->restitution, b->restitution) &&
           real_same(a->contact_time, b->contact_time) && real_same(a->stiffness, b->stiffness) &&
           real_same(a->damping, b->damping) && real_same(a->exponent, b->exponent) &&
           buffer_has_same_table(&a->table, &b->table);
}

void buffer_speed_range(const Buffer *buffer, double *least, double *most) {
    const ContactRows *rows = &buffer->table;
    *least = *most = (double)NAN;
    if (buffer->material != NULL) {
        *least = buffer->test.least_speed;
        *most = buffer->test.most_speed;
    } else if (rows->count > 0) {
        *least = rows->at[0].approach_speed;
        *most = rows->at[rows->count - 1].approach_speed;
    }
}

double buffer_test_mass(const Buffer *buffer) {
    const BufferTest *test = &buffer->test;
    if (buffer->material == NULL || isnan(test->impactor_mass) || isnan(test->base_mass))
        return (double)NAN;
    return contact_effective_mass(test->impactor_mass, test->base_mass);
}

void buffer_move(Buffer *target, Buffer *source) {
    fields_clear(buffer_fields, target);
    *target = *source;
    source->material = NULL;
    source->table = (ContactRows){NULL, 0};
    fields_clear(buffer_fields, source);
}

ContactNumbers buffer_numbers(const Buffer *buffer) {
    return (ContactNumbers){buffer->restitution, buffer->contact_time, buffer->stiffness,
                            buffer->damping,     buffer->exponent,     buffer->table};
}

// Whether the numbers form one of these combinations, under any law.
static Status buffer_check_way(const Buffer *buffer, const ContactLaw *law, const char *pointer,
                               Problem *problem) {
    if (!buffer_has_numbers(buffer)) {
        char material[64];
        text_quote(material, sizeof material, buffer->material);
        return problem_add(problem, STATUS_INVALID, pointer,
                           "material %s is not resolved to its numbers", material);
    }
    const bool has_table = buffer->table.count > 0;
    const bool is_known = buffer_has(buffer->stiffness) || buffer_has(buffer->damping);
    if (has_table &&
        (buffer_has(buffer->restitution) || buffer_has(buffer->contact_time) || is_known))
        return problem_add(problem, STATUS_INVALID, pointer,
                           "must be given in one way: a table replaces restitution, "
                           "contact_time, stiffness and damping");
    if (law->form == CONTACT_POWER || has_table)
        return STATUS_OK;
    // The combination of a power law; under impulse only the restitution is kept.
    if (law->form == CONTACT_IMPULSIVE && buffer_has(buffer->restitution) &&
        buffer_has(buffer->stiffness) && !buffer_has(buffer->damping) &&
        !buffer_has(buffer->contact_time))
        return STATUS_OK;
    const bool is_measured = buffer_has(buffer->restitution) || buffer_has(buffer->contact_time);
    if (is_measured && is_known)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "must be given in one way: restitution and contact_time, restitution "
                           "alone, or stiffness and damping (restitution and stiffness are for "
                           "power laws such as hunt_crossley)");
    if (is_measured && !buffer_has(buffer->restitution))
        return json_pointer_fault(problem, pointer, "restitution",
                                  "is required with %s: coefficient of restitution e",
                                  "contact_time");
    if (is_known && !buffer_has(buffer->stiffness))
        return json_pointer_fault(problem, pointer, "stiffness",
                                  "is required with %s: contact stiffness k_b [N/m]", "damping");
    if (is_known && !buffer_has(buffer->damping))
        return json_pointer_fault(problem, pointer, "damping",
                                  "is required with %s: contact damping c_b [N s/m]", "stiffness");
    return STATUS_OK;
}

// Whether the law can have this restitution.
static Status buffer_check_restitution(double restitution, const ContactLaw *law,
                                       const char *pointer, Problem *problem) {
    char is[32];
    text_real(is, restitution);
    if (law->form == CONTACT_LINEAR && restitution == 0)
        return json_pointer_fault_real(
            problem, pointer, "restitution", 0, NULL,
            "must be above 0 for the contact model spring_damper, is 0: its "
            "damping would be infinite (impulse allows 0)");
    if (law->form != CONTACT_POWER || !(restitution < law->restitution_min))
        return STATUS_OK;
    if (law->restitution_min == 1)
        return json_pointer_fault_real(
            problem, pointer, "restitution", restitution, NULL,
            "must be 1 or left out for the contact model %s, which gives all "
            "energy back, is %s",
            law->kind.name, is);
    return json_pointer_fault_real(
        problem, pointer, "restitution", restitution, NULL,
        "must be at least %s for the contact model %s, is %s: its damping "
        "grows beyond all bounds",
        real_text(law->restitution_min).at, law->kind.name, is);
}

static Status buffer_check_table(const Buffer *buffer, const ContactLaw *law, const char *pointer,
                                 Problem *problem) {
    const ContactRows *rows = &buffer->table;
    Status status = STATUS_OK;
    const JsonPointer table = json_pointer_of(pointer, "table");
    if (rows->count < 2)
        return problem_add(problem, STATUS_INVALID, table.at,
                           "must have at least two rows, has %zu: restitution and contact_time "
                           "alone hold for every approach speed",
                           rows->count);
    for (size_t i = 0; i < rows->count; i++) {
        const JsonPointer row = json_pointer_at(table.at, i);
        if (buffer_check_restitution(rows->at[i].restitution, law, row.at, problem) != STATUS_OK)
            status = STATUS_INVALID;
        if (law->form != CONTACT_IMPULSIVE && !buffer_has(rows->at[i].contact_time))
            status =
                json_pointer_fault(problem, row.at, "contact_time",
                                   "is required by the contact model %s: contact time T_c of an "
                                   "isolated impact [s]",
                                   law->kind.name);
        if (i == 0 || rows->at[i].approach_speed > rows->at[i - 1].approach_speed)
            continue;
        status = json_pointer_fault_real(
            problem, row.at, "approach_speed", rows->at[i].approach_speed, "m/s",
            "must be above the row before, %s m/s, is %s",
            real_text(rows->at[i - 1].approach_speed).at, real_text(rows->at[i].approach_speed).at);
    }
    return status;
}

static Status buffer_check_power(const Buffer *buffer, const ContactLaw *law, const char *pointer,
                                 Problem *problem) {
    const char *model = law->kind.name;
    if (buffer_has(buffer->damping)) {
        return json_pointer_fault_real(
            problem, pointer, "damping", buffer->damping, "N s/m",
            "is not for the contact model %s, whose damping follows from "
            "restitution: choose spring_damper, or give that instead",
            model);
    }
    if (buffer_has(buffer->stiffness) && buffer_has(buffer->contact_time))
        return problem_add(problem, STATUS_INVALID, pointer,
                           "must be given in one way: contact_time, from which the stiffness of "
                           "each impact follows, or stiffness");
    if (!buffer_has(buffer->stiffness) && !buffer_has(buffer->contact_time))
        return json_pointer_fault(
            problem, pointer, "contact_time",
            "is required by the contact model %s (or a stiffness in N/m^n): contact "
            "time T_c of an isolated impact [s]",
            model);
    if (law->factor != NULL && !buffer_has(buffer->restitution))
        return json_pointer_fault(
            problem, pointer, "restitution",
            "is required by the contact model %s: coefficient of restitution e", model);
    return buffer_check_restitution(buffer->restitution, law, pointer, problem);
}

Status buffer_validate(const Buffer *buffer, const ContactLaw *law, const char *pointer,
                       Problem *problem) {
    if (problem_concerns(problem, pointer))
        return STATUS_INVALID;
    TRY(buffer_check_way(buffer, law, pointer, problem));
    if (buffer->table.count > 0)
        return buffer_check_table(buffer, law, pointer, problem);
    if (law->form == CONTACT_POWER)
        return buffer_check_power(buffer, law, pointer, problem);
    if (law->form == CONTACT_IMPULSIVE && !buffer_has(buffer->restitution))
        return json_pointer_fault(
            problem, pointer, "restitution",
            "is required by the contact model %s, which takes no stiffness and "
            "damping: give a restitution, or choose spring_damper",
            law->kind.name);
    if (law->form != CONTACT_LINEAR || buffer_has(buffer->stiffness))
        return STATUS_OK;
    TRY(buffer_check_restitution(buffer->restitution, law, pointer, problem));
    if (!buffer_has(buffer->contact_time))
        return json_pointer_fault(
            problem, pointer, "contact_time",
            "is required by the contact model %s: contact time T_c of an isolated "
            "impact [s]",
            law->kind.name);
    return STATUS_OK;
}

void buffer_normalise(Buffer *buffer, const ContactLaw *law) {
    if (law->form == CONTACT_IMPULSIVE) {
        buffer->contact_time = buffer->stiffness = buffer->damping = (double)NAN;
        for (size_t i = 0; i < buffer->table.count; i++)
            buffer->table.at[i].contact_time = (double)NAN;
    }
    if (law->form != CONTACT_POWER)
        buffer->exponent = (double)NAN;
    else if (!buffer_has(buffer->exponent))
        buffer->exponent = POWER_LAW_EXPONENT;
    if (law->form == CONTACT_POWER && law->factor == NULL && buffer->table.count == 0)
        buffer->restitution = 1;
}
