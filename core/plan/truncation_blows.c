// A free mass meets its stops about twice a swing with the storey's own speed V, and leaves an
// impulse J = m_e (1 + e) V. Of that a mode takes phi J C(w T_c) / w, where C tells a blow that
// lasts from an instant: a mode that swings often meanwhile only gives way.
//
// A part of each impulse is wrong: what the modes left out would have given way of 1 / m_e, and
// what of the speed was theirs. What one impact gets wrong the next ones carry on, each some more.
#include "core/plan/truncation_blows.h"

#include <math.h>

static const double pi = 3.14159265358979323846;
static const double ROUNDING = 1e-15;
// More of a wrong, from one impact to the next, as a logarithm; the last impacts of a free motion
// come at a time that hangs on all before.
static const double CARRIED = 0.35, CARRIED_FREE = 0.7;

// C of a blow that lasts: no more than a half-sine's.
static double lasting(double omega, double time) {
    const double turn = 2 * omega * time / pi;
    return turn > 1 ? 1 / turn : 1;
}

static double speed_of(const Level *level, const Wave *wave, double omega) {
    return level->peak * omega +
           hypot(level->pushed[0], level->pushed[1]) * sqrt(wave->accelerated);
}

static double square(double x) {
    return x * x;
}

bool blows_start(Blows *blows, const Plan *plan, size_t damper, const Level *levels,
                 const Wave *wave) {
    const PlanDamper *of = &plan->dampers[damper];
    const Derived *derived = &plan->report.derived.at[2 * damper];
    const Modes *modes = &plan->modes;
    const size_t n = modes->count;
    double restitution = fmax(derived[0].restitution, derived[1].restitution);
    double time = fmin(derived[0].contact_time, derived[1].contact_time), reach = 0, speed = 0;
    *blows = (Blows){.plan = plan, .levels = levels, .storey = of->storey};
    restitution = isnan(restitution) ? 0.7 : restitution;
    blows->time = isnan(time) || !isfinite(time) ? 0 : time;
    for (size_t k = 0; k < n; k++) {
        const double shape = modes->shapes[of->storey * n + k];
        const double omega = fmax(modes->omega[k], 1 / plan->duration);
        reach += square(shape * (levels[k].peak + hypot(levels[k].pushed[0], levels[k].pushed[1])));
        speed += square(shape * speed_of(&levels[k], wave, omega));
    }
    blows->reach = sqrt(reach);
    blows->speed = sqrt(speed) + fabs(of->velocity);
    const double room = of->clearance / 2 - fabs(of->position);
    // Its speed is relative to the storey's, which the mass keeps.
    const double drift = fabs(plan->velocity[of->storey] + of->velocity) * plan->duration;
    if (wave->rms == 0 && 2 * blows->reach + drift < room)
        return false;
    blows->carried = wave->rms == 0 ? CARRIED_FREE : CARRIED;
    blows->yield = 1 / of->effective_mass;
    blows->impulse = of->effective_mass * (1 + restitution) * blows->speed;
    const double swing = blows->reach > 0 ? blows->speed / blows->reach / (2 * pi) : 0;
    const double slack = fmax(modes->damping[0] / 2, 1e-300);
    blows->count = 2 * swing * plan->duration;
    blows->remembered = 2 * swing * fmin(plan->duration, 1 / slack);
    for (size_t k = 0; k < n; k++) {
        const double omega = fmax(modes->omega[k], 1 / plan->duration);
        const double taken = square(modes->shapes[of->storey * n + k]) * blows->impulse *
                             lasting(omega, blows->time);
        blows->moved += taken / omega;
        blows->pulled += square(taken * omega);
    }
    return true;
}

Blow blows_leave(Blows *blows, size_t k) {
    const Plan *plan = blows->plan;
    const Modes *modes = &plan->modes;
    const double shape = modes->shapes[blows->storey * modes->count + k];
    const double omega = fmax(modes->omega[k], 1 / plan->duration);
    const double slack = fmax(modes->damping[k * (modes->count + 1)] / 2, 1 / plan->duration);
    const double taken = shape * shape * blows->impulse * lasting(omega, blows->time);
    const double often = sqrt(1 + blows->count / plan->duration / (2 * slack));
    blows->struck += taken / omega * often;
    blows->struck_pull = hypot(blows->struck_pull, taken * omega * often);
    blows->stiff += shape * shape / (1 + square(omega * blows->time / pi)) / blows->yield;
    blows->still = hypot(blows->still, shape * blows->levels[k].peak * omega);
    // Rounding alone parts such motions, and leaving out any mode changes it.
    const double wrong =
        ROUNDING + blows->stiff + (blows->still + blows->struck * omega) / blows->speed;
    const double grown = wrong * exp(fmin(blows->carried * blows->count, 40));
    const double part = fmin(grown, 1) * sqrt(1 + blows->remembered);
    return (Blow){.displacement = blows->struck + blows->moved * part,
                  .acceleration = blows->struck_pull + sqrt(blows->pulled) * part,
                  .rms = blows->struck + blows->moved * part};
}
