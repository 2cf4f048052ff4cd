#include "core/simulation/impulse_variant.h"

// Buffers known by stiffness and damping alone have the restitution that these come to.
static Status fill_restitution(Simulation *target, Problem *problem) {
    PlanReport report;
    TRY(simulation_plan(target, &report, problem));
    for (size_t i = 0; i < target->scene.dampers.count; i++) {
        Damper *damper = &target->scene.dampers.at[i];
        for (int side = SIDE_LEFT; side <= SIDE_RIGHT; side++) {
            Buffer *const own[] = {&damper->left_buffer, &damper->right_buffer};
            Buffer *buffer = buffer_is_given(own[side]) ? own[side] : &damper->buffer;
            if (buffer->table.count > 0 || !isnan(buffer->restitution))
                continue;
            buffer->restitution = report.derived.at[2 * i + (size_t)side].restitution;
            buffer->stiffness = buffer->damping = (double)NAN;
        }
    }
    fields_clear(plan_report_fields, &report);
    return STATUS_OK;
}

Status impulses_take(Simulation *target, Problem *problem) {
    TRY(fill_restitution(target, problem));
    Variant *contact = variant_new(&contact_impulse.kind);
    if (contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a contact model");
    variant_free(target->scene.contact);
    target->scene.contact = contact;
    return STATUS_OK;
}
