// What happens where a mass meets a stop, leaves it or rests on it. Impulses are found by trying
// every set of pressed stops.
#include "tests/truth/frame_reference_walk.h"

static const Quad CLOSING = 1e-18;

Quad walk_room(const ImportContext *walk, size_t d, int side) {
    const Quad clearance = walk->plan->dampers[d].clearance;
    return walk->mass[d].at < 0 ? clearance / 2 : walk->mass[d].at == side ? 0 : clearance;
}

static void open_row(ImportContext *walk, size_t d, bool is_resting, Quad approach) {
    Mass *mass = &walk->mass[d];
    mass->is_open = true;
    mass->impulse = mass->lost = mass->peak = 0;
    mass->open = (TruthImpact){.is_resting = is_resting,
                               .damper = d,
                               .side = mass->side,
                               .start = (double)walk->t,
                               .end = NAN,
                               .approach = is_resting ? NAN : (double)approach,
                               .separation = NAN};
}

void walk_close_row(ImportContext *walk, size_t d, double end, double separation) {
    Mass *mass = &walk->mass[d];
    mass->open.end = end;
    mass->open.separation = separation;
    mass->open.impulse = fabs((double)mass->impulse);
    mass->open.lost = (double)mass->lost;
    mass->open.peak = (double)mass->peak;
    mass->is_open = false;
    if (walk->truth->impact_count < IMPACTS_MAX)
        walk->truth->impacts[walk->truth->impact_count++] = mass->open;
}

static void push(ImportContext *walk, const Quad *impulses) {
    for (size_t d = 0; d < walk->m; d++) {
        for (size_t j = 0; j < walk->n; j++)
            walk->v[j] += walk->inverse[j][walk->plan->dampers[d].storey] * impulses[d];
        for (size_t e = 0; e < walk->m; e++)
            walk->mass[e].w -= walk->yield[e][d] * impulses[d];
    }
}

// Every set of pressed stops is tried until one meets all conditions.
static void collide(ImportContext *walk, const bool *is_met, const Quad *parting, Quad *impulses) {
    for (unsigned set = (1U << walk->m); set-- > 0;) {
        ImportContext trial = *walk;
        Quad want[D] = {0};
        bool is_good = true;
        for (size_t d = 0; d < walk->m; d++) {
            const bool is_in = (set >> d & 1) != 0;
            const bool is_held = is_met[d] && walk->plan->dampers[d].clearance == 0;
            is_good = is_good && (is_met[d] || !is_in) && (is_in || !is_held);
            trial.mass[d].phase = is_in ? RESTING : FLYING;
            want[d] = walk->mass[d].w + walk_sign(walk->mass[d].side) * parting[d];
            impulses[d] = 0;
        }
        if (!is_good)
            continue;
        walk_constrain(&trial, want, impulses);
        push(&trial, impulses);
        for (size_t d = 0; d < walk->m; d++) {
            const Quad sign = walk_sign(walk->mass[d].side);
            if ((set >> d & 1) != 0)
                is_good =
                    is_good && (sign * impulses[d] >= 0 || walk->plan->dampers[d].clearance == 0);
            else if (is_met[d])
                is_good = is_good && -sign * trial.mass[d].w >= parting[d] - (Quad)1e-28;
        }
        if (is_good)
            break;
    }
    push(walk, impulses);
}

static void rest(ImportContext *walk, size_t d) {
    Mass *mass = &walk->mass[d];
    mass->phase = RESTING;
    mass->zeros = 0;
    mass->w = mass->u = 0;
    open_row(walk, d, true, 0);
}

static void bounce(ImportContext *walk, size_t d) {
    bool is_met[D] = {false};
    Quad parting[D] = {0}, closing[D] = {0}, impulses[D];
    for (size_t e = 0; e < walk->m; e++) {
        Mass *mass = &walk->mass[e];
        is_met[e] = mass->phase == RESTING || e == d;
        const int side = mass->w > 0 ? SIDE_RIGHT : SIDE_LEFT;
        // Masses that are to meet their stops at the same instant do so but for the last digits.
        if (mass->phase == FLYING && e != d && mass->w != 0 &&
            walk_room(walk, e, side) - walk_sign(side) * mass->u < (Quad)1e-20 * fabsq(mass->w)) {
            is_met[e] = true;
            mass->side = mass->at = side;
            mass->u = 0;
        }
        if (is_met[e] && mass->phase == FLYING) {
            closing[e] = walk_sign(mass->side) * mass->w;
            mass->e = walk->plan->dampers[e].stops[mass->side].parameters.restitution;
            parting[e] = walk->plan->dampers[e].clearance > 0 ? mass->e * closing[e] : 0;
        }
    }
    collide(walk, is_met, parting, impulses);
    for (size_t e = 0; e < walk->m; e++) {
        Mass *mass = &walk->mass[e];
        const Quad sign = walk_sign(mass->side);
        if (!is_met[e])
            continue;
        if (mass->phase == RESTING) {
            mass->impulse += impulses[e];
            if (impulses[e] == 0 && -sign * mass->w > 0) {
                walk_close_row(walk, e, (double)walk->t, NAN);
                mass->phase = FLYING;
                mass->zeros = 1;
            } else {
                mass->w = 0;
            }
            continue;
        }
        if (impulses[e] != 0)
            mass->w = -sign * parting[e];
        mass->zeros = 1;
        if (walk->plan->dampers[e].clearance == 0) {
            rest(walk, e);
            mass->impulse = impulses[e];
            mass->lost = fabsq(impulses[e]) * closing[e] / 2;
            continue;
        }
        open_row(walk, e, false, closing[e]);
        mass->impulse = impulses[e];
        mass->lost = fabsq(impulses[e]) * (closing[e] - parting[e]) / 2;
        walk_close_row(walk, e, (double)walk->t, (double)parting[e]);
        walk->truth->impacts[walk->truth->impact_count - 1].peak = NAN;
    }
    for (size_t e = 0; e < walk->m; e++) {
        Mass *mass = &walk->mass[e];
        if (!is_met[e] || mass->phase != FLYING || mass->u != 0 || closing[e] == 0)
            continue;
        const Quad pull = walk_sign(mass->side) * walk_acceleration(walk, e);
        if (pull > 0 && 2 * parting[e] / (pull * (1 - mass->e)) < CLOSING) {
            Quad last[D] = {0};
            last[e] = mass->w / walk->yield[e][e];
            push(walk, last);
            rest(walk, e);
        }
    }
}

void walk_touch(ImportContext *walk, size_t d, int side) {
    Mass *mass = &walk->mass[d];
    const ContactStop *stop = &walk->plan->dampers[d].stops[side];
    mass->side = mass->at = side;
    mass->u = 0;
    if (walk->plan->form != CONTACT_LINEAR) {
        bounce(walk, d);
        return;
    }
    mass->phase = TOUCHING;
    mass->k = stop->parameters.stiffness;
    mass->c = stop->parameters.damping;
    mass->zeros = 1;
    open_row(walk, d, false, fabsq(mass->w));
    mass->peak = fabsq(mass->c * mass->w);
}

static Quad spring(const Mass *mass) {
    return mass->k * mass->u * mass->u / 2;
}

void walk_end_phase(ImportContext *walk, size_t d, bool is_inwards) {
    Mass *mass = &walk->mass[d];
    const Quad sign = walk_sign(mass->side);
    if (mass->phase == RESTING) {
        walk_close_row(walk, d, (double)walk->t, NAN);
        mass->phase = FLYING;
        mass->zeros = 3;
        mass->u = mass->w = 0;
        if (walk->plan->dampers[d].clearance == 0) {
            mass->side = mass->at = 1 - mass->side;
            rest(walk, d);
        }
        return;
    }
    if (mass->phase == INSIDE && is_inwards) {
        mass->phase = TOUCHING;
        mass->zeros = 1;
        open_row(walk, d, false, sign * mass->w > 0 ? sign * mass->w : 0);
        mass->lost = -spring(mass);
        return;
    }
    const bool was_touching = mass->phase == TOUCHING;
    const bool stays = was_touching && walk->plan->separation == SEPARATION_ZERO_FORCE;
    if (stays)
        mass->lost += spring(mass);
    mass->zeros = 1;
    mass->phase = stays ? INSIDE : FLYING;
    if (!stays)
        mass->u = 0;
    if (was_touching)
        walk_close_row(walk, d, (double)walk->t, fabs((double)mass->w));
}
