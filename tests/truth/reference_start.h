// The state of a run of one type `real` and its start, contacts identified; no guard, for
// reference.c includes it once for each. r is counted from the stop last touched, from
// mid-clearance before. Under zero_force a contact ends where n comes to 0; until the mass is out
// of the buffer (INSIDE) it flies, and n is what the buffer would press.

typedef enum NAME(ExactPhase) {
    NAME(FLIGHT),
    NAME(INSIDE),
    NAME(CONTACT),
    NAME(REST)
} NAME(ExactPhase);

typedef struct NAME(Series) {
    int degree;
    real h, x[TERMS], r[TERMS], g[TERMS], n[TERMS];
} NAME(Series);

typedef struct NAME(ImportContext) {
    const ReferenceScene *scene;
    ReferenceAnswer *answer;
    real omega2, damping, share, effective, base_omega, base_amplitude;
    real contact_omega2[2], contact_damping[2], restitution[2], rate[2], flight_rate;
    real t, x, v, r, w, origin;
    real room[2]; // to either stop at r = 0
    NAME(ExactPhase) phase;
    int side;
    int leaving; // the stop whose force has just come to 0, so that only later crossings count; -1:
                 // none
    size_t sample; // the next one
    size_t kink;   // the record's interval
    real base_speed, last_v;
    ReferenceImpact open;
    real peak, impulse, lost;
    size_t idle;
    real nodes[NODES], weights[NODES];
} NAME(ImportContext);

// At least sqrt(y); rates need no more.
static real NAME(root_bound)(real y) {
    return (real)(sqrt((double)y) * (1 + 1e-9));
}

// Nodes and weights of Gauss and Legendre on [0, 1].
static void NAME(gauss)(NAME(ImportContext) * walk) {
    for (int i = 0; i < NODES; i++) {
        real z = (real)cos(3.141592653589793 * (i + 0.75) / (NODES + 0.5)), slope = 0;
        for (int turn = 0; turn < 8; turn++) {
            real last = 1, here = z;
            for (int j = 2; j <= NODES; j++) {
                const real next = ((real)(2 * j - 1) * z * here - (real)(j - 1) * last) / (real)j;
                last = here, here = next;
            }
            slope = (real)NODES * (z * here - last) / (z * z - 1);
            z -= here / slope;
        }
        walk->nodes[i] = (1 + z) / 2;
        walk->weights[i] = 1 / ((1 - z * z) * slope * slope);
    }
}

// (w T_c)^2 under zero_force. With Z = cos a: a / tan a = -ln(e) / 2 and w T_c = 2 a / sin a;
// beyond critical damping the same with hyperbolic functions.
static real NAME(zero_force)(real loss, real pi) {
    const real half = -loss / 2;
    const bool is_over = half > 1;
    real low = 0, high = is_over ? half + 1 : pi / 2;
    if (half == 1)
        return 4;
    for (int i = 0; i < 150; i++) {
        const real a = (low + high) / 2;
        const real here = is_over ? a * real_cosh(a) / real_sinh(a) : a * real_cos(a) / real_sin(a);
        if ((here < half) == is_over)
            low = a;
        else
            high = a;
    }
    const real turn = (low + high) / (is_over ? real_sinh(low) : real_sin(low));
    return turn * turn;
}

static void NAME(start)(NAME(ImportContext) * walk, const ReferenceScene *scene,
                        ReferenceAnswer *answer) {
    memset(walk, 0, sizeof *walk);
    walk->scene = scene;
    walk->answer = answer;
    const real M = scene->mass, m = scene->damper_mass;
    // pi by Machin's formula, since the types have no constant in common.
    real pi = 0;
    for (int part = 0; part < 2; part++) {
        const real z = part == 0 ? (real)1 / 5 : (real)1 / 239;
        real power = z, sum = 0;
        for (int i = 0; i < 60; i++, power *= -z * z)
            sum += power / (real)(2 * i + 1);
        pi += (part == 0 ? 16 : -4) * sum;
    }
    walk->omega2 = (real)scene->stiffness / M;
    walk->damping = (real)scene->damping / M;
    walk->share = m / (M + m);
    walk->effective = M * m / (M + m);
    if (scene->base == REFERENCE_SINE) {
        walk->base_omega = 2 * pi * (real)scene->frequency;
        walk->base_amplitude = scene->amplitude;
        if (scene->is_amplitude_displacement)
            walk->base_amplitude *= -walk->base_omega * walk->base_omega;
    }
    walk->flight_rate = NAME(root_bound)(walk->omega2) + walk->damping + walk->base_omega;
    for (int side = 0; side < 2; side++) {
        walk->restitution[side] = scene->restitution[side];
        walk->rate[side] = walk->flight_rate;
        if (scene->is_impulse)
            continue;
        const real T = scene->contact_time[side], loss = real_log((real)scene->restitution[side]);
        const real turn = scene->is_zero_force ? NAME(zero_force)(loss, pi) : pi * pi + loss * loss;
        walk->contact_omega2[side] = turn / (T * T);
        walk->contact_damping[side] = -2 * loss / T;
        walk->rate[side] +=
            NAME(root_bound)(walk->contact_omega2[side]) + walk->contact_damping[side];
    }
    walk->x = scene->displacement, walk->v = scene->velocity;
    walk->r = scene->position, walk->w = scene->relative_velocity;
    walk->origin = scene->offset;
    walk->room[0] = walk->room[1] = (real)scene->clearance / 2;
    walk->leaving = -1;
    NAME(gauss)(walk);
}
