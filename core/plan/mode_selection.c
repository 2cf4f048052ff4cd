// A mode moves if the base or the initial state excites it, if a damper is where its shape is not
// 0, or if damping couples it to a mode that moves. In doubles these quantities are never exactly
// 0:
//
//   |phi' v| <= ROUNDINGS eps |phi|' |v|
//
// counts as 0, as does a shape so small beside its largest value. The other modes stay at rest
// whatever these do, so that leaving them out changes no more than rounding does.
#include "core/plan/mode_selection.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/modal_truncation.h"

enum { ROUNDINGS = 64 };
static const double NEGLIGIBLE = ROUNDINGS * DBL_EPSILON;

// |phi_k' v| over |phi_k|' |v|; 0 where both are 0.
static double mode_share(const Plan *plan, size_t k, const double *v) {
    const Modes *modes = &plan->modes;
    long double sum = 0, size = 0;
    for (size_t j = 0; j < plan->storeys; j++) {
        const long double term = (long double)modes->shapes[j * modes->count + k] * v[j];
        sum += term;
        size += fabsl(term);
    }
    return size > 0 ? (double)(fabsl(sum) / size) : 0;
}

// The largest share that base, initial state and dampers have in mode k without coupling. `sources`
// holds `count` vectors.
static double mode_visibility(const Plan *plan, size_t k, const double *sources, size_t count) {
    const Modes *modes = &plan->modes;
    double most = 0, widest = 0;
    for (size_t i = 0; i < count; i++)
        most = fmax(most, mode_share(plan, k, sources + i * plan->storeys));
    for (size_t j = 0; j < plan->storeys; j++)
        widest = fmax(widest, fabs(modes->shapes[j * modes->count + k]));
    for (size_t d = 0; d < plan->damper_count; d++)
        most = fmax(most, fabs(modes->shapes[plan->dampers[d].storey * modes->count + k]) / widest);
    return most;
}

// M times the initial displacement and velocity, and M r where the base moves. Returns how many.
static size_t mode_sources(const Plan *plan, const Scene *scene, double *sources) {
    const double *const from[] = {plan->displacement, plan->velocity, plan->influence};
    const size_t n = plan->storeys, count = excitation_is_still(scene_excitation(scene)) ? 2 : 3;
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < n; j++) {
            long double sum = 0;
            for (size_t l = 0; l < n; l++)
                sum += (long double)plan->mass[j * n + l] * from[i][l];
            sources[i * n + j] = (double)sum;
        }
    return count;
}

// Lists, by rising index, those of the first `count` modes that may move; `seen` holds the
// visibility of each. Returns how many; at least one.
static size_t mode_list_moving(const Modes *modes, size_t count, double *seen, size_t *list) {
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
    size_t found = 0;
    for (size_t k = 0; k < count; k++)
        if (seen[k] > NEGLIGIBLE)
            list[found++] = k;
    if (found == 0)
        list[found++] = 0;
    return found;
}

// Predicted cost: a step for each mode, or a matrix product where they are coupled.
static double mode_work(double modes, bool is_coupled) {
    return modes + (is_coupled ? modes * modes / 4 : 0);
}

static Status mode_decide_unseen(Plan *plan, const double *seen, const size_t *list, size_t found,
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
        1 - mode_work((double)found, is_coupled) / mode_work((double)count, is_coupled),
        "neither the base nor the initial state nor a damper excites them: their relative "
        "participation is at most %.2g",
        largest);
}

static Status mode_decide_lowest(Plan *plan, const TruncationError *error, size_t modes,
                                 double moved) {
    const char *about =
        plan->damper_count == 0 ? "" : " and add no compliance at the dampers' storeys";
    return decisions_add(&plan->report.decisions, "modes", "lowest", (double)modes, "modes",
                         "the scene asks for these of %zu; they hold %.4g of the mass that the "
                         "base moves; the others stay at rest%s: predicted errors are %.2g of "
                         "displacement, %.2g of mean_acceleration",
                         plan->storeys, moved, about, error->displacement,
                         error->mean_acceleration);
}

static Status mode_select(Plan *plan, const Scene *scene, size_t modes, double *room,
                          size_t *list) {
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
            status = mode_decide_lowest(plan, &errors[modes - 1], modes,
                                        truncation_moved_mass(plan, modes));
        }
        free(errors);
    }
    if (status != STATUS_OK)
        return status;
    double *seen = room + 3 * n;
    const size_t count = mode_sources(plan, scene, room);
    for (size_t k = 0; k < modes; k++)
        seen[k] = mode_visibility(plan, k, room, count);
    const size_t found = mode_list_moving(&plan->modes, modes, seen, list);
    if (found < modes)
        status = mode_decide_unseen(plan, seen, list, found, modes, is_coupled);
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
        status = mode_select(plan, scene, modes == 0 || modes > n ? n : modes, room, list);
    free(room);
    free(list);
    return status == STATUS_OK ? status : problem_set(problem, status, "no memory for the modes");
}
