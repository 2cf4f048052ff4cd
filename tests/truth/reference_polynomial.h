// Polynomials of one type `real`; no guard, for reference.c includes it once for each. A function's
// first root is sought in PARTS pieces, every piece is cut where f''', f'' and f' change sign, and
// f, monotone then, is bisected with Newton's help.

static real NAME(value)(const real *f, int degree, real s) {
    real sum = f[degree];
    for (int i = degree; i-- > 0;)
        sum = sum * s + f[i];
    return sum;
}

static void NAME(derive)(const real *f, int degree, real *out) {
    for (int i = 0; i < degree; i++)
        out[i] = (real)(i + 1) * f[i + 1];
    out[degree] = 0;
}

static real NAME(integral)(const real *f, int degree, real s) {
    real sum = 0;
    for (int i = degree + 1; i-- > 0;)
        sum = sum * s + f[i] / (real)(i + 1);
    return sum * s;
}

// Of f, monotone on [a, b] and of different sign at its ends; f(a) may be 0 but counts as the other
// sign than f(b).
static real NAME(root)(const real *f, const real *df, int degree, real a, real b) {
    const bool is_rising = NAME(value)(f, degree, b) > 0;
    real s = b, step = b - a, before = step;
    for (int i = 0; i < 400; i++) {
        const real here = NAME(value)(f, degree, s), slope = NAME(value)(df, degree, s);
        if (here == 0)
            return s;
        if ((here > 0) == is_rising)
            b = s;
        else
            a = s;
        // Newton while it stays inside and at least halves its steps.
        real next = slope != 0 ? s - here / slope : a;
        if (!(next > a && next < b) || real_abs(2 * here) > real_abs(before * slope))
            next = (a + b) / 2;
        before = step;
        step = next - s;
        if (real_abs(step) <= REAL_EPSILON * real_abs(next))
            return next;
        s = next;
    }
    return s;
}

// The first s in [0, 1] behind which f is negative. f(0) counts as positive; `late` leaves out what
// is at the start.
static bool NAME(crossing)(const real *f, int degree, bool late, real *s) {
    real d[4][TERMS], most = 0;
    for (int i = 1; i <= degree; i++)
        most += real_abs(f[i]);
    if (f[0] > most)
        return false;
    if (!late && f[0] <= 0) {
        int i = 1;
        while (i < degree && f[i] == 0)
            i++;
        if (f[i] < 0) {
            *s = 0;
            return true;
        }
        if (f[i] == 0)
            return false;
    }
    memcpy(d[0], f, (size_t)(degree + 1) * sizeof *f);
    real most_slope = 0;
    for (int i = 0; i < 3; i++)
        NAME(derive)(d[i], degree, d[i + 1]);
    for (int i = 0; i < degree; i++)
        most_slope += real_abs(d[1][i]);
    for (int part = 0; part < PARTS; part++) {
        real cuts[16] = {(real)part / PARTS, (real)(part + 1) / PARTS};
        int count = 2;
        if (NAME(value)(f, degree, cuts[0]) > most_slope / PARTS)
            continue;
        for (int level = 3; level >= 1; level--) {
            real finer[16];
            int many = 0;
            for (int i = 0; i + 1 < count; i++) {
                finer[many++] = cuts[i];
                const real left = NAME(value)(d[level], degree, cuts[i]);
                const real right = NAME(value)(d[level], degree, cuts[i + 1]);
                if ((left < 0 && right > 0) || (left > 0 && right < 0)) {
                    real further[TERMS];
                    NAME(derive)(d[level], degree, further);
                    finer[many++] = NAME(root)(d[level], further, degree, cuts[i], cuts[i + 1]);
                }
            }
            finer[many++] = cuts[count - 1];
            memcpy(cuts, finer, sizeof cuts);
            count = many;
        }
        for (int i = 0; i + 1 < count; i++) {
            if (late && cuts[i + 1] < (real)1e-6)
                continue;
            if (NAME(value)(f, degree, cuts[i + 1]) < 0) {
                *s = NAME(root)(d[0], d[1], degree, cuts[i], cuts[i + 1]);
                return true;
            }
        }
    }
    return false;
}
