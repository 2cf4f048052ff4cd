// Recording, the impact log and the balance of energy of a run.
#include "core/solve/single_mass_state.h"

EnergyState single_mass_energy(const SingleMass *single) {
    const Plan *plan = single->plan;
    const State *at = &single->state;
    const double z = at->v + at->w;
    const double k = single->phase == PHASE_CONTACT
                         ? single->damper->stops[single->side].parameters.stiffness
                         : 0;
    return (EnergyState){0.5 * plan->mass[0] * at->v * at->v + 0.5 * single->damper->mass * z * z,
                         0.5 * plan->stiffness[0] * at->x * at->x + 0.5 * k * at->r * at->r};
}

void single_mass_put(double *column, size_t sample, double value) {
    if (column != NULL)
        column[sample] = value;
}

// The present instant, for the peaks.
Instant single_mass_instant(const SingleMass *single) {
    const State *at = &single->state;
    const double n = single_mass_contact_term(single, at), push = single_mass_push(single, at);
    Instant instant = {.x = at->x,
                       .v = at->v,
                       .acceleration = single->flying.share * n - push,
                       .shear = single->plan->mass[0] * push,
                       .force = single_mass_effective(single) * n};
    if (single->plan->damper_count > 0) {
        instant.damper_x = at->x + (single_mass_origin(single) + at->r);
        instant.damper_v = at->v + at->w;
        if (single->phase == PHASE_CONTACT)
            instant.penetration = single_mass_larger(single_mass_sign(single->side) * at->r, 0);
    }
    return instant;
}

void single_mass_note(SingleMass *single) {
    const Instant at = single_mass_instant(single);
    impact_log_peaks(&single->impacts, &at);
}

// Records the present sample.
void single_mass_record(SingleMass *single) {
    const size_t sample = single->sample;
    const Instant at = single_mass_instant(single);
    double *const *columns = single->columns;
    single_mass_put(columns[CHANNEL_DISPLACEMENT], sample, at.x);
    single_mass_put(columns[CHANNEL_VELOCITY], sample, at.v);
    single_mass_put(columns[CHANNEL_ACCELERATION], sample, at.acceleration);
    single_mass_put(columns[CHANNEL_BASE_SHEAR], sample, at.shear);
    single_mass_put(columns[CHANNEL_MEAN_ACCELERATION], sample,
                    sample == 0 ? at.acceleration
                                : (at.v - single->last_velocity + single->base_speed) *
                                      single->plan->sample_rate);
    single_mass_put(columns[CHANNEL_DAMPER_DISPLACEMENT], sample, at.damper_x);
    single_mass_put(columns[CHANNEL_DAMPER_VELOCITY], sample, at.damper_v);
    single_mass_put(columns[CHANNEL_PENETRATION], sample, at.penetration);
    single_mass_put(columns[CHANNEL_CONTACT_FORCE], sample, at.force);
    if (columns[CHANNEL_BASE_ACCELERATION] != NULL)
        columns[CHANNEL_BASE_ACCELERATION][sample] = base_cursor_at(&single->base, sample);
    single->last_velocity = at.v;
    single->base_speed = 0;
    if (sample >= single->statistics_start) {
        single->squares[0] += at.x * at.x;
        single->squares[1] += at.acceleration * at.acceleration;
        single->statistics_count++;
    }
    impact_log_peaks(&single->impacts, &at);
}

void single_mass_work(SingleMass *single, double vv, double av, double az) {
    impact_log_work(&single->impacts, -single->plan->mass[0] * av - single->damper->mass * az,
                    single->plan->damping[0] * vv);
}

// Enters what waits in `stretch`, and takes the balance of energy.
void single_mass_flush(SingleMass *single) {
    if (single->pending == 0)
        return;
    const Plan *plan = single->plan;
    const Lanes *lanes = &single->lanes;
    double sums[LANE_SUMS], vv = 0, av = 0;
    FlightBlock *stretch = &single->stretch;
    Peaks *peaks = &single->impacts.response->peaks;
    lanes_take_sums(lanes, stretch, sums);
    const double speed = lanes_take_peak(stretch, OF_VELOCITY);
    peaks->velocity = single_mass_larger(peaks->velocity, speed);
    const double push = lanes_take_peak(stretch, OF_ACCELERATION);
    peaks->acceleration = single_mass_larger(peaks->acceleration, push);
    peaks->base_shear = single_mass_larger(peaks->base_shear, plan->mass[0] * push);
    const double damper = lanes_take_peak(stretch, OF_DAMPER);
    if (plan->damper_count > 0)
        peaks->damper_displacement = single_mass_larger(peaks->damper_displacement, damper);
    for (int i = 0; i < LANE_SUMS; i++) {
        vv += lanes->vv[i] * sums[i];
        av += lanes->av[i] * sums[i];
    }
    single_mass_work(single, vv, av, single->free_work);
    if (single->sample >= single->statistics_start) {
        single->squares[0] += sums[XX];
        single->squares[1] += lanes->motion.damping * lanes->motion.damping * sums[VV] +
                              2 * lanes->motion.damping * lanes->motion.omega2 * sums[XV] +
                              lanes->motion.omega2 * lanes->motion.omega2 * sums[XX];
        single->statistics_count += single->pending;
    }
    // It may all be gone again by the time that the balance is taken.
    impact_log_held(&single->impacts, plan->mass[0] * speed * speed / 2);
    impact_log_held(&single->impacts,
                    plan->stiffness[0] * peaks->displacement * peaks->displacement / 2);
    single->free_work = 0;
    single->pending = 0;
    const EnergyState energy = single_mass_energy(single);
    impact_log_balance(&single->impacts, &energy);
}

void single_mass_end_phase(SingleMass *single) {
    rounding_growth_end_phase(&single->growth, single->phase, single->side,
                              single_mass_time(single), &single->state,
                              single->impacts.response->peaks.displacement);
}

void single_mass_note_force(SingleMass *single) {
    const State *at = &single->state;
    impact_log_acceleration(&single->impacts,
                            single->flying.share * single_mass_contact_term(single, at) -
                                single_mass_push(single, at));
}

void single_mass_release(SingleMass *single) {
    single_mass_note(single);
    single_mass_end_phase(single);
    // A speed of the wrong sign is rounding: the gap does open.
    const double sign = single_mass_sign(single->side);
    single->state.r = 0;
    single->state.w = sign * single->state.w < 0 ? single->state.w : 0;
    impact_log_close(&single->impacts, &single->row, single_mass_time(single),
                     fabs(single->state.w));
    single->phase = PHASE_FLIGHT;
    single_mass_note_force(single);
}

void single_mass_pass(SingleMass *single) {
    const bool is_start = single->sample + 1 == single->statistics_start;
    if (is_start)
        single_mass_flush(single);
    single->sample++;
    single->offset = 0;
    if (is_start)
        impact_log_restart_peaks(&single->impacts, single_mass_instant(single).force);
    single_mass_record(single);
}
