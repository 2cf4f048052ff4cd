// The run of lanes.h for one width of vector: WIDTH doubles, functions called NAME(...), compiled for
// TARGET. Not a header of its own: lanes.c includes it once for each width, and nobody else does.
#define Vector NAME(Vector)
#define Loose NAME(Loose)
#define LOAD(values) (*(Vector *)(uintptr_t)(values))
#define LOOSE(values) (*(Loose *)(uintptr_t)(values))

typedef double Vector __attribute__((vector_size(8 * WIDTH), may_alias));
typedef double Loose __attribute__((vector_size(8 * WIDTH), aligned(8), may_alias)); // anywhere

// `count` blocks one after the other, from state 0.
INLINE void NAME(fly_group)(const Lanes *t, const Stretch *s, Group *group, size_t sample, size_t count,
                      const double *a, bool is_still) {
    const double h = t->interval, W = t->omega2, D = -t->damping, middle = s->middle;
    double *const cx = s->columns[CHANNEL_DISPLACEMENT], *const cv = s->columns[CHANNEL_VELOCITY];
    double *const ca = s->columns[CHANNEL_ACCELERATION];
    double *const cd = s->columns[CHANNEL_DAMPER_DISPLACEMENT];
    double *const cz = s->columns[CHANNEL_DAMPER_VELOCITY];
    double x = group->state[0].x, v = group->state[0].v;
    double r = group->state[0].r, z = group->state[0].z;
    for (size_t b = 0; b < count; b++) {
        const size_t at = sample + LANES * b + 1;
        double dx8 = t->x_x[7] * x + t->x_v[7] * v, dv8 = t->v_x[7] * x + t->v_v[7] * v;
        double dz8 = t->time[7] * z, z8 = z;
        for (size_t l = 0; l < LANES; l += WIDTH) {
            Vector dx = LOAD(t->x_x + l) * x + LOAD(t->x_v + l) * v;
            Vector dv = LOAD(t->v_x + l) * x + LOAD(t->v_v + l) * v;
            Vector dz = LOAD(t->time + l) * z;
            if (!is_still) {
                Vector fx = LOAD(t->x_a[0] + l) * a[0], fv = LOAD(t->v_a[0] + l) * a[0];
                Vector fz = LOAD(t->z_a[0] + l) * a[0];
                for (int i = 1; i <= LANES; i++) {
                    fx += LOAD(t->x_a[i] + l) * a[i];
                    fv += LOAD(t->v_a[i] + l) * a[i];
                    fz += LOAD(t->z_a[i] + l) * a[i];
                }
                if (l + WIDTH == LANES) {
                    dx8 += fx[WIDTH - 1];
                    dv8 += fv[WIDTH - 1];
                    dz8 += fz[WIDTH - 1];
                }
                dx += fx;
                dv += fv;
                dz += fz;
            }
            const Vector X = x + dx, V = v + dv, R = r + (dz - dx);
            LOAD(group->x + LANES * b + l) = X;
            LOAD(group->v + LANES * b + l) = V;
            LOAD(group->r + LANES * b + l) = R;
            if (cx != NULL)
                LOOSE(cx + at + l) = X;
            if (cv != NULL)
                LOOSE(cv + at + l) = V;
            if (ca != NULL)
                LOOSE(ca + at + l) = D * V - W * X;
            if (cd != NULL)
                LOOSE(cd + at + l) = X + (middle + R);
            if (cz != NULL) {
                Vector speed = {0};
                for (int i = 0; i <= LANES && !is_still; i++)
                    speed += LOAD(t->speed_a[i] + l) * a[i];
                LOOSE(cz + at + l) = z + speed;
            }
        }
        if (!is_still)
            z8 = z - h * ((((a[0] + a[8]) * 0.5 + (a[1] + a[2])) + ((a[3] + a[4]) + (a[5] + a[6]))) +
                          a[7]);
        if (!is_still)
            a += LANES;
        x += dx8;
        v += dv8;
        r += dz8 - dx8;
        z = z8;
        group->state[b + 1].x = x;
        group->state[b + 1].v = v;
        group->state[b + 1].r = r;
        group->state[b + 1].z = z;
    }
}

// `count` whole blocks and of the next one the first `more` samples.
INLINE void NAME(add_blocks)(Stretch *s, const Group *group, size_t count, size_t more,
                             const double *a, bool is_still) {
    static const double ones[2 * LANES] = {1, 1, 1, 1, 1, 1, 1, 1};
    for (size_t l = 0; l < LANES; l += WIDTH) {
        Vector sums[LANE_SUMS];
        for (int i = 0; i < (is_still ? 3 : LANE_SUMS); i++)
            sums[i] = LOAD(s->sums[i] + l);
        for (size_t b = 0; b < count + (more > 0); b++) {
            Vector X = LOAD(group->x + LANES * b + l), V = LOAD(group->v + LANES * b + l);
            Vector A = {0}, B = {0};
            if (!is_still) {
                A = LOOSE(a + LANES * b + l);
                B = LOOSE(a + LANES * b + l + 1);
            }
            if (b == count) {
                const Vector keep = LOOSE(ones + LANES - more + l);
                X *= keep;
                V *= keep;
                A *= keep;
                B *= keep;
            }
            sums[XX] += X * X;
            sums[XV] += X * V;
            sums[VV] += V * V;
            if (is_still)
                continue;
            sums[XB] += X * B;
            sums[XA] += X * A;
            sums[VB] += V * B;
            sums[VA] += V * A;
            sums[BB] += B * B;
            sums[AB] += A * B;
            sums[AA] += A * A;
        }
        for (int i = 0; i < (is_still ? 3 : LANE_SUMS); i++)
            LOAD(s->sums[i] + l) = sums[i];
    }
}

// As far as surely no stop is reached, by whole blocks but for the last.
INLINE size_t NAME(fly_blocks)(const Lanes *t, Stretch *s, size_t sample, size_t count, const double *a,
                         bool is_still) {
    const double h = t->interval, sagging = LANES * LANES * h * h / 8;
    Group group;
    size_t done = 0;
    for (bool is_clear = true; is_clear && done + LANES <= count;) {
        const size_t left = (count - done) / LANES, blocks = left < GROUP ? left : GROUP;
        group.state[0].x = s->x;
        group.state[0].v = s->v;
        group.state[0].r = s->r;
        group.state[0].z = s->z;
        NAME(fly_group)(t, s, &group, sample + done, blocks, a, is_still);
        const double push = push_bound(t, s->x, s->v, GROUP * LANES, s->base_most);
        size_t clear = 0, more = 0;
        while (clear <= blocks && is_inside(s, group.state[clear].r, sagging * push))
            clear++;
        is_clear = clear > blocks;
        clear -= clear > 0;
        double z = group.state[clear].z;
        const double *x = group.x + LANES * clear, *v = group.v + LANES * clear;
        const double *r = group.r + LANES * clear, *b = is_still ? NULL : a + LANES * clear;
        if (!is_clear) { // somewhere in this block: its intervals one by one
            const double sag = h * h / 8 * push;
            if (is_inside(s, group.state[clear].r, sag))
                while (more < LANES && is_inside(s, r[more], sag))
                    more++;
            for (size_t j = 0; j < more && !is_still; j++)
                z -= h * ((b[j] + b[j + 1]) / 2);
            is_clear = more == LANES;
        }
        const size_t flown = clear * LANES + more;
        if (flown == 0)
            break;
        if (may_hold_peak(t, s, &group, clear + (more > 0), sagging, push + s->base_most))
            look_for_peaks(t, s, flown, group.x, group.v, group.r);
        if (s->columns[CHANNEL_MEAN_ACCELERATION] != NULL)
            store_means(t, s->columns[CHANNEL_MEAN_ACCELERATION] + sample + done + 1, flown, s->v,
                        group.v, a);
        NAME(add_blocks)(s, &group, clear, more, a, is_still);
        if (more > 0) {
            s->x = x[more - 1];
            s->v = v[more - 1];
            s->r = r[more - 1];
            s->z = z;
        } else {
            s->x = group.state[clear].x;
            s->v = group.state[clear].v;
            s->r = group.state[clear].r;
            s->z = group.state[clear].z;
        }
        done += flown;
        if (!is_still)
            a += flown;
    }
    return done;
}

TARGET static size_t NAME(run)(const Lanes *lanes, Stretch *stretch, size_t sample, size_t count,
                               const double *base) {
    const size_t done = base == NULL
                            ? NAME(fly_blocks)(lanes, stretch, sample, count, NULL, true)
                            : NAME(fly_blocks)(lanes, stretch, sample, count, base, false);
    const size_t left = count - done;
    if (left == 0 || left >= LANES)
        return done;
    return done + careful(lanes, stretch, sample + done, left, base == NULL ? NULL : base + done);
}

#undef Vector
#undef Loose
#undef LOAD
#undef LOOSE
#undef WIDTH
#undef NAME
#undef TARGET
