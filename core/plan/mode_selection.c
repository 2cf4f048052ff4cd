// A mode moves if the base pushes it, if it starts, if a damper stands where it moves, or if
// damping ties it to one that does. What is computed of it in doubles is never exactly 0:
//
//   |phi' v| <= ROUNDINGS eps |phi|' |v|
//
// counts as nothing, as does a shape that small beside its largest. The modes left then stay at
// rest whatever the others do, so that leaving them out changes no more than rounding.
#include "core/plan/mode_selection.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/modal_truncation.h"
#include "core/plan/truncation_levels.h"

enum { ROUNDINGS = 64 };
static const double nothing = ROUNDINGS * DBL_EPSILON;

// The part of |phi_k|' |v| that phi_k' v is; 0 where both are.
static double part_of(const Plan *plan, size_t k, const double *v) {
    const Modes *modes = &plan->modes;
    long double sum = 0, size = 0;
    for (size_t j = 0; j < plan->storeys; j++) {
        const long double term = (long double)modes->shapes[j * modes->count + k] * v[j];
        sum += term;
        size += fabsl(term);
    }
    return size > 0 ? (double)(fabsl(sum) / size) : 0;
}

// How much a mode sees by itself of base, start and dampers: the largest part.
static double visibility(const Plan *plan, size_t k, const double *carried, size_t count) {
    const Modes *modes = &plan->modes;
    double most = 0, widest = 0;
    for (size_t i = 0; i < count; i++)
        most = fmax(most, part_of(plan, k, carried + i * plan->storeys));
    for (size_t j = 0; j < plan->storeys; j++)
        widest = fmax(widest, fabs(modes->shapes[j * modes->count + k]));
    for (size_t d = 0; d < plan->damper_count; d++)
        most = fmax(most, fabs(modes->shapes[plan->dampers[d].storey * modes->count + k]) / widest);
    return most;
}

// M times what is pushed: the initial state, and r where the base moves.
static size_t carry(const Plan *plan, const Scene *scene, double *carried) {
    const double *const from[] = {plan->displacement, plan->velocity, plan->influence};
    const size_t n = plan->storeys, count = levels_is_still(scene) ? 2 : 3;
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < n; j++) {
            long double sum = 0;
            for (size_t l = 0; l < n; l++)
                sum += (long double)plan->mass[j * n + l] * from[i][l];
            carried[i * n + j] = (double)sum;
        }
    return count;
}

// Lists, by rising index, those of the first `count` modes that may move; `seen` holds what each
// sees. Returns how many; at least one.
static size_t list_seen(const Modes *modes, size_t count, double *seen, size_t *list) {
    const double *D = modes->damping;
    const size_t all = modes->count;
    for (bool grows = !modes->is_classical; grows;) {
        grows = false;
        for (size_t k = 0; k < count; k++) {
            double tied = 0;
            for (size_t j = 0; j < count && seen[k] <= nothing; j++)
                if (seen[j] > nothing)
                    tied = fmax(tied,
                                fabs(D[k * all + j]) / sqrt(fabs(D[k * all + k] * D[j * all + j])));
            // Without damping of its own a mode has no ties, but for rounding's.
            if (!(tied <= nothing)) {
                seen[k] = tied;
                grows = true;
            }
        }
    }
    size_t found = 0;
    for (size_t k = 0; k < count; k++)
        if (seen[k] > nothing)
            list[found++] = k;
    if (found == 0)
        list[found++] = 0;
    return found;
}

// As foretold: a step for each mode, or a product with a matrix where they are coupled.
static double work_of(double modes, bool is_coupled) {
    return modes + (is_coupled ? modes * modes / 4 : 0);
}

static Status decide_unseen(Plan *plan, const double *seen, const size_t *list, size_t found,
                            size_t count, bool is_coupled) {
    double largest = 0;
    for (size_t k = 0, i = 0; k < count; k++) {
        if (i < found && list[i] == k)
            i++;
        else
            largest = fmax(largest, seen[k]);
    }
    return decisions_omit(
        &plan->report.decisions, "unseen_modes", (double)(count - found), "modes",
        1 - work_of((double)found, is_coupled) / work_of((double)count, is_coupled),
        "nothing sets them moving: not the base, nor the start, nor a damper; each sees at most "
        "%.2g of these",
        largest);
}

static Status decide_modes(Plan *plan, const TruncationError *error, size_t modes, double moved) {
    const char *about =
        plan->damper_count == 0 ? "" : ", and neither move nor give way at the dampers' storeys";
    return decisions_add(&plan->report.decisions, "modes", "lowest", (double)modes, "modes",
                         "the scene asks for these of %zu; they hold %.4g of the mass that the "
                         "base moves; the others stay at rest%s: foretold errors are %.2g of "
                         "displacement, %.2g of mean_acceleration",
                         plan->storeys, moved, about, error->displacement,
                         error->mean_acceleration);
}

static Status keep(Plan *plan, const Scene *scene, size_t modes, double *room, size_t *list) {
    const size_t n = plan->storeys;
    const bool is_coupled = !plan->modes.is_classical;
    TruncationError *errors = NULL;
    Status status = STATUS_OK;
    if (modes < n) {
        errors = malloc(n * sizeof *errors);
        status = errors == NULL ? STATUS_NO_MEMORY : truncation_predict(plan, scene, errors);
        if (status == STATUS_OK) {
            plan->is_truncated = true;
            plan->given_up = errors[modes - 1].displacement;
            status =
                decide_modes(plan, &errors[modes - 1], modes, truncation_moved_mass(plan, modes));
        }
        free(errors);
    }
    if (status != STATUS_OK)
        return status;
    double *seen = room + 3 * n;
    const size_t count = carry(plan, scene, room);
    for (size_t k = 0; k < modes; k++)
        seen[k] = visibility(plan, k, room, count);
    const size_t found = list_seen(&plan->modes, modes, seen, list);
    if (found < modes)
        status = decide_unseen(plan, seen, list, found, modes, is_coupled);
    modes_keep(&plan->modes, n, list, found);
    return status;
}

Status plan_keep(Plan *plan, const Scene *scene, size_t modes, Problem *problem) {
    const size_t n = plan->storeys;
    if (plan->modes.count == 0)
        return STATUS_OK;
    double *room = calloc(n, 4 * sizeof *room);
    size_t *list = calloc(n, sizeof *list);
    Status status = STATUS_NO_MEMORY;
    if (room != NULL && list != NULL)
        status = keep(plan, scene, modes == 0 || modes > n ? n : modes, room, list);
    free(room);
    free(list);
    return status == STATUS_OK ? status : problem_set(problem, status, "no memory for the modes");
}
