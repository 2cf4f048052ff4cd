// With s = shape . (D p + W^2 q) + base_coupling a_g a contact is r'' = s - N / m_e, N = k r + c w,
// and E^2 = w^2 + (k / m_e) r^2 gives |E'| <= |s|. For the structure, V^2 = p'p + q'W^2 q gives V'
// <= growth V + |participation| |a_g| + |shape| |N|, while |s| <= elastic_bound V + |base_coupling|
// |a_g| and |N| <= (k / omega + c) E, omega^2 = k / m_e. So V, E, s and N have bounds over a step.
//
// A stiff contact is split: y = q + m_e shape r feels N only by its damping, and
//   r'' + drag w + spring r = S,   S = base_coupling a_g + shape . (D y' + W^2 y),
//   drag = c / m_e + m_e shape . D shape,   spring = k / m_e + m_e shape . W^2 shape.
// If S were linear in time, a mass that is pressed quasi-statically would stay at
// (S - drag S' / spring) / spring. The distance of r from there grows with the curvature of S,
// which is small: of a deviation d of S the mass follows all but (d'' + drag d') / spring.
//
// The same system with w for r and S' for S bounds N' = k w + c r''. With S' = slope + d and w =
// (slope + d) / spring + e,  f = r'' has f' = -drag f - spring e,  e' = f - d' / spring, so that
// sqrt(f^2 + spring e^2) grows by |d'| / sqrt(spring) at most.
//
// A softer contact lasts through a step where r at both ends is further from 0 than r'' can bend
// it. Where N is surely monotonic its peak is at an end.
#include "core/solve/engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// With FEW_MODES a step is cheaper than a single Taylor step.
enum { FEW_MODES = 24, LEVELS_MIN = 2, LEVELS_OF_MANY_MODES = 3 };
static const double SHORT_STEP = 0.25; // shortest step beyond LEVELS_MIN, times the rate

Status sustained_contact_make(SustainedContact *sustained, const ModalState *state,
                              Problem *problem) {
    const size_t n = state->mode_count, size = simd_kernels_padded(2 * (n + 1) + 2);
    memset(sustained, 0, sizeof *sustained);
    if (state->plan->form != CONTACT_LINEAR || state->dampers == 0)
        return STATUS_OK;
    const SimdArray arrays[] = {{&sustained->start, size},
                                {&sustained->gained, size},
                                {&sustained->pulled, size},
                                {&sustained->elastic, state->padded}};
    sustained->stops = calloc(2 * state->dampers, sizeof *sustained->stops);
    sustained->block = simd_kernels_allocate(arrays, COUNT(arrays));
    if (sustained->stops == NULL || sustained->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes", n);
    sustained->count = 2 * state->dampers;
    for (size_t i = 0; i < SUSTAINED_LEVELS; i++) {
        sustained->length[i] = ldexp(state->interval, -(int)i);
        flight_ground(state->base_omega, sustained->length[i], sustained->ground[i],
                      sustained->fall[i]);
    }
    return STATUS_OK;
}

static void sustained_contact_clear_stop(SustainedStop *stop) {
    for (size_t i = 0; i < SUSTAINED_LEVELS; i++)
        transition_clear(&stop->levels[i]);
    free(stop->damped);
}

void sustained_contact_clear(SustainedContact *sustained) {
    for (size_t i = 0; i < sustained->count; i++)
        sustained_contact_clear_stop(&sustained->stops[i]);
    free(sustained->stops);
    free(sustained->block);
}

// The only damper in contact where all others fly; NULL otherwise.
static DamperState *sustained_contact_find(const ModalState *state) {
    DamperState *alone = NULL;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->phase == PHASE_FLIGHT && damper->zero_gap_terms == 0)
            continue;
        if (damper->phase != PHASE_CONTACT || alone != NULL)
            return NULL;
        alone = damper;
    }
    return alone;
}

// A step costs some products per pair of modes, a Taylor step more of them per mode.
static bool sustained_contact_is_worth(const ModalState *state, double arcs) {
    return state->mode_count <= FEW_MODES || arcs > 2 + (double)state->mode_count / 30;
}

static double sustained_contact_norm(const double *values, size_t count) {
    return sqrt(modal_state_dot(values, values, count));
}

// How many lengths are worth having. The tables of many modes are large.
static size_t sustained_contact_levels(const ModalState *state) {
    const size_t max = state->mode_count <= FEW_MODES ? SUSTAINED_LEVELS : LEVELS_OF_MANY_MODES;
    const double reach = state->interval * modal_state_rate(state);
    size_t levels = LEVELS_MIN;
    while (levels < max && ldexp(reach, -(int)levels) >= SHORT_STEP)
        levels++;
    return levels;
}

// Makes the transitions of a stop once Taylor steps have cost about as much. False: there are none.
static bool sustained_contact_prepare(SustainedContact *sustained, SustainedStop *stop,
                                      const ModalState *state, const DamperState *damper) {
    if (stop->levels[0].block != NULL)
        return true;
    const double n = (double)state->mode_count, arcs = state->interval * modal_state_rate(state);
    if (stop->is_given_up || !isfinite(damper->plan->stops[damper->side].parameters.stiffness) ||
        !sustained_contact_is_worth(state, arcs) || !(arcs < 0x1p20))
        return false;
    if ((stop->spent += n) < 4 * n * n * n)
        return false;
    stop->damped = calloc(2 * state->mode_count, sizeof *stop->damped);
    const Status status =
        stop->damped == NULL
            ? STATUS_NO_MEMORY
            : transition_make(stop->levels, sustained_contact_levels(state), state, damper, NULL);
    if (status != STATUS_OK) {
        sustained->lacks_memory = status == STATUS_NO_MEMORY;
        sustained_contact_clear_stop(stop);
        *stop = (SustainedStop){.is_given_up = true};
        return false;
    }
    stop->bent = stop->damped + state->mode_count;
    for (size_t l = 0; l < state->mode_count; l++) // D' shape: D need not be symmetric
        for (size_t i = 0; i < state->mode_count; i++)
            stop->damped[i] += state->modes->damping[l * state->mode_count + i] * damper->shape[l];
    for (size_t i = 0; i < state->mode_count; i++)
        stop->bent[i] = state->omega2[i] * damper->shape[i];
    stop->wide = sustained_contact_norm(damper->shape, state->mode_count);
    stop->most_damped = sustained_contact_norm(stop->damped, state->mode_count);
    stop->most_bent = sustained_contact_norm(stop->bent, state->mode_count);
    stop->coupling = modal_state_dot(damper->shape, stop->damped, state->mode_count);
    stop->bending = modal_state_dot(damper->shape, stop->bent, state->mode_count);
    return true;
}

// Upper bounds over the whole step.
typedef struct SustainedBounds {
    double size, pull;          // V, and |p'| without N
    double ground, ground_rate; // |a_g|, |a_g'|
    double force;               // |N|
} SustainedBounds;

// |p'| without N.
static double sustained_contact_pull(const ModalState *state, const SustainedBounds *at) {
    return (state->viscous + sqrt(state->stiff)) * at->size +
           state->participation_norm * at->ground;
}

// SustainedBounds without N. False: V may grow too much.
static bool sustained_contact_find_bounds(const ModalState *state, const Slice *slice, double h,
                                          SustainedBounds *at) {
    const double left = 1 - h * state->growth;
    at->ground = flight_max_ground(slice, h);
    at->ground_rate = slice->omega > 0 ? slice->omega * at->ground : fabs(slice->slope);
    at->size = (modal_state_size(state) + h * state->participation_norm * at->ground) / left;
    at->pull = sustained_contact_pull(state, at);
    at->force = 0;
    return left > 0.5;
}

// s' now. `coupled_force` is the part of N; p' without N is -elastic - participation a_g.
static double sustained_contact_rate(const SustainedStop *stop, const ModalState *state,
                                     const DamperState *damper, const Slice *slice,
                                     const double *elastic, double coupled_force) {
    const double *share = state->modes->participation;
    const double rate = slice->omega > 0 ? slice->omega * slice->slope : slice->slope;
    double sum = damper->base_coupling * rate + coupled_force;
    for (size_t i = 0; i < state->mode_count; i++)
        sum +=
            stop->bent[i] * state->p[i] - stop->damped[i] * (elastic[i] + share[i] * slice->value);
    return sum;
}

// The start of a step: a_g, D p + W^2 q, and s.
typedef struct SustainedStart {
    const Slice *slice;
    const double *elastic;
    double s;
} SustainedStart;

// |s''| without the part of N', for |N| <= force.
static double sustained_contact_curvature(const SustainedStop *stop, const ModalState *state,
                                          const DamperState *damper, const Slice *slice,
                                          const SustainedBounds *at, double force) {
    const double pull = at->pull + stop->wide * force;
    return fabs(damper->base_coupling) * slice->omega * at->ground_rate + stop->most_bent * pull +
           stop->most_damped * (state->viscous * pull + state->stiff * at->size +
                                state->participation_norm * at->ground_rate);
}

// What a step of any length over a stiff contact begins with.
typedef struct StiffStart {
    double spring, omega, drag, hard;
    double slope;     // S'
    double start;     // r of a mass pressed quasi-statically
    double deviation; // from that, of (w, omega r)
    double strayed;   // the same of N', over `hard`
} StiffStart;

// False: the contact rings too much for a step of any length.
static bool sustained_contact_stiff_start(const SustainedStop *stop, const ModalState *state,
                                          const DamperState *damper, const SustainedStart *from,
                                          StiffStart *at) {
    const double r = damper->r, w = damper->w, sign = modal_state_sign(damper->side);
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double mass = damper->effective_mass;
    at->spring = k / mass + mass * stop->bending;
    at->omega = sqrt(at->spring);
    at->drag = c / mass + mass * stop->coupling;
    at->hard = k / at->omega + c;
    const double S = from->s + mass * (stop->coupling * w + stop->bending * r);
    at->slope = sustained_contact_rate(stop, state, damper, from->slice, from->elastic,
                                       mass * stop->coupling * from->s) +
                mass * stop->bending * w;
    at->start = (S - at->drag * at->slope / at->spring) / at->spring;
    at->deviation = hypot(w - at->slope / at->spring, at->omega * (r - at->start));
    const double leap = from->s - (k * r + c * w) / mass; // r''
    at->strayed = hypot(leap, at->omega * (w - at->slope / at->spring));
    const double force = k * at->start + c * at->slope / at->spring;
    if (!state->is_shadow &&
        fabs(force) + at->hard * at->deviation >
            impact_log_least_force(&state->impacts, &damper->row) &&
        !(k * fabs(at->slope) / at->spring > at->hard * at->strayed))
        return false;
    return state->plan->separation == SEPARATION_ZERO_FORCE
               ? sign * force > at->hard * at->deviation
               : sign * at->start > at->deviation / at->omega;
}

static bool sustained_contact_stiff_lasts(const SustainedStop *stop, const ModalState *state,
                                          const DamperState *damper, const SustainedStart *from,
                                          const StiffStart *stiff, double h, SustainedBounds *at) {
    const double sign = modal_state_sign(damper->side);
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double mass = damper->effective_mass,
                 extra = mass * fabs(damper->base_coupling) * stop->wide;
    const double spring = stiff->spring, omega = stiff->omega, hard = stiff->hard,
                 slope = stiff->slope;
    // |S''| <= bow + more |N|, and the part of it that the mass does not follow.
    const double swing = state->viscous + sqrt(state->stiff), lift = 2 * h * stop->wide; // of V
    const double more = stop->most_damped * state->viscous * stop->wide +
                        lift * (stop->most_bent * swing +
                                stop->most_damped * (state->viscous * swing + state->stiff));
    const double bow = sustained_contact_curvature(stop, state, damper, from->slice, at, 0) +
                       extra * (stop->most_bent * at->ground + stop->most_damped * at->ground_rate);
    const double left =
        fmin((2 * h + stiff->drag * h * h / 2) / spring + h * h / 2 / omega, h * h * h / 6);
    // r and N of a mass pressed quasi-statically, at both ends.
    const double start = stiff->start, end = start + h * slope / spring;
    const double forces[2] = {k * start + c * slope / spring, k * end + c * slope / spring};
    const double largest = fmax(fabs(forces[0]), fabs(forces[1])), share = hard * left * more;
    if (!(share < 0.5))
        return false;
    at->force = (largest + hard * (stiff->deviation + left * bow)) / (1 - share);
    const double bent = bow + more * at->force, excited = stiff->deviation + left * bent;
    at->size += lift * at->force;
    // A force that may be the largest so far must be at an end of the step, as N' keeps its sign.
    const double strayed = stiff->strayed + h * bent / omega;
    if (!state->is_shadow && at->force > impact_log_least_force(&state->impacts, &damper->row) &&
        !(k * (fabs(slope) - h * bent) / spring > hard * strayed))
        return false;
    if (state->plan->separation == SEPARATION_ZERO_FORCE)
        return fmin(sign * forces[0], sign * forces[1]) > hard * excited;
    return fmin(sign * start, sign * end) > excited / omega;
}

// `moved` and `sped` are the increments of r and w.
static bool sustained_contact_soft_lasts(const SustainedStop *stop, const ModalState *state,
                                         const DamperState *damper, const SustainedStart *from,
                                         double moved, double sped, double h, SustainedBounds *at) {
    const double sign = modal_state_sign(damper->side), mass = damper->effective_mass;
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double omega = sqrt(k / mass), hard = k / omega + c,
                 base_coupling = fabs(damper->base_coupling);
    const double r = sign * damper->r, now = k * damper->r + c * damper->w;
    const double then = now + (k * moved + c * sped), sag = h * h / 8;
    const double size = hypot(damper->w, omega * damper->r), lift = 2 * h * stop->wide * hard;
    const double left = 1 - lift * h * damper->elastic_bound;
    if (!(left > 0.25))
        return false;
    at->size = (at->size + lift * (size + h * base_coupling * at->ground)) / left;
    at->pull = sustained_contact_pull(state, at);
    const double push = base_coupling * at->ground + damper->elastic_bound * at->size,
                 most = size + h * push;
    at->force = hard * most;
    const double bend = push + at->force / mass; // |r''|
    const double change = stop->most_damped * (at->pull + stop->wide * at->force) +
                          stop->most_bent * at->size + base_coupling * at->ground_rate; // |s'|
    const double rate = k * most + c * bend;                                            // |N'|
    const double turn = change + rate / mass;                                           // |r'''|
    const double climb = k * bend + c * turn;                                           // |N''|
    if (state->plan->separation == SEPARATION_ZERO_FORCE
            ? !(sign * now > sag * climb && sign * then > sag * climb)
            : !(r > sag * bend && r + sign * moved > sag * bend))
        return false;
    if (state->is_shadow || fmax(fabs(now), fabs(then)) + sag * climb <=
                                impact_log_least_force(&state->impacts, &damper->row))
        return true;
    // N is monotonic where N' keeps its sign.
    const double leap = from->s - now / mass, rise = k * damper->w + c * leap; // r'', N'
    if (fabs(rise) > h * climb)
        return true;
    const double slope = sustained_contact_rate(stop, state, damper, from->slice, from->elastic,
                                                stop->coupling * now);
    const double curve = k * leap + c * (slope - rise / mass); // N''
    const double bow =
        sustained_contact_curvature(stop, state, damper, from->slice, at, at->force) +
        stop->coupling * rate;
    const double stray = k * turn + c * (bow + climb / mass); // |N'''|
    const double up = rise > 0 ? 1 : -1;
    return fmin(up * rise, up * (rise + h * curve)) > h * h / 2 * stray;
}

// Whether all other masses stay in flight. Sets their storey_speed and gained.
static bool sustained_contact_others_are_clear(const SustainedContact *sustained, ModalState *state,
                                               const DamperState *alone, const SustainedBounds *at,
                                               double length, double fallen) {
    const size_t n = state->mode_count, a = (size_t)(alone - state->damper);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (d == a)
            continue;
        const double bend = damper->elastic_bound * at->size +
                            fabs(damper->base_coupling) * at->ground +
                            fabs(state->delassus[d * state->dampers + a]) * at->force;
        damper->storey_speed = modal_state_dot(damper->shape, state->p, n);
        damper->gained = length * (damper->storey_speed + damper->w) - fallen -
                         modal_state_dot(damper->shape, sustained->gained, n);
        if (!flight_is_clear(damper, damper->r, damper->r + damper->gained, bend, length))
            return false;
    }
    return true;
}

// y' form y with y at the start.
static double sustained_contact_form(const SustainedContact *sustained,
                                     const Transition *transition, const SimdKernels *lanes,
                                     const double *form) {
    lanes->multiply(form, transition->rows, sustained->start, transition->size, sustained->pulled);
    return modal_state_dot(sustained->start, sustained->pulled, transition->size);
}

static void sustained_contact_add_work(const SustainedContact *sustained,
                                       const Transition *transition, ModalState *state,
                                       DamperState *alone, const Slice *slice, double length,
                                       StepWork *work) {
    const size_t n = state->mode_count;
    const double *start = sustained->start, *gained = sustained->gained;
    work->damping = sustained_contact_form(sustained, transition, state->lanes, transition->loss);
    work->input = -(slice->value * modal_state_dot(transition->input[0], start, transition->size) +
                    slice->slope * modal_state_dot(transition->input[1], start, transition->size));
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        if (damper != alone)
            work->input -= damper->plan->mass * work->ground *
                           (damper->storey_speed + damper->w - work->ground / 2);
    }
    // From the change of the mass's own momentum.
    const double impulse = -alone->plan->mass * (modal_state_dot(alone->shape, gained + n + 1, n) +
                                                 gained[2 * n + 1] + work->ground);
    const double force = alone->contact.stiffness * (alone->r + gained[n]) +
                         alone->contact.damping * (alone->w + gained[2 * n + 1]);
    impact_log_force(&state->impacts, &alone->row, fabs(force));
    impact_log_stretch(
        &state->impacts, &alone->row, length, impulse,
        sustained_contact_form(sustained, transition, state->lanes, transition->contact));
}

// The increments of (q, r, p, w) over a step.
static void sustained_contact_find_gained(SustainedContact *sustained, const Transition *transition,
                                          const ModalState *state, const DamperState *alone,
                                          const Slice *slice) {
    const size_t n = state->mode_count, freedoms = n + 1;
    double *start = sustained->start;
    memcpy(start, state->q, n * sizeof *start);
    memcpy(start + freedoms, state->p, n * sizeof *start);
    start[n] = alone->r;
    start[freedoms + n] = alone->w;
    start[2 * freedoms] = slice->value;
    start[2 * freedoms + 1] = slice->slope;
    state->lanes->multiply(transition->gain, transition->rows, start, transition->size,
                           sustained->gained);
}

static void sustained_contact_move(const SustainedContact *sustained, ModalState *state,
                                   DamperState *alone, double ground) {
    const size_t n = state->mode_count;
    const double *gained = sustained->gained, *speed = gained + n + 1;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper == alone)
            continue;
        damper->r += damper->gained;
        damper->w -= ground + modal_state_dot(damper->shape, speed, n);
    }
    for (size_t i = 0; i < n; i++) {
        state->q[i] += gained[i];
        state->p[i] += speed[i];
    }
    alone->r += gained[n];
    alone->w += speed[n];
    alone->just_begun = false;
    state->events_at_instant = 0;
}

double sustained_contact_step(SustainedContact *sustained, ModalState *state, const Slice *slice,
                              double length, StepWork *work) {
    DamperState *alone = sustained->count > 0 ? sustained_contact_find(state) : NULL;
    if (alone == NULL)
        return 0;
    // Equal buffers of a damper share one.
    const ContactStop *stops = alone->plan->stops;
    const bool are_alike = stops[0].parameters.stiffness == stops[1].parameters.stiffness && //
                           stops[0].parameters.damping == stops[1].parameters.damping;
    SustainedStop *stop =
        &sustained->stops[2 * (size_t)(alone - state->damper) + (are_alike ? 0 : alone->side)];
    if (!sustained_contact_prepare(sustained, stop, state, alone))
        return 0;
    modal_state_elastic(state, state->q, state->p, sustained->elastic);
    const SustainedStart from = {
        slice, sustained->elastic,
        alone->base_coupling * slice->value +
            modal_state_dot(alone->shape, sustained->elastic, state->mode_count)};
    const double rate = modal_state_rate(state);
    const double omega = sqrt(alone->contact.stiffness / alone->effective_mass);
    const size_t levels = sustained_contact_levels(state);
    StiffStart stiff;
    const bool is_steady = sustained_contact_stiff_start(stop, state, alone, &from, &stiff);
    for (size_t i = 0; i < levels && sustained_contact_is_worth(state, sustained->length[i] * rate);
         i++) {
        const Transition *transition = &stop->levels[i];
        const double h = sustained->length[i];
        const bool is_soft = h * omega < 1;
        SustainedBounds at;
        if (h > length * (1 + 1e-15) || transition->block == NULL || (!is_soft && !is_steady))
            continue;
        if (!sustained_contact_find_bounds(state, slice, h, &at))
            continue;
        if (!is_soft && !sustained_contact_stiff_lasts(stop, state, alone, &from, &stiff, h, &at))
            continue;
        sustained_contact_find_gained(sustained, transition, state, alone, slice);
        if (is_soft && !sustained_contact_soft_lasts(
                           stop, state, alone, &from, sustained->gained[state->mode_count],
                           sustained->gained[2 * state->mode_count + 1], h, &at))
            continue;
        const double *ground = sustained->ground[i], *fall = sustained->fall[i];
        const double fallen = fall[0] * slice->value + fall[1] * slice->slope;
        if (!sustained_contact_others_are_clear(sustained, state, alone, &at, h, fallen))
            continue;
        const double sum = ground[0] * slice->value + ground[1] * slice->slope;
        if (work != NULL) {
            work->ground = sum;
            sustained_contact_add_work(sustained, transition, state, alone, slice, h, work);
        }
        sustained_contact_move(sustained, state, alone, sum);
        return h;
    }
    return 0;
}
