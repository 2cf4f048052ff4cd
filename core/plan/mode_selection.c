// Modes left out of a plan: modes above the number asked for, and modes that nothing sets in
// motion.
//
// A mode moves if the base or the initial state excites it, if a damper is where its shape is not
// 0, or if damping couples it to a mode that moves. In doubles these quantities are never exactly
// 0:
//
//   |phi' M v| <= ROUNDINGS eps sqrt(v' M v)
//
// counts as 0, as does a shape so small beside its largest value. The other modes stay at rest
// whatever these do, so that leaving them out changes no more than rounding does.
//
// The error of keeping only the lowest modes is predicted from one run of every mode by itself,
// without dampers. A mode obeys, with a_g linear within a step,
//
//   q'' + D q' + w^2 q = -share a_g,
//
// so that the increment of (q, q') over a step is a block of exp(A h) - I times (q, q', a_g, a_g').
// Peaks and mean squares of the modes are combined at every storey as those of a response spectrum:
// peaks left out by their sum, all else by the root of the sum of squares. Coupled damping and
// impacts are estimated from the same numbers. SAFETY covers what they, sampling and the phases of
// the modes change; its value and GROWTH are calibrated with tests/truth/test_modes.c.
#include "core/plan/plan.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/matrix_exponential.h"

enum {
    ROUNDINGS = 64,
    PROGRESS_STEPS = 4096, // between two looks at the progress
};
static const double NEGLIGIBLE = ROUNDINGS * DBL_EPSILON;

static const double PI = 3.14159265358979323846;
static const double SAFETY = 2;
static const double STEPS_MAX = 2e7;                   // steps of modes: about 0.1 s
static const double RADIANS = 0.3;                     // of the fastest motion in a step
static const double MODE_STEP = 0.12, BASE_STEP = 1.5; // cost of a step, in solver steps

// All modes in motion. Arrays have a number for each mode.
typedef struct ModalRun {
    const Progress *progress;
    bool is_stopped; // by it
    const Plan *plan;
    const Base *base;
    size_t n;
    double step;                          // [s]
    double piece_speeds[BASE_PIECES_MAX]; // the integrals of a_g over whole pieces [m/s]
    double *q, *p;                        // the state
    double *recurrence; // eight rows: what (q, q', a_g, a_g') add to q and to q' in a step
    double *peak_q, *peak_p;
    // Sums of squares of q, q', q'' and q'' + share a_g; sum of the products with q of mode 0.
    double *squares, *speeds, *pulls, *absolutes, *products;
    double count; // steps
} ModalRun;

static void modal_run_recurrence(ModalRun *run) {
    enum { Q, P, A, B, SIZE };
    const Modes *modes = &run->plan->modes;
    const size_t n = run->n;
    for (size_t k = 0; k < n; k++) {
        long double system[SIZE * SIZE] = {0}, gain[SIZE * SIZE];
        system[Q * SIZE + P] = system[A * SIZE + B] = 1;
        system[P * SIZE + Q] = -(long double)modes->omega[k] * modes->omega[k];
        system[P * SIZE + P] = -(long double)modes->damping[k * (n + 1)];
        system[P * SIZE + A] = -(long double)modes->participation[k];
        matrix_exponential_increment(system, SIZE, run->step, gain);
        for (size_t i = 0; i < 2 * SIZE; i++)
            run->recurrence[i * n + k] = (double)gain[i];
    }
}

// One step from a_g = a, a_g' = b.
static void modal_run_step(ModalRun *run, double a, double b) {
    const size_t n = run->n;
    const double *g = run->recurrence, *share = run->plan->modes.participation;
    const double middle = a + b * run->step / 2, first = run->q[0], rate = 1 / run->step;
    double *restrict q = run->q, *restrict p = run->p;
    double *restrict peak_q = run->peak_q, *restrict peak_p = run->peak_p;
    double *restrict squares = run->squares, *restrict products = run->products;
    double *restrict pulls = run->pulls, *restrict absolutes = run->absolutes;
    double *restrict speeds = run->speeds;
    for (size_t k = 0; k < n; k++) {
        const double dq = g[k] * q[k] + g[n + k] * p[k] + (g[2 * n + k] * a + g[3 * n + k] * b);
        const double dp =
            g[4 * n + k] * q[k] + g[5 * n + k] * p[k] + (g[6 * n + k] * a + g[7 * n + k] * b);
        const double pull = dp * rate, absolute = pull + share[k] * middle;
        squares[k] += q[k] * q[k];
        speeds[k] += p[k] * p[k];
        products[k] += q[k] * first;
        pulls[k] += pull * pull;
        absolutes[k] += absolute * absolute;
        q[k] += dq;
        p[k] += dp;
        peak_q[k] = fabs(q[k]) > peak_q[k] ? fabs(q[k]) : peak_q[k];
        peak_p[k] = fabs(p[k]) > peak_p[k] ? fabs(p[k]) : peak_p[k];
    }
    run->count++;
}

// The integral of a_g over the first `length` seconds of a piece [m/s].
static double modal_run_piece_speed(const Base *base, const BasePiece *piece, double length) {
    const double omega = base->omega;
    if (piece->value == 0 && piece->slope == 0)
        return 0;
    return omega == 0
               ? length * (piece->value + length / 2 * piece->slope)
               : (piece->value * sin(omega * length) + piece->slope * (1 - cos(omega * length))) /
                     omega;
}

// The integral of a_g up to t, of a base in closed form [m/s].
static double modal_run_base_speed(const ModalRun *run, double t) {
    const Base *base = run->base;
    double speed = 0;
    if (base->form == BASE_SINE)
        return t > 0 ? base->amplitude / base->omega * (1 - cos(base->omega * t)) : 0;
    for (size_t i = 0; i < base->piece_count && t > base->pieces[i].time; i++)
        speed += i + 1 < base->piece_count && t >= base->pieces[i + 1].time
                     ? run->piece_speeds[i]
                     : modal_run_piece_speed(base, &base->pieces[i], t - base->pieces[i].time);
    return speed;
}

// a_g at t; of a base in closed form the mean over a step around t, because a pulse may be shorter
// than that.
static double modal_run_base(const ModalRun *run, double t) {
    const Base *base = run->base;
    const double step = run->step;
    if (base->form != BASE_SAMPLED)
        return (modal_run_base_speed(run, t + step / 2) - modal_run_base_speed(run, t - step / 2)) /
               step;
    const double index = t / base->interval;
    const size_t at = (size_t)index;
    if (at + 1 >= base->count)
        return at + 1 == base->count ? base->values[at] : 0;
    return base->values[at] + (index - (double)at) * (base->values[at + 1] - base->values[at]);
}

// Length of a step [s].
static double truncation_step(double duration, double sample_rate, double base_interval,
                              double fastest, size_t modes) {
    const double interval = 1 / sample_rate;
    double step = interval;
    if (base_interval > 0)
        step = base_interval / ceil(base_interval / fmin(interval, base_interval) * (1 - 1e-9));
    else // no sine, corner of a pulse or release may fall between two steps of the fastest mode
        step = fmin(step, RADIANS / fastest);
    return fmax(step, duration * (double)modes / STEPS_MAX);
}

double truncation_cost(double duration, double sample_rate, double base_interval, double fastest,
                       size_t modes) {
    const double step = truncation_step(duration, sample_rate, base_interval, fastest, modes);
    return duration / step * (BASE_STEP + MODE_STEP * (double)modes);
}

static void modal_run_all(ModalRun *run) {
    const Base *base = run->base;
    const double duration = run->plan->duration;
    const double fastest = fmax(base->omega, run->plan->modes.omega[run->n - 1]);
    const double step =
        truncation_step(duration, run->plan->sample_rate,
                        base->form == BASE_SAMPLED ? base->interval : 0, fastest, run->n);
    run->step = step;
    modal_run_recurrence(run);
    // The first sample counts for a whole interval, however fast a mode decays.
    const Modes *modes = &run->plan->modes;
    run->count = fmax(1 / run->plan->sample_rate / step, 1);
    for (size_t k = 0; k < run->n; k++) {
        const double q = run->q[k], p = run->p[k];
        const double absolute =
            -modes->damping[k * (run->n + 1)] * p - modes->omega[k] * modes->omega[k] * q;
        run->peak_q[k] = fabs(q);
        run->peak_p[k] = fabs(p);
        run->squares[k] = run->count * q * q;
        run->products[k] = run->count * q * run->q[0];
        run->pulls[k] = run->absolutes[k] = run->count * absolute * absolute;
    }
    for (size_t i = 0; i + 1 < base->piece_count; i++)
        run->piece_speeds[i] = modal_run_piece_speed(
            base, &base->pieces[i], base->pieces[i + 1].time - base->pieces[i].time);
    double a = modal_run_base(run, 0);
    const double steps = ceil(duration / step * (1 - 1e-9));
    for (size_t i = 1; (double)i <= steps; i++) {
        if (i % PROGRESS_STEPS == 0 && !progress_advance(run->progress, 0)) {
            run->is_stopped = true;
            return;
        }
        const double next = modal_run_base(run, (double)i * step);
        modal_run_step(run, a, (next - a) / step);
        a = next;
    }
}

static double truncation_square(double x) {
    return x * x;
}

// Adds what coupled damping makes of the speed of mode j, at the frequency of mode j, to mode k.
static void truncation_couple(ModalRun *run) {
    const Modes *modes = &run->plan->modes;
    const size_t n = run->n;
    const double slowest = 1 / run->plan->duration;
    for (size_t i = 0; i < n * n && !modes->is_classical; i++) {
        const size_t k = i / n, j = i % n;
        const double own = modes->omega[k], other = fmax(modes->omega[j], slowest);
        const double away =
            fabs(own - other) * (own + other) + fmax(modes->damping[k * (n + 1)], slowest) * other;
        const double part = j == k ? 0 : fabs(modes->damping[i]) / away;
        run->peak_q[k] += part * run->peak_p[j];
        run->squares[k] += truncation_square(part) * run->speeds[j];
        run->pulls[k] += truncation_square(part * other * other) * run->speeds[j];
    }
}

// The root of the sum over the modes from `first` on of (shape peak)^2 at a storey.
static double truncation_combine(const ModalRun *run, size_t storey, size_t first,
                                 const double *peaks) {
    double sum = 0;
    for (size_t k = first; k < run->n; k++)
        sum += truncation_square(run->plan->modes.shapes[storey * run->n + k] * peaks[k]);
    return sqrt(sum);
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
    const double speed = truncation_combine(run, j, 0, run->peak_p) + fabs(of->velocity);
    const double reach = truncation_combine(run, j, 0, run->peak_q);
    const double drift = fabs(plan->velocity[j] + of->velocity) * duration;
    const bool is_free = run->base->form == BASE_STILL;
    if (!(speed > 0) || (is_free && 2 * reach + drift < of->clearance / 2 - fabs(of->position)))
        return;
    const double restitution = fmax(derived[0].restitution, derived[1].restitution);
    const double impulse =
        of->effective_mass * (1 + (isnan(restitution) ? 0.7 : restitution)) * speed;
    const double rate = reach > 0 ? speed / reach / PI : 0; // impacts per second
    const double remembered = rate * fmin(duration, 2 / fmax(modes->damping[0], 1e-300));
    double moved = 0, pulled = 0, missed = 0, missed_pull = 0, mobility = 0;
    for (size_t k = 0; k < n; k++) {
        const double omega = fmax(modes->omega[k], slowest);
        const double taken = truncation_square(modes->shapes[j * n + k]) * impulse;
        moved += taken / omega;
        pulled += truncation_square(taken * omega);
    }
    for (size_t k = n - 1; k > 0; k--) {
        const double omega = fmax(modes->omega[k], slowest);
        const double shape = modes->shapes[j * n + k];
        const double taken = truncation_square(shape) * impulse;
        missed += taken / omega;
        missed_pull = hypot(missed_pull, taken * omega);
        mobility += truncation_square(shape);
        const double wrong = ROUNDING + mobility * of->effective_mass +
                             truncation_combine(run, j, k, run->peak_p) / speed;
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

// errors[k] of the run that keeps the modes up to k. `work` holds two numbers for each storey.
static void truncation_conclude(const ModalRun *run, double *work, ImpactEffect *impacts,
                                TruncationError *errors) {
    const Plan *plan = run->plan;
    const size_t n = run->n, m = plan->storeys;
    double *peaks = work, *left = work + m; // displacement and its mean square left out
    double whole = 0, whole_rms = 0, absolute = 0, pull = 0;
    for (size_t j = 0; j < m; j++) {
        const double *shape = &plan->modes.shapes[j * n];
        double square = 0;
        for (size_t k = 0; k < n; k++) {
            square += shape[k] *
                      (shape[k] * run->squares[k] + (k > 0 ? 2 * shape[0] * run->products[k] : 0));
            absolute += truncation_square(shape[k]) * run->absolutes[k] / run->count;
        }
        whole = fmax(whole,
                     fmax(truncation_combine(run, j, 0, run->peak_q), fabs(plan->displacement[j])));
        whole_rms = fmax(whole_rms, sqrt(fmax(square, 0) / run->count));
    }
    for (size_t d = 0; d < plan->damper_count; d++)
        truncation_impacts(run, d, impacts);
    errors[n - 1] = (TruncationError){0};
    for (size_t k = n - 1; k > 0; k--) {
        double peak = 0, rms = 0;
        for (size_t j = 0; j < m; j++) {
            const double *shape = &plan->modes.shapes[j * n];
            peaks[j] += fabs(shape[k]) * run->peak_q[k];
            left[j] += shape[k] * (shape[k] * run->squares[k] + 2 * shape[0] * run->products[k]) /
                       run->count;
            pull += truncation_square(shape[k]) * run->pulls[k] / run->count;
            peak = fmax(peak, peaks[j]);
            rms = fmax(rms, plan->modes.is_classical ? fabs(left[j]) / (2 * whole_rms)
                                                     : sqrt(fabs(left[j])));
        }
        const TruncationError *more = &errors[k];
        errors[k - 1] = (TruncationError){
            fmax(truncation_ratio(SAFETY * peak + impacts[k].displacement, whole),
                 more->displacement),
            fmax(truncation_ratio(SAFETY * sqrt(pull) + impacts[k].acceleration, sqrt(absolute)),
                 more->mean_acceleration),
            fmax(truncation_ratio(SAFETY * rms + impacts[k].displacement, whole_rms),
                 more->rms_displacement),
        };
    }
}

static Status truncation_run(const Plan *plan, const Base *base, const Progress *progress,
                             TruncationError *errors) {
    const size_t n = plan->modes.count, m = plan->storeys;
    ModalRun run = {.plan = plan, .base = base, .n = n, .progress = progress};
    double **const rows[] = {&run.q,      &run.p,     &run.peak_q,    &run.peak_p,  &run.squares,
                             &run.speeds, &run.pulls, &run.absolutes, &run.products};
    double *block = calloc(n * (COUNT(rows) + 8) + 2 * m, sizeof *block);
    ImpactEffect *impacts = calloc(n, sizeof *impacts);
    if (block != NULL && impacts != NULL) {
        for (size_t i = 0; i < COUNT(rows); i++)
            *rows[i] = block + i * n;
        run.recurrence = block + COUNT(rows) * n;
        modes_coordinates(&plan->modes, m, plan->mass, plan->displacement, run.q);
        modes_coordinates(&plan->modes, m, plan->mass, plan->velocity, run.p);
        modal_run_all(&run);
        truncation_couple(&run);
        truncation_conclude(&run, run.recurrence + 8 * n, impacts, errors);
    }
    const Status status = block == NULL || impacts == NULL ? STATUS_NO_MEMORY
                          : run.is_stopped                 ? STATUS_CANCELLED
                                                           : STATUS_OK;
    free(impacts);
    free(block);
    return status;
}

Status truncation_predict(const Plan *plan, const Scene *scene, const Progress *progress,
                          TruncationError *errors) {
    const Excitation *excitation = scene_excitation(scene);
    const Span span = {.duration = plan->duration, .sample_rate = plan->sample_rate};
    Base base = {0};
    if (plan->modes.count == 0)
        return STATUS_OK;
    TRY(excitation_make(excitation, &span, progress, &base, NULL));
    const Status status = truncation_run(plan, &base, progress, errors);
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

// seen[k]: the largest share that base, initial state and dampers have in mode k without coupling.
static void mode_see(const Plan *plan, const Scene *scene, double *seen, double *coordinates) {
    const Modes *modes = &plan->modes;
    const double *const from[] = {plan->displacement, plan->velocity, plan->influence};
    const size_t n = plan->storeys, count = excitation_is_still(scene_excitation(scene)) ? 2 : 3;
    for (size_t i = 0; i < count; i++) {
        double squares = 0;
        modes_coordinates(modes, n, plan->mass, from[i], coordinates);
        for (size_t k = 0; k < n; k++)
            squares += coordinates[k] * coordinates[k];
        for (size_t k = 0; k < n && squares > 0; k++)
            seen[k] = fmax(seen[k], fabs(coordinates[k]) / sqrt(squares));
    }
    for (size_t k = 0; k < n; k++) {
        double widest = 0;
        for (size_t j = 0; j < n; j++)
            widest = fmax(widest, fabs(modes->shapes[j * n + k]));
        for (size_t d = 0; d < plan->damper_count; d++)
            seen[k] = fmax(seen[k], fabs(modes->shapes[plan->dampers[d].storey * n + k]) / widest);
    }
}

// Raises seen[k] of the first `count` modes that damping couples to a mode that moves.
static void mode_couple(const Modes *modes, size_t count, double *seen) {
    const double *D = modes->damping;
    const size_t all = modes->count;
    for (bool grows = !modes->is_classical; grows;) {
        grows = false;
        for (size_t k = 0; k < count; k++) {
            double tied = 0;
            for (size_t j = 0; j < count && seen[k] <= NEGLIGIBLE; j++)
                if (seen[j] > NEGLIGIBLE)
                    tied = fmax(tied,
                                fabs(D[k * all + j]) / sqrt(fabs(D[k * all + k] * D[j * all + j])));
            // A mode without damping of its own has no coupling but rounding.
            if (!(tied <= NEGLIGIBLE)) {
                seen[k] = tied;
                grows = true;
            }
        }
    }
}

static Status mode_keep_moving(Plan *plan, const Scene *scene, size_t count, double *seen,
                               double *coordinates, size_t *list) {
    double largest = 0;
    size_t found = 0;
    mode_see(plan, scene, seen, coordinates);
    mode_couple(&plan->modes, count, seen);
    for (size_t k = 0; k < count; k++)
        if (seen[k] > NEGLIGIBLE)
            list[found++] = k;
        else
            largest = fmax(largest, seen[k]);
    if (found == 0)
        list[found++] = 0;
    modes_keep(&plan->modes, plan->storeys, list, found);
    return found == count
               ? STATUS_OK
               : decisions_add(&plan->report.decisions, "unseen_modes", "left_out",
                               (double)(count - found), "modes",
                               "neither the base nor the initial state nor a damper excites them: "
                               "their relative participation is at most %.2g",
                               largest);
}

static Status mode_keep_lowest(Plan *plan, const Scene *scene, size_t count,
                               const Progress *progress, TruncationError *errors) {
    TRY(truncation_predict(plan, scene, progress, errors));
    const TruncationError *error = &errors[count - 1];
    plan->is_truncated = true;
    plan->given_up = error->displacement;
    return decisions_add(
        &plan->report.decisions, "modes", "lowest", (double)count, "modes",
        "the scene asks for these of %zu; they hold %.4g of the mass that the base moves; the "
        "others stay at rest%s: predicted errors are %.2g of displacement, %.2g of "
        "mean_acceleration",
        plan->storeys, truncation_moved_mass(plan, count),
        plan->damper_count == 0 ? "" : " and add no compliance at the dampers' storeys",
        error->displacement, error->mean_acceleration);
}

Status plan_keep(Plan *plan, const Scene *scene, size_t modes, const Progress *progress,
                 Problem *problem) {
    const size_t n = plan->storeys, count = modes == 0 || modes > n ? n : modes;
    if (plan->modes.count == 0)
        return STATUS_OK;
    double *seen = calloc(n, 2 * sizeof *seen);
    size_t *list = calloc(n, sizeof *list);
    TruncationError *errors = calloc(n, sizeof *errors);
    Status status = STATUS_NO_MEMORY;
    if (seen != NULL && list != NULL && errors != NULL) {
        status = count < n ? mode_keep_lowest(plan, scene, count, progress, errors) : STATUS_OK;
        if (status == STATUS_OK)
            status = mode_keep_moving(plan, scene, count, seen, seen + n, list);
    }
    free(seen);
    free(list);
    free(errors);
    if (status == STATUS_CANCELLED)
        return problem_set(problem, status, "cancelled before t = 0 s");
    return status == STATUS_OK ? status : problem_set(problem, status, "no memory for the modes");
}
