// A run of one type `real` from its start to its end; no guard, for reference.c includes it once
// for each.
//
// Between two events and kinks the system is linear with a polynomial or sine input. Its power
// series is summed over sub-steps so short that the fastest rate turns less than a radian; each is
// searched for its first event. Contact integrals are Gauss's. Contact adds n = N / m_e:
//   x'' = -a_g - s + share n,  r'' = s - n,  s = (C x' + K x) / M,  n = (c r' + k r) / m_e, or s
//   while resting.

// a_g and its slope (sine: the cosine part) from time t on, and the next kink.
static real NAME(base)(NAME(ImportContext) * walk, real *value, real *slope) {
    const ReferenceScene *scene = walk->scene;
    *value = *slope = 0;
    if (scene->base == REFERENCE_SINE) {
        const real angle = walk->base_omega * walk->t;
        *value = walk->base_amplitude * real_sin(angle);
        *slope = walk->base_amplitude * real_cos(angle);
    }
    if (scene->base != REFERENCE_RECORD)
        return (real)INFINITY;
    const real interval = scene->interval;
    while (walk->kink + 1 < scene->sample_count && walk->t >= (real)(walk->kink + 1) * interval)
        walk->kink++;
    if (walk->kink + 1 >= scene->sample_count)
        return (real)INFINITY;
    *slope = ((real)scene->samples[walk->kink + 1] - (real)scene->samples[walk->kink]) / interval;
    *value = (real)scene->samples[walk->kink] + *slope * (walk->t - (real)walk->kink * interval);
    return (real)(walk->kink + 1) * interval;
}

static real NAME(push)(const NAME(ImportContext) * walk) {
    return walk->damping * walk->v + walk->omega2 * walk->x;
}

static real NAME(pressure)(const NAME(ImportContext) * walk) {
    switch (walk->phase) {
    case NAME(CONTACT):
        return walk->contact_damping[walk->side] * walk->w +
               walk->contact_omega2[walk->side] * walk->r;
    case NAME(REST):
        return NAME(push)(walk);
    default:
        return 0;
    }
}

static void NAME(series)(const NAME(ImportContext) * walk, real h, real value, real slope, real rho,
                         NAME(Series) * series) {
    const bool is_sine = walk->scene->base == REFERENCE_SINE;
    const real h2 = h * h, turn2 = walk->base_omega * walk->base_omega * h2;
    const bool is_pressed = walk->phase == NAME(CONTACT) || walk->phase == NAME(INSIDE);
    const real k = is_pressed ? walk->contact_omega2[walk->side] : 0;
    const real c = is_pressed ? walk->contact_damping[walk->side] : 0;
    int degree = 4;
    real tail = 1;
    for (int i = 1; i < TERMS - 4; i++) {
        tail *= 2 * rho / (real)i;
        degree = i + 4;
        if (tail < REAL_EPSILON / 100)
            break;
    }
    memset(series, 0, sizeof *series);
    series->h = h;
    series->degree = degree;
    real *x = series->x, *r = series->r, *g = series->g, *n = series->n;
    x[0] = walk->x, x[1] = walk->v * h, r[0] = walk->r, r[1] = walk->w * h;
    g[0] = value, g[1] = is_sine ? slope * walk->base_omega * h : slope * h;
    for (int i = 0; i < degree; i++) {
        const real v = (real)(i + 1) * x[i + 1] / h, w = (real)(i + 1) * r[i + 1] / h;
        const real s = walk->damping * v + walk->omega2 * x[i];
        n[i] = walk->phase == NAME(REST) ? s : c * w + k * r[i];
        if (i + 2 > degree)
            break;
        const real over = 1 / (real)((i + 1) * (i + 2));
        if (is_sine)
            g[i + 2] = -turn2 * over * g[i];
        const real force = walk->phase == NAME(INSIDE) ? 0 : n[i];
        x[i + 2] = h2 * over * (walk->share * force - g[i] - s);
        r[i + 2] = walk->phase == NAME(REST) ? 0 : h2 * over * (s - force);
    }
}

// Peak, impulse and loss of the open contact over the series' part [0, end].
static void NAME(collect)(NAME(ImportContext) * walk, const NAME(Series) * series, real end) {
    real slope[TERMS], further[TERMS], speed[TERMS];
    const int degree = series->degree;
    const real *n = series->n;
    NAME(derive)(n, degree, slope);
    NAME(derive)(slope, degree, further);
    real left = NAME(value)(slope, degree, 0);
    for (int part = 1; part <= PARTS; part++) {
        const real b = end * (real)part / PARTS, right = NAME(value)(slope, degree, b);
        real at = b;
        if ((left < 0 && right > 0) || (left > 0 && right < 0))
            at = NAME(root)(slope, further, degree, end * (real)(part - 1) / PARTS, b);
        const real most = real_abs(NAME(value)(n, degree, at)),
                   last = real_abs(NAME(value)(n, degree, b));
        walk->peak = most > walk->peak ? most : walk->peak;
        walk->peak = last > walk->peak ? last : walk->peak;
        left = right;
    }
    walk->impulse += NAME(integral)(n, degree, end) * series->h;
    if (walk->phase != NAME(CONTACT))
        return;
    NAME(derive)(series->r, degree, speed);
    for (int i = 0; i < NODES; i++) {
        const real w = NAME(value)(speed, degree, end * walk->nodes[i]) / series->h;
        walk->lost +=
            walk->weights[i] * end * series->h * w * w * walk->contact_damping[walk->side];
    }
}

static void NAME(advance)(NAME(ImportContext) * walk, const NAME(Series) * series, real s) {
    real slope[TERMS];
    const int degree = series->degree;
    walk->x = NAME(value)(series->x, degree, s);
    NAME(derive)(series->x, degree, slope);
    walk->v = NAME(value)(slope, degree, s) / series->h;
    if (walk->phase != NAME(REST)) {
        walk->r = NAME(value)(series->r, degree, s);
        NAME(derive)(series->r, degree, slope);
        walk->w = NAME(value)(slope, degree, s) / series->h;
    }
    walk->base_speed += NAME(integral)(series->g, degree, s) * series->h;
}

static bool NAME(list)(NAME(ImportContext) * walk, const ReferenceImpact *impact) {
    ReferenceAnswer *answer = walk->answer;
    if (answer->impact_count == answer->impact_room) {
        const size_t room = answer->impact_room * 2 + 64;
        ReferenceImpact *larger =
            room <= IMPACTS_MAX ? realloc(answer->impacts, room * sizeof *larger) : NULL;
        if (larger == NULL)
            return false;
        answer->impacts = larger;
        answer->impact_room = room;
    }
    answer->impacts[answer->impact_count++] = *impact;
    return true;
}

static void NAME(open)(NAME(ImportContext) * walk, NAME(ExactPhase) phase) {
    walk->phase = phase;
    walk->open = (ReferenceImpact){
        phase == NAME(REST), walk->side, (double)walk->t, NAN, NAN, NAN, NAN, NAN, NAN};
    // A mass that is pressed again while it leaves the buffer approaches nothing.
    const real inward = walk->side == 1 ? walk->w : -walk->w;
    if (phase == NAME(CONTACT))
        walk->open.approach = inward > 0 ? (double)inward : 0;
    const real n = NAME(pressure)(walk);
    walk->peak = real_abs(n);
    walk->impulse = walk->lost = 0;
}

static bool NAME(close)(NAME(ImportContext) * walk, bool is_over) {
    if (is_over)
        walk->open.end = (double)walk->t;
    if (is_over && walk->phase == NAME(CONTACT))
        walk->open.separation = (double)real_abs(walk->w);
    walk->open.peak = (double)(walk->peak * walk->effective);
    walk->open.impulse = (double)real_abs(walk->impulse * walk->effective);
    walk->open.lost = (double)(walk->lost * walk->effective);
    walk->phase = NAME(FLIGHT);
    return NAME(list)(walk, &walk->open);
}

static bool NAME(touch)(NAME(ImportContext) * walk, int side) {
    const real sign = side == 1 ? 1 : -1, clearance = walk->scene->clearance;
    walk->side = side;
    walk->r = 0;
    walk->origin = (real)walk->scene->offset + sign * clearance / 2;
    walk->room[side] = 0;
    walk->room[1 - side] = clearance;
    if (!walk->scene->is_impulse) {
        NAME(open)(walk, NAME(CONTACT));
        return true;
    }
    const real e = walk->restitution[side], approach = sign * walk->w;
    const real press = sign * NAME(push)(walk);
    if (approach > 0) {
        const ReferenceImpact impact = {
            false,
            side,
            (double)walk->t,
            (double)walk->t,
            (double)approach,
            (double)(e * approach),
            NAN,
            (double)(walk->effective * (1 + e) * approach),
            (double)(walk->effective * (1 - e * e) * approach * approach / 2)};
        walk->v += walk->share * (1 + e) * walk->w;
        walk->w = -e * walk->w;
        if (!NAME(list)(walk, &impact))
            return false;
    } else
        walk->w = 0;
    // What time all further bounces would take.
    if (e * approach <= 0 || (press > 0 && e < 1 && 2 * e * approach < CLOSING * press * (1 - e))) {
        walk->v += walk->share * walk->w;
        walk->w = 0;
        const bool is_late = press <= 0;
        NAME(open)(walk, NAME(REST));
        walk->leaving = is_late ? side : -1;
    }
    return true;
}

static void NAME(sample)(NAME(ImportContext) * walk) {
    const size_t i = walk->sample;
    double *const *to = walk->answer->channels;
    const real n = NAME(pressure)(walk), rate = walk->scene->sample_rate;
    const real acceleration = walk->share * n - NAME(push)(walk);
    const real mean = i == 0 ? acceleration : (walk->v - walk->last_v + walk->base_speed) * rate;
    const real relative = walk->origin + walk->r;
    to[REFERENCE_DISPLACEMENT][i] = (double)walk->x;
    to[REFERENCE_VELOCITY][i] = (double)walk->v;
    to[REFERENCE_ACCELERATION][i] = (double)acceleration;
    to[REFERENCE_MEAN_ACCELERATION][i] = (double)mean;
    to[REFERENCE_DAMPER_DISPLACEMENT][i] = (double)(walk->x + relative);
    to[REFERENCE_DAMPER_VELOCITY][i] = (double)(walk->v + walk->w);
    to[REFERENCE_FORCE][i] = (double)(n * walk->effective);
    walk->last_v = walk->v;
    walk->base_speed = 0;
    walk->sample++;
}

// Goes to the series' end or to the first event before it. False where the run must end.
static bool NAME(stretch)(NAME(ImportContext) * walk, const NAME(Series) * series, bool *is_event) {
    real f[TERMS], s = 1;
    int side = walk->side;
    bool is_pressed = false;
    const int degree = series->degree;
    *is_event = false;
    if (walk->phase == NAME(FLIGHT)) {
        for (int stop = 0; stop < 2; stop++) {
            real here;
            for (int i = 0; i <= degree; i++)
                f[i] = stop == 1 ? -series->r[i] : series->r[i];
            f[0] += walk->room[stop];
            if (NAME(crossing)(f, degree, walk->leaving == stop, &here) &&
                (!*is_event || here < s)) {
                *is_event = true;
                s = here;
                side = stop;
            }
        }
    } else if (walk->phase == NAME(INSIDE)) {
        // Out of the buffer, or pressed again before that.
        for (int way = 0; way < 2; way++) {
            real here;
            for (int i = 0; i <= degree; i++)
                f[i] = (walk->side == 1 ? 1 : -1) * (way == 0 ? series->r[i] : -series->n[i]);
            if (NAME(crossing)(f, degree, way == 1 && walk->leaving == walk->side, &here) &&
                (!*is_event || here < s)) {
                *is_event = true;
                s = here;
                is_pressed = way == 1;
            }
        }
    } else {
        const bool is_contact = walk->phase == NAME(CONTACT) && !walk->scene->is_zero_force;
        const real *of = is_contact ? series->r : series->n;
        for (int i = 0; i <= degree; i++)
            f[i] = walk->side == 1 ? of[i] : -of[i];
        *is_event = NAME(crossing)(f, degree, walk->leaving == walk->side, &s);
        NAME(collect)(walk, series, *is_event ? s : 1);
    }
    walk->leaving = -1;
    NAME(advance)(walk, series, *is_event ? s : 1);
    if (!*is_event)
        return true;
    walk->t += s * series->h;
    walk->idle = s * series->h > (real)1e-30 ? 0 : walk->idle + 1;
    if (walk->idle > 20000)
        return false;
    if (walk->phase == NAME(FLIGHT))
        return NAME(touch)(walk, side);
    if (is_pressed) {
        NAME(open)(walk, NAME(CONTACT));
        return true;
    }
    if (walk->phase == NAME(INSIDE)) {
        walk->r = 0;
        walk->phase = NAME(FLIGHT);
        return true;
    }
    const bool is_inside = walk->phase == NAME(CONTACT) && walk->scene->is_zero_force;
    const bool is_release = walk->phase == NAME(REST);
    if (is_release || is_inside)
        walk->leaving = walk->side;
    else
        walk->r = 0;
    // What is left in the spring is released inside the buffer.
    if (is_inside)
        walk->lost += walk->contact_omega2[walk->side] * walk->r * walk->r / 2;
    if (!NAME(close)(walk, true))
        return false;
    if (is_inside)
        walk->phase = NAME(INSIDE);
    return true;
}

// A free mass that starts at a stop and moves, or is about to move, into it.
static bool NAME(begin)(NAME(ImportContext) * walk, real value, real slope) {
    NAME(Series) series;
    const real h = (real)0.01 / (walk->flight_rate + (real)walk->scene->sample_rate);
    for (int turn = 0; turn < 2000 && walk->phase == NAME(FLIGHT); turn++) {
        NAME(series)(walk, h, value, slope, h * walk->flight_rate, &series);
        int first = 1;
        while (first < series.degree && series.r[first] == 0)
            first++;
        const int stop = series.r[first] > 0 ? 1 : 0;
        if (series.r[first] == 0 || walk->room[stop] != (stop == 1 ? walk->r : -walk->r))
            return true;
        if (!NAME(touch)(walk, stop))
            return false;
    }
    return true;
}

static void NAME(run)(const ReferenceScene *scene, double stride, double most,
                      ReferenceAnswer *answer) {
    NAME(ImportContext) walk;
    NAME(Series) series;
    memset(answer, 0, sizeof *answer);
    answer->count = (size_t)(scene->duration * scene->sample_rate * (1 + 1e-12)) + 1;
    for (size_t i = 0; i < REFERENCE_CHANNELS; i++)
        if ((answer->channels[i] = array(answer->count)) == NULL)
            return;
    NAME(start)(&walk, scene, answer);
    real value, slope;
    const real rate = scene->sample_rate;
    const real last = scene->duration;
    while (walk.sample < answer->count || walk.t < last) {
        const real kink = NAME(base)(&walk, &value, &slope);
        real target = walk.sample < answer->count ? (real)walk.sample / rate : last;
        if (walk.t >= target) {
            // What happens at the start comes before the first sample, which is right-continuous.
            if (walk.sample == 0 && !NAME(begin)(&walk, value, slope))
                return;
            NAME(sample)(&walk);
            continue;
        }
        target = kink < target ? kink : target;
        const real fastest = walk.phase == NAME(CONTACT) ? walk.rate[walk.side] : walk.flight_rate;
        real h = target - walk.t;
        const bool is_cut = h * fastest > (real)stride;
        if (is_cut)
            h = (real)stride / fastest;
        NAME(series)(&walk, h, value, slope, h * fastest, &series);
        bool is_event;
        if (!NAME(stretch)(&walk, &series, &is_event) || ++answer->steps > most)
            return;
        if (!is_event)
            walk.t = is_cut ? walk.t + h : target;
    }
    if ((walk.phase == NAME(CONTACT) || walk.phase == NAME(REST)) && !NAME(close)(&walk, false))
        return;
    answer->is_whole = true;
}
