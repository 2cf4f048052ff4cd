// Storeys x and free masses z, both relative to the base:
//   x'' = M^-1 (-C x' - K x + sum of e_j N_d) - r a_g,   m z'' = -m a_g - N_d
// as dense power series.
#include "tests/truth/frame_reference_walk.h"

#include <string.h>

Quad walk_ground(const ImportContext *walk, Quad *rate, Quad *until) {
    const Base *base = walk->base;
    *rate = 0;
    *until = INFINITY;
    if (base->form == BASE_SINE) {
        *rate = base->amplitude * cosq(base->omega * walk->t);
        return base->amplitude * sinq(base->omega * walk->t);
    }
    if (base->form != BASE_SAMPLED)
        return 0;
    size_t i = (size_t)(walk->t / (Quad)base->interval);
    while (walk->t >= (Quad)(i + 1) * base->interval)
        i++;
    if (i + 1 >= base->count)
        return 0;
    *until = (Quad)(i + 1) * base->interval;
    *rate = ((Quad)base->values[i + 1] - base->values[i]) / base->interval;
    return base->values[i] + *rate * (walk->t - (Quad)i * base->interval);
}

// Constraint forces of those that rest, from what they would do without: elimination.
void walk_constrain(const ImportContext *walk, const Quad *without, Quad *force) {
    size_t who[D], count = 0;
    for (size_t d = 0; d < walk->m; d++)
        if (walk->mass[d].phase == RESTING)
            who[count++] = d;
    Quad A[D][D + 1];
    for (size_t i = 0; i < count; i++) {
        for (size_t j = 0; j < count; j++)
            A[i][j] = walk->yield[who[i]][who[j]];
        A[i][count] = without[who[i]];
    }
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < count; i++) {
            if (i == k)
                continue;
            const Quad factor = A[i][k] / A[k][k];
            for (size_t j = k; j <= count; j++)
                A[i][j] -= factor * A[k][j];
        }
    for (size_t i = 0; i < count; i++)
        force[who[i]] = A[i][count] / A[i][i];
}

double walk_rate(const ImportContext *walk) {
    double rate = walk->flight_rate;
    for (size_t d = 0; d < walk->m; d++)
        if (walk->mass[d].phase == TOUCHING)
            rate += fmax(sqrt((double)(walk->mass[d].k * walk->yield[d][d])),
                         (double)(walk->mass[d].c * walk->yield[d][d]));
    return rate;
}

void walk_series(ImportContext *walk, Quad h, Quad a, Quad rate) {
    const size_t n = walk->n, m = walk->m;
    const double rho = (double)h * walk_rate(walk);
    walk->h = h;
    walk->degree = 6;
    double tail = 1;
    for (int i = 1; i < TERMS - 6 && tail > 1e-38; i++, walk->degree = i + 5)
        tail *= 2 * rho / i;
    memset(walk->as, 0, sizeof walk->as);
    walk->as[0] = a;
    walk->as[1] = (walk->base->form == BASE_SINE ? walk->base->omega * rate : rate) * h;
    const Quad turn2 = walk->base->omega * walk->base->omega * h * h;
    for (int i = 0; i + 2 <= walk->degree && walk->base->form == BASE_SINE; i++)
        walk->as[i + 2] = -turn2 * walk->as[i] / ((i + 1) * (i + 2));
    for (size_t j = 0; j < n; j++) {
        walk->xs[j][0] = walk->x[j];
        walk->xs[j][1] = walk->v[j] * h;
    }
    for (size_t d = 0; d < m; d++) {
        walk->us[d][0] = walk->mass[d].u;
        walk->us[d][1] = walk->mass[d].w * h;
    }
    for (int i = 0; i < walk->degree; i++) {
        Quad pull[N], without[D], force[D] = {0};
        for (size_t j = 0; j < n; j++) {
            pull[j] = 0;
            for (size_t k = 0; k < n; k++)
                pull[j] -= walk->stiff[j][k] * walk->xs[k][i] +
                           walk->viscous[j][k] * (i + 1) * walk->xs[k][i + 1] / h;
        }
        for (size_t d = 0; d < m; d++) {
            const Mass *mass = &walk->mass[d];
            const size_t storey = walk->plan->dampers[d].storey;
            without[d] = ((Quad)walk->plan->influence[storey] - 1) * walk->as[i] - pull[storey];
            if (mass->phase == TOUCHING)
                force[d] = mass->k * walk->us[d][i] + mass->c * (i + 1) * walk->us[d][i + 1] / h;
        }
        walk_constrain(walk, without, force);
        for (size_t d = 0; d < m; d++)
            walk->ns[d][i] = force[d];
        if (i + 2 > walk->degree)
            break;
        const Quad scale = h * h / ((i + 1) * (i + 2));
        for (size_t j = 0; j < n; j++) {
            Quad sum = pull[j] - walk->plan->influence[j] * walk->as[i];
            for (size_t d = 0; d < m; d++)
                sum += walk->inverse[j][walk->plan->dampers[d].storey] * force[d];
            walk->xs[j][i + 2] = sum * scale;
        }
        for (size_t d = 0; d < m; d++) {
            Quad sum = without[d];
            for (size_t e = 0; e < m; e++)
                sum -= walk->yield[d][e] * force[e];
            walk->us[d][i + 2] = walk->mass[d].phase == RESTING ? 0 : sum * scale;
        }
    }
}

Quad walk_acceleration(ImportContext *walk, size_t d) {
    Quad rate, until;
    const Quad a = walk_ground(walk, &rate, &until);
    walk_series(walk, (Quad)1e-3 / walk_rate(walk), a, rate);
    return walk->us[d][2] * 2 / (walk->h * walk->h);
}

static void invert(const double *matrix, size_t n, Quad inverse[N][N]) {
    Quad A[N][N];
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            A[i][j] = matrix[i * n + j];
            inverse[i][j] = i == j;
        }
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < n; i++) {
            const Quad factor = i == k ? 1 - 1 / A[k][k] : A[i][k] / A[k][k];
            for (size_t j = 0; j < n; j++) {
                inverse[i][j] -= factor * inverse[k][j];
                if (i != k)
                    A[i][j] -= factor * A[k][j];
            }
            if (i == k)
                for (size_t j = 0; j < n; j++)
                    A[i][j] -= factor * A[k][j];
        }
}

void walk_start(ImportContext *walk) {
    const Plan *plan = walk->plan;
    const size_t n = walk->n;
    invert(plan->mass, n, walk->inverse);
    double stiff = 0, viscous = 0;
    for (size_t i = 0; i < n; i++) {
        double rows[2] = {0, 0};
        for (size_t j = 0; j < n; j++) {
            for (size_t k = 0; k < n; k++) {
                walk->stiff[i][j] += walk->inverse[i][k] * plan->stiffness[k * n + j];
                walk->viscous[i][j] += walk->inverse[i][k] * plan->damping[k * n + j];
            }
            rows[0] += fabs((double)walk->stiff[i][j]);
            rows[1] += fabs((double)walk->viscous[i][j]);
        }
        stiff = fmax(stiff, rows[0]);
        viscous = fmax(viscous, rows[1]);
        walk->x[i] = plan->displacement[i];
        walk->v[i] = plan->velocity[i];
    }
    walk->flight_rate = fmax(fmax(fmax(sqrt(stiff), viscous), walk->base->omega), 1e-3);
    for (size_t d = 0; d < walk->m; d++) {
        const PlanDamper *planned = &plan->dampers[d];
        for (size_t e = 0; e < walk->m; e++)
            walk->yield[d][e] = walk->inverse[planned->storey][plan->dampers[e].storey] +
                                (d == e ? 1 / (Quad)planned->mass : 0);
        walk->mass[d].at = -1;
        walk->mass[d].u = planned->position;
        walk->mass[d].w = planned->velocity;
    }
}
