#include "tests/support/frames.h"

#include <math.h>
#include <stdlib.h>

Plan *frames_new(size_t storeys, size_t dampers, double duration, double sample_rate) {
    Plan *plan = calloc(1, sizeof *plan);
    double *block = calloc(storeys, (3 * storeys + 3) * sizeof *block);
    PlanDamper *damper = calloc(dampers + 1, sizeof *damper);
    if (plan == NULL || block == NULL || damper == NULL)
        abort();
    plan->storeys = storeys;
    plan->mass = block;
    plan->stiffness = block + storeys * storeys;
    plan->damping = block + 2 * storeys * storeys;
    plan->influence = block + 3 * storeys * storeys;
    plan->displacement = plan->influence + storeys;
    plan->velocity = plan->displacement + storeys;
    for (size_t i = 0; i < storeys; i++)
        plan->influence[i] = 1;
    plan->dampers = damper;
    plan->damper_count = dampers;
    plan->form = CONTACT_LINEAR;
    plan->duration = duration;
    plan->sample_rate = sample_rate;
    plan->count = (size_t)(duration * sample_rate * (1 + 1e-12)) + 1;
    return plan;
}

void frames_shear(Plan *plan, const double *mass, const double *stiffness, const double *damping) {
    const size_t n = plan->storeys;
    for (size_t i = 0; i < n; i++) {
        double *const matrices[] = {plan->stiffness, plan->damping};
        const double *const values[] = {stiffness, damping};
        plan->mass[i * n + i] = mass[i];
        for (int k = 0; k < 2; k++) {
            matrices[k][i * n + i] = values[k][i] + (i + 1 < n ? values[k][i + 1] : 0);
            if (i > 0)
                matrices[k][i * n + i - 1] = matrices[k][(i - 1) * n + i] = -values[k][i];
        }
    }
}

void frames_uniform(Plan *plan, double mass, double stiffness, double damping_ratio) {
    const size_t n = plan->storeys;
    double *values = calloc(n, 3 * sizeof *values);
    if (values == NULL)
        abort();
    const double first = 2 * sqrt(stiffness / mass) * sin(acos(-1) / (2 * (2 * (double)n + 1)));
    for (size_t i = 0; i < n; i++) {
        values[i] = mass;
        values[n + i] = stiffness;
        values[2 * n + i] = 2 * damping_ratio / (11 * first) * stiffness;
    }
    frames_shear(plan, values, values + n, values + 2 * n);
    for (size_t i = 0; i < n; i++)
        plan->damping[i * n + i] += 2 * damping_ratio * 10 * first / 11 * mass;
    free(values);
}

void frames_damper(Plan *plan, size_t index, size_t storey, double mass, double clearance,
                   double restitution, double contact_time) {
    PlanDamper *damper = &plan->dampers[index];
    damper->storey = storey;
    damper->mass = mass;
    damper->clearance = clearance;
    damper->effective_mass = 1 / (1 / mass + 1 / plan->mass[storey * plan->storeys + storey]);
    if (isnan(contact_time))
        plan->form = CONTACT_IMPULSIVE;
    const Identification identified = identification_from_restitution(
        damper->effective_mass, restitution, contact_time, SEPARATION_ZERO_PENETRATION);
    for (int side = 0; side < 2; side++) {
        damper->stops[side].parameters.restitution = restitution;
        damper->stops[side].parameters.stiffness = identified.stiffness;
        damper->stops[side].parameters.damping = identified.damping;
    }
}
