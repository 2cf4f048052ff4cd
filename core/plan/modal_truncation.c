// The error of a run that keeps only the lowest modes, predicted from one run of all modes without
// dampers. A mode obeys, with a_g linear or a sine within a step,
//
//   q'' + D q' + w^2 q = -share a_g,   a_g'' = -W^2 a_g,
//
// so that the increment of (q, q') over a step is a block of exp(A h) - I times (q, q', a_g, a_g').
// At sample instants the modes left out are summed at every storey, for every number of modes kept.
// Two effects are estimated from that run: coupled damping (truncation_couple) and impacts
// (truncation_impacts). SAFETY covers what sampling and dampers change in the whole motion; its
// values and GROWTH are calibrated with tests/truth/test_modes.c.
#include "core/plan/modal_truncation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/matrix_exponential.h"

static const double PI = 3.14159265358979323846;
static const double SAFETY = 1.25, SAFETY_IMPACTS = 2;
static const double STEPS_MAX = 2e7; // steps of modes: about 40 ms
static const double SUMS_MAX = 5e5;  // samples times modes times storeys: about 1 ms

// All modes in motion, and the sums over its samples.
typedef struct ModalRun {
    const Plan *plan;
    const Base *base;
    size_t n, m;     // modes, storeys
    double *shapes;  // n x m
    double *q, *p;   // the state
    double interval; // from sample to sample [s]
    // Eight rows of n numbers: what (q, q', a_g, a_g') add to q and to q' in a step.
    double *recurrence;
    double step, omega; // its length [s] and W; step 0: not made
    // The sample in the making: q' at its start; its length; the integral of a_g.
    double *before, length, base_speed;
    double *accelerated; // mean q'' over it
    // Only some samples are summed: all for `dense` more, then one of `every`.
    size_t count, dense, every;
    double weight;           // time since the last one that was [s]
    double *x, *left, *pull; // by storey: the motion; displacement and acceleration left out
    // By first mode left out and storey: largest displacement, sums of its square, of its product
    // with the whole motion, and of the acceleration's square. Row 0 is the whole motion.
    double *peak, *square, *cross, *pulls;
    double *mode_peak, *mode_speed; // by mode: largest q, sum of q'^2
    double *storey_speed;           // by damper: largest speed of its storey [m/s]
    double acceleration;            // sum of squares of the whole absolute acceleration
    double time;                    // sum of weights [s]
} ModalRun;

static void modal_run_recurrence(ModalRun *run, double step, double omega) {
    enum { Q, P, A, B, SIZE };
    const Modes *modes = &run->plan->modes;
    const size_t n = run->n;
    if (run->step == step && run->omega == omega)
        return;
    run->step = step;
    run->omega = omega;
    for (size_t k = 0; k < n; k++) {
        long double system[SIZE * SIZE] = {0}, gain[SIZE * SIZE];
        system[Q * SIZE + P] = system[A * SIZE + B] = 1;
        system[P * SIZE + Q] = -(long double)modes->omega[k] * modes->omega[k];
        system[P * SIZE + P] = -(long double)modes->damping[k * (n + 1)];
        system[P * SIZE + A] = -(long double)modes->participation[k];
        system[B * SIZE + A] = -(long double)omega * omega;
        matrix_exponential_increment(system, SIZE, step, gain);
        for (size_t i = 0; i < 2 * SIZE; i++)
            run->recurrence[i * n + k] = (double)gain[i];
    }
}

// Sums the motion at a sample instant for every number of modes kept; `base` is the mean of a_g
// over the sample interval.
static void modal_run_sum(ModalRun *run, double base) {
    const Plan *plan = run->plan;
    const size_t n = run->n, m = run->m;
    const double weight = run->weight;
    double *restrict x = run->x, *restrict left = run->left, *restrict pull = run->pull;
    memset(x, 0, 3 * m * sizeof *x); // left and pull follow
    for (size_t k = 0; k < n; k++) {
        run->mode_speed[k] += weight * run->p[k] * run->p[k];
        for (size_t j = 0; j < m; j++)
            x[j] += run->shapes[k * m + j] * run->q[k];
    }
    for (size_t k = n; k-- > 0;) {
        const double q = run->q[k], accelerated = run->accelerated[k];
        const double *restrict shape = &run->shapes[k * m];
        double *restrict peak = &run->peak[k * m], *restrict square = &run->square[k * m];
        double *restrict cross = &run->cross[k * m], *restrict pulls = &run->pulls[k * m];
        for (size_t j = 0; j < m; j++) {
            left[j] += shape[j] * q;
            pull[j] += shape[j] * accelerated;
            const double size = fabs(left[j]);
            peak[j] = size > peak[j] ? size : peak[j];
            square[j] += weight * left[j] * left[j];
            cross[j] += weight * left[j] * x[j];
            pulls[j] += weight * pull[j] * pull[j];
        }
    }
    for (size_t j = 0; j < m; j++) {
        const double absolute = pull[j] + plan->influence[j] * base;
        run->acceleration += weight * absolute * absolute;
    }
    for (size_t d = 0; d < plan->damper_count; d++) {
        double speed = 0;
        for (size_t k = 0; k < n; k++)
            speed += run->shapes[k * m + plan->dampers[d].storey] * run->p[k];
        run->storey_speed[d] = fmax(run->storey_speed[d], fabs(speed));
    }
    run->time += weight;
    run->weight = 0;
}

// One step from a_g = a, a_g' = b; `mean` is the mean of a_g over it. Completes a sample where one
// is due.
static void modal_run_step(ModalRun *run, double a, double b, double mean) {
    const size_t n = run->n;
    const double *g = run->recurrence;
    double *restrict q = run->q, *restrict p = run->p, *restrict peak = run->mode_peak;
    if (run->length == 0)
        memcpy(run->before, p, n * sizeof *p);
    for (size_t k = 0; k < n; k++) {
        const double dq = g[k] * q[k] + g[n + k] * p[k] + (g[2 * n + k] * a + g[3 * n + k] * b);
        const double dp =
            g[4 * n + k] * q[k] + g[5 * n + k] * p[k] + (g[6 * n + k] * a + g[7 * n + k] * b);
        q[k] += dq;
        p[k] += dp;
        const double size = fabs(q[k]);
        peak[k] = size > peak[k] ? size : peak[k];
    }
    run->length += run->step;
    run->base_speed += mean * run->step;
    if (run->length + run->step / 2 < run->interval)
        return;
    run->weight += run->length;
    if (run->dense > 0 || ++run->count % run->every == 0) {
        run->dense -= run->dense > 0;
        for (size_t k = 0; k < n; k++)
            run->accelerated[k] = (p[k] - run->before[k]) / run->length;
        modal_run_sum(run, run->base_speed / run->length);
    }
    run->length = run->base_speed = 0;
}

// a_g and, as *slope, a_g' at t seconds into a piece of the base.
static double modal_run_base_at(const BasePiece *piece, double omega, double t, double *slope) {
    if (omega == 0) {
        *slope = piece->slope;
        return piece->value + piece->slope * t;
    }
    const double c = cos(omega * t), s = sin(omega * t);
    *slope = omega * (piece->slope * c - piece->value * s);
    return piece->value * c + piece->slope * s;
}

static void modal_run_piece(ModalRun *run, const BasePiece *piece, double omega, double length) {
    const double count = fmax(ceil(length / run->interval * (1 - 1e-9)), 1);
    if (!(length > 0))
        return;
    modal_run_recurrence(run, length / count, omega);
    for (double i = 0; i < count; i++) {
        double slope, unused;
        const double a = modal_run_base_at(piece, omega, i * run->step, &slope);
        modal_run_step(run, a, slope,
                       (a + modal_run_base_at(piece, omega, (i + 1) * run->step, &unused)) / 2);
    }
}

// A sampled base; where it has too many samples, the part around its largest acceleration.
static void modal_run_samples(ModalRun *run, double duration) {
    const Base *base = run->base;
    const size_t most = (size_t)(STEPS_MAX / (double)run->n);
    size_t end = base->count - 1, first = 0;
    if ((double)end * base->interval > duration)
        end = (size_t)(duration / base->interval);
    if (end > most) {
        size_t largest = 0;
        for (size_t i = 0; i < end; i++)
            if (fabs(base->values[i]) > fabs(base->values[largest]))
                largest = i;
        first = largest > most / 2 ? largest - most / 2 : 0;
        first = first + most < end ? first : end - most;
        end = first + most;
    }
    for (size_t i = first; i < end; i++) {
        const BasePiece line = {0, base->values[i],
                                (base->values[i + 1] - base->values[i]) / base->interval};
        modal_run_piece(run, &line, 0, base->interval);
    }
    if (end + 1 == base->count)
        modal_run_piece(run, &(BasePiece){0}, 0, duration - (double)end * base->interval);
}

static void modal_run_all(ModalRun *run) {
    const Base *base = run->base;
    const Modes *modes = &run->plan->modes;
    const double duration = run->plan->duration, n = (double)run->n;
    const size_t dense = (size_t)(SUMS_MAX / n / (double)run->m / 4) + 25;
    const BasePiece still = {0}, sine = {.slope = base->amplitude};
    const bool is_pieces = base->form == BASE_PIECES;
    run->interval = 1 / run->plan->sample_rate;
    if (base->form != BASE_SAMPLED)
        run->interval = fmax(run->interval, duration * n / STEPS_MAX);
    run->every = (size_t)ceil(duration / run->interval * n * (double)run->m / SUMS_MAX);
    run->dense = dense;
    // The first sample has no interval: its acceleration is q'' itself.
    double unused;
    const double a = base->form == BASE_SAMPLED ? base->values[0]
                     : is_pieces && base->pieces[0].time == 0
                         ? modal_run_base_at(&base->pieces[0], base->omega, 0, &unused)
                         : 0;
    for (size_t k = 0; k < run->n; k++) {
        run->mode_peak[k] = fabs(run->q[k]);
        run->accelerated[k] = -modes->damping[k * (run->n + 1)] * run->p[k] -
                              modes->omega[k] * modes->omega[k] * run->q[k] -
                              modes->participation[k] * a;
    }
    run->weight = run->interval;
    modal_run_sum(run, a);
    if (base->form == BASE_SAMPLED)
        modal_run_samples(run, duration);
    else if (base->form == BASE_SINE)
        modal_run_piece(run, &sine, base->omega, duration);
    else
        modal_run_piece(run, &still, 0,
                        is_pieces ? fmin(base->pieces[0].time, duration) : duration);
    for (size_t i = 0; i < base->piece_count && is_pieces; i++) {
        const double from = base->pieces[i].time;
        const double to = i + 1 < base->piece_count ? base->pieces[i + 1].time : duration;
        run->dense = dense;
        modal_run_piece(run, &base->pieces[i], base->omega, fmin(to, duration) - from);
    }
}

static double truncation_square(double x) {
    return x * x;
}

// What coupled damping adds to the modes left out and does to the modes kept.
typedef struct Coupling {
    double *peak, *pull; // of each storey: squares of displacement and of rms acceleration
    double *shift;       // of each mode: relative shift of its frequency
} Coupling;

// Mode k, now left out, follows the speeds of the other modes, each about as it would follow that
// one alone. Without it a mode j kept has its frequency shifted by D_jk^2 / (2 w_k^2), and with
// time its phase. Returns the displacement by all phases [m].
static double truncation_couple(const ModalRun *run, size_t k, Coupling *coupling) {
    const Modes *modes = &run->plan->modes;
    const size_t n = run->n, m = run->m;
    const double slowest = 1 / run->plan->duration, own = fmax(modes->omega[k], slowest);
    double peak = 0, pull = 0, turned = 0;
    for (size_t j = 0; j < n; j++) {
        const double other = fmax(modes->omega[j], slowest), tie = modes->damping[k * n + j];
        const double away =
            fabs(own - other) * (own + other) + fmax(modes->damping[k * (n + 1)], slowest) * other;
        const double speed = run->mode_speed[j] / run->time;
        const double mean = fmin(2 / (other * run->interval), 1); // over a sample interval
        if (j == k)
            continue;
        peak += truncation_square(tie / away * run->mode_peak[j] * other);
        pull += truncation_square(tie / away * truncation_square(other) * mean) * speed;
        if (j > k)
            continue;
        double widest = 0;
        for (size_t i = 0; i < m; i++)
            widest = fmax(widest, fabs(run->shapes[j * m + i]));
        coupling->shift[j] += truncation_square(tie / own) / 2;
        turned += coupling->shift[j] * widest * run->mode_peak[j] * other /
                  fmax(modes->damping[j * (n + 1)] / 2, slowest);
    }
    for (size_t j = 0; j < m; j++) {
        const double shape = truncation_square(run->shapes[k * m + j]);
        coupling->peak[j] += 4 * shape * peak;
        coupling->pull[j] += 4 * shape * pull;
    }
    return turned;
}

// A damper meets its stops about twice a swing and leaves an impulse J = m_e (1 + e) V, V being the
// storey's speed, of which a mode takes phi J / w. Part of each impulse is wrong: the share that
// the modes left out have in the mobility 1 / m_e and in V. Each later impact amplifies what was
// wrong by exp(GROWTH).
typedef struct ImpactEffect {
    double displacement, acceleration;
} ImpactEffect;

static const double GROWTH = 0.5, ROUNDING = 1e-15;

// Adds one damper's effect on effects[k], of a run that keeps the modes below k.
static void truncation_impacts(const ModalRun *run, size_t damper, ImpactEffect *effects) {
    const Plan *plan = run->plan;
    const Modes *modes = &plan->modes;
    const PlanDamper *of = &plan->dampers[damper];
    const Derived *derived = &plan->report.derived.at[2 * damper];
    const size_t n = run->n, j = of->storey;
    const double duration = plan->duration, slowest = 1 / duration;
    const double speed = run->storey_speed[damper] + fabs(of->velocity), reach = run->peak[j];
    const double drift = fabs(plan->velocity[j] + of->velocity) * duration;
    const bool is_free = run->base->form == BASE_STILL;
    if (!(speed > 0) || (is_free && 2 * reach + drift < of->clearance / 2 - fabs(of->position)))
        return;
    const double restitution = fmax(derived[0].restitution, derived[1].restitution);
    const double impulse =
        of->effective_mass * (1 + (isnan(restitution) ? 0.7 : restitution)) * speed;
    const double rate = reach > 0 ? speed / reach / PI : 0; // impacts per second
    const double remembered = rate * fmin(duration, 2 / fmax(modes->damping[0], 1e-300));
    double moved = 0, pulled = 0, missed = 0, missed_pull = 0, mobility = 0, still = 0;
    for (size_t k = 0; k < n; k++) {
        const double omega = fmax(modes->omega[k], slowest);
        const double taken = truncation_square(run->shapes[k * run->m + j]) * impulse;
        moved += taken / omega;
        pulled += truncation_square(taken * omega);
    }
    for (size_t k = n - 1; k > 0; k--) {
        const double omega = fmax(modes->omega[k], slowest);
        const double shape = run->shapes[k * run->m + j];
        const double taken = truncation_square(shape) * impulse;
        missed += taken / omega;
        missed_pull = hypot(missed_pull, taken * omega);
        mobility += truncation_square(shape);
        still = hypot(still, shape * run->mode_peak[k] * omega);
        const double wrong = ROUNDING + mobility * of->effective_mass + still / speed;
        const double grown = wrong * exp(fmin(GROWTH * rate * duration, 40));
        const double part = fmin(grown, 1) * sqrt(1 + remembered);
        effects[k].displacement += missed + moved * part;
        effects[k].acceleration = hypot(effects[k].acceleration, missed_pull + sqrt(pulled) * part);
    }
}

// a / b, at most 1, which is also the answer where b is unknown; 0 where there is nothing.
static double truncation_ratio(double a, double b) {
    return a == 0 ? 0 : b > 0 && a < b ? a / b : 1;
}

// errors[k] of the run that keeps the modes up to k. `work` holds n + 2 m numbers, `impacts` n.
static void truncation_conclude(const ModalRun *run, double *work, ImpactEffect *impacts,
                                TruncationError *errors) {
    const size_t n = run->n, m = run->m, dampers = run->plan->damper_count;
    const bool is_coupled = !run->plan->modes.is_classical;
    const double safety = dampers > 0 ? SAFETY_IMPACTS : SAFETY;
    Coupling coupling = {work, work + m, work + 2 * m};
    double whole = 0, whole_rms = 0;
    for (size_t j = 0; j < m; j++) {
        whole = fmax(whole, run->peak[j]);
        whole_rms = fmax(whole_rms, sqrt(run->square[j] / run->time));
    }
    for (size_t d = 0; d < dampers; d++)
        truncation_impacts(run, d, impacts);
    errors[n - 1] = (TruncationError){0};
    for (size_t k = n - 1; k > 0; k--) {
        const double shifted = is_coupled ? truncation_couple(run, k, &coupling) : 0;
        double peak = 0, rms = 0, pull = 0, kept = 0;
        for (size_t j = 0; j < m; j++) {
            const size_t at = k * m + j;
            const double shape = fabs(run->shapes[at]);
            const double left = run->square[at] / run->time;
            const double rest = (run->square[j] - 2 * run->cross[at]) / run->time + left;
            peak =
                fmax(peak, fmax(run->peak[at], shape * run->mode_peak[k]) + sqrt(coupling.peak[j]));
            kept = fmax(kept, sqrt(fmax(rest, 0)));
            rms = fmax(rms, left / (2 * whole_rms));
            pull += run->pulls[at] / run->time + coupling.pull[j];
        }
        const TruncationError *more = &errors[k];
        rms = fmax(rms, fabs(kept - whole_rms)) + shifted;
        const double displacement = safety * (peak + shifted) + impacts[k].displacement;
        const double acceleration = safety * sqrt(pull) + impacts[k].acceleration;
        const double displacement_rms = safety * rms + impacts[k].displacement;
        errors[k - 1] = (TruncationError){
            fmax(truncation_ratio(displacement, whole), more->displacement),
            fmax(truncation_ratio(acceleration, sqrt(run->acceleration / run->time)),
                 more->mean_acceleration),
            fmax(truncation_ratio(displacement_rms, whole_rms), more->rms_displacement),
        };
    }
}

static Status truncation_run(const Plan *plan, const Base *base, TruncationError *errors) {
    const size_t n = plan->modes.count, m = plan->storeys;
    double *block = calloc(n * (5 * m + 15) + 5 * m + plan->damper_count, sizeof *block);
    ImpactEffect *impacts = calloc(n, sizeof *impacts);
    if (block == NULL || impacts == NULL) {
        free(block);
        free(impacts);
        return STATUS_NO_MEMORY;
    }
    ModalRun run = {.plan = plan, .base = base, .n = n, .m = m};
    double **const arrays[] = {&run.shapes, &run.peak, &run.square, &run.cross, &run.pulls};
    double **const rows[] = {&run.q,           &run.p,         &run.before,
                             &run.accelerated, &run.mode_peak, &run.mode_speed};
    double *next = block;
    for (size_t i = 0; i < COUNT(arrays); i++, next += n * m)
        *arrays[i] = next;
    for (size_t i = 0; i < COUNT(rows); i++, next += n)
        *rows[i] = next;
    run.recurrence = next;
    run.x = next + 8 * n;
    run.left = run.x + m;
    run.pull = run.left + m;
    run.storey_speed = run.pull + m;
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < m; j++) {
            run.shapes[k * m + j] = plan->modes.shapes[j * n + k];
            for (size_t l = 0; l < m; l++) {
                const double carried = plan->modes.shapes[j * n + k] * plan->mass[j * m + l];
                run.q[k] += carried * plan->displacement[l];
                run.p[k] += carried * plan->velocity[l];
            }
        }
    modal_run_all(&run);
    truncation_conclude(&run, run.storey_speed + plan->damper_count, impacts, errors);
    free(impacts);
    free(block);
    return STATUS_OK;
}

Status truncation_predict(const Plan *plan, const Scene *scene, TruncationError *errors) {
    const Excitation *excitation = scene_excitation(scene);
    const Span span = {.duration = plan->duration, .sample_rate = plan->sample_rate};
    Base base = {0};
    if (plan->modes.count == 0)
        return STATUS_OK;
    TRY(excitation_kind(excitation)->make(excitation, &span, NULL, &base, NULL));
    const Status status = truncation_run(plan, &base, errors);
    base_clear(&base);
    return status;
}

double truncation_moved_mass(const Plan *plan, size_t kept) {
    const Modes *modes = &plan->modes;
    double sum = 0, all = 0;
    for (size_t k = 0; k < modes->count; k++) {
        const double mass = modes->participation[k] * modes->participation[k];
        all += mass;
        sum += k < kept ? mass : 0;
    }
    return all > 0 ? sum / all : 1;
}
