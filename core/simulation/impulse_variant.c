#include "core/simulation/impulse_variant.h"

#include <math.h>

static void impulse_variant_fill(const DerivedList *derived, Dampers *dampers) {
    for (size_t i = 0; i < derived->count; i++) {
        Damper *damper = &dampers->at[i / 2];
        Buffer *const own = i % 2 == SIDE_LEFT ? &damper->left_buffer : &damper->right_buffer;
        Buffer *buffer = buffer_is_given(own) ? own : &damper->buffer;
        if (buffer->table.count > 0 || !isnan(buffer->restitution))
            continue;
        buffer->restitution = derived->at[i].restitution;
        buffer->stiffness = buffer->damping = (double)NAN;
    }
}

Status impulse_variant_apply(Simulation *simulation, Problem *problem) {
    Plan *plan;
    const char *solver = simulation->accuracy->kind->name;
    TRY(plan_new(&simulation->scene, solver, solver, &plan, problem));
    impulse_variant_fill(&plan->report.derived, &simulation->scene.dampers);
    plan_free(plan);
    Variant *contact = variant_new(&contact_impulse.kind);
    if (contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a contact model");
    variant_free(simulation->scene.contact);
    simulation->scene.contact = contact;
    return STATUS_OK;
}
