// Efficient global optimisation (Jones, Schonlau and Welch 1998). A Gaussian process models the
// objective and every constraint. Its kernel is a Matern 5/2 with one length for each variable,
// plus a share of an exponential with shorter lengths, which stands for the jumps that impacts
// cause. Objective and constraints share one matrix, hence the kernel's parameters, which maximise
// the likelihood of all. The next candidate has the largest
//
//     log of expected improvement on the best feasible candidate + log of the probability that the
//     constraints hold (Schonlau 1997)
//
// Two objectives are reduced to one by weights that differ from candidate to candidate (Knowles
// 2006, "ParEGO"): max(w a, (1 - w) b) + 0.05 (w a + (1 - w) b) of the objectives scaled to 0 to 1.
//
// The first candidates fill the space, a Sobol sequence, and some later ones its better part. Those
// without results reduce the variance of the model, not its mean (Ginsbourger, Le Riche and Carraro
// 2010).
#include "core/study/search.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "core/study/inputs.h"

enum {
    ROWS = 160,                         // of the model at most
    RESPONSES = 1 + SEARCH_CONSTRAINTS, // modelled: an objective and the constraints
    PARAMETERS = SEARCH_VARIABLES + 2,  // logarithms of lengths, share and scale of the jumps
    OPTIMIZER_BYTES = 16384,            // NLopt's, at least
    OPTIMIZER_VARIABLE_BYTES = 256,     // and of each two variables
    STARTS = 8,                         // of the choice of a candidate
    SCATTER = 3,                        // so many candidates for one that needs no model
    FIRST_FITS = 8,                     // of each parameter
};

typedef struct SearchRange {
    double mean, deviation, low, high;
} SearchRange;

// What is believed of the logarithms before any result. Impacts make results that differ at the
// smallest distances: the scale may be large.
static const SearchRange search_length = {-0.9, 1.5, -3.5, 2.5}, search_share = {-4.6, 1e3, -14, 0},
                         search_scale = {4, 1.5, 0.7, 6};

// A candidate in the order of merit: feasible ones first.
typedef struct SearchRank {
    double violation, value;
    size_t candidate;
} SearchRank;

typedef struct SearchModel {
    Sampling filling, drawing; // of the first candidates; of starts
    SearchRank *ranks;         // of the candidates with results
    double parameter[PARAMETERS], step[PARAMETERS];
    size_t fits;
    size_t rows, known;             // the first ones have results
    size_t row[ROWS];               // candidates
    double factor[ROWS][ROWS];      // lower triangle, Cholesky
    double target[RESPONSES][ROWS]; // standardised
    double weight[RESPONSES][ROWS]; // K^-1 target
    double spread[RESPONSES];       // sqrt of the process's variance, of standardised targets
    double bound[RESPONSES];        // standardised: the best feasible objective, NAN without; a
                                    // constraint's 0
    double inverse[SEARCH_VARIABLES], share, scale; // of the kernel; the first 1 / length
} SearchModel;

const double *search_point(const Search *search, size_t candidate) {
    return search->points + candidate * search->space.variables;
}

const double *search_results(const Search *search, size_t candidate) {
    return search->results + candidate * (search->space.objectives + search->space.constraints);
}

// Points of a space without real numbers; SIZE_MAX: more than there are candidates.
static size_t search_space_points(const SearchSpace *space) {
    size_t points = 1;
    for (size_t j = 0; j < space->variables; j++) {
        const size_t values = space->variable[j].values;
        if (values == 0 || points > space->candidates / values)
            return SIZE_MAX;
        points *= values;
    }
    return points;
}

// The value of a variable at a share of 0 to 1 of its range.
static double search_value(const SearchVariable *variable, double share) {
    return variable->values == 0
               ? share
               : fmin(floor(share * (double)variable->values), (double)(variable->values - 1));
}

static const SearchRange *search_range(const Search *search, size_t parameter) {
    const size_t n = search->space.variables;
    return parameter < n ? &search_length : parameter == n ? &search_share : &search_scale;
}

Status search_new(const SearchSpace *space, Search **made) {
    Search *search = *made = calloc(1, sizeof *search);
    TRY(status_made(search != NULL));
    const size_t points = search_space_points(space), n = space->variables,
                 candidates = points < space->candidates ? points : space->candidates;
    size_t sample = candidates * 3 / 10;
    sample = sample < 2 * n + 4 ? 2 * n + 4 : sample > 10 * n + 10 ? 10 * n + 10 : sample;
    search->space = *space;
    search->space.candidates = candidates;
    search->sample = points <= candidates || sample > candidates ? candidates : sample;
    search->points = calloc(candidates * n, sizeof *search->points);
    search->results = calloc(candidates * SEARCH_RESULTS, sizeof *search->results);
    SearchModel *model = search->model = calloc(1, sizeof *model);
    if (model != NULL)
        model->ranks = calloc(candidates, sizeof *model->ranks);
    if (search->points == NULL || search->results == NULL || model == NULL ||
        model->ranks == NULL) {
        search_free(search);
        *made = NULL;
        return STATUS_NO_MEMORY;
    }
    model->filling = (Sampling){.method = SAMPLING_SOBOL, .seed = space->seed};
    model->drawing = (Sampling){.method = SAMPLING_RANDOM, .seed = space->seed};
    for (size_t j = 0; j < n + 2; j++) {
        model->parameter[j] = search_range(search, j)->mean;
        model->step[j] = 0.7;
    }
    return STATUS_OK;
}

void search_free(Search *search) {
    if (search == NULL)
        return;
    if (search->model != NULL)
        free(search->model->ranks);
    free(search->model);
    free(search->points);
    free(search->results);
    free(search);
}

void search_add(Search *search, const double *results) {
    const size_t count = search->space.objectives + search->space.constraints;
    memcpy(search->results + search->added++ * count, results, count * sizeof *results);
}

double search_excess(const SearchSpace *space, const double *results) {
    double violation = 0;
    for (size_t i = 0; i < space->objectives + space->constraints; i++) {
        if (isnan(results[i]))
            return INFINITY;
        if (i >= space->objectives)
            violation = fmax(violation, results[i]);
    }
    return violation;
}

double search_violation(const Search *search, size_t candidate) {
    return search_excess(&search->space, search_results(search, candidate));
}

size_t search_best(const Search *search, size_t objective) {
    size_t best = SIZE_MAX;
    for (size_t i = 0; i < search->added; i++)
        if (search_violation(search, i) == 0 &&
            (best == SIZE_MAX ||
             search_results(search, i)[objective] < search_results(search, best)[objective]))
            best = i;
    return best;
}

// Difference of two values of a variable, in units in which the whole range is 1.
static double search_difference(const SearchVariable *variable, double a, double b) {
    if (variable->values == 0)
        return a - b;
    if (!variable->is_ordered)
        return a != b;
    return variable->values > 1 ? (a - b) / (double)(variable->values - 1) : 0;
}

double search_distance(const Search *search, const double *a, const double *b) {
    double largest = 0;
    for (size_t j = 0; j < search->space.variables; j++)
        largest = fmax(largest, fabs(search_difference(&search->space.variable[j], a[j], b[j])));
    return largest;
}

// --- The order of merit ---

// One number that stands for the objectives under the weights of the next candidate.
typedef struct SearchScalar {
    double low[SEARCH_OBJECTIVES], range[SEARCH_OBJECTIVES], share;
} SearchScalar;

// From the best value of each objective to that which it has where the other one is best.
static SearchScalar search_scalar(const Search *search) {
    SearchScalar scalar = {{0, 0}, {1, 1}, 0};
    double whole;
    scalar.share = modf((double)search->proposed * 0.6180339887498949, &whole);
    for (size_t k = 0; k < search->space.objectives && search->space.objectives > 1; k++) {
        const size_t own = search_best(search, k), other = search_best(search, 1 - k);
        if (own == SIZE_MAX)
            continue;
        scalar.low[k] = search_results(search, own)[k];
        const double range = search_results(search, other)[k] - scalar.low[k];
        scalar.range[k] = range > 0 ? range : 1;
    }
    return scalar;
}

static double search_scalar_value(const Search *search, const SearchScalar *scalar,
                                  size_t candidate) {
    const double *results = search_results(search, candidate);
    if (search->space.objectives == 1)
        return results[0];
    const double a = scalar->share * (results[0] - scalar->low[0]) / scalar->range[0];
    const double b = (1 - scalar->share) * (results[1] - scalar->low[1]) / scalar->range[1];
    return fmax(a, b) + 0.05 * (a + b);
}

static int search_compare(const void *a, const void *b) {
    const SearchRank *x = a, *y = b;
    if (x->violation != y->violation)
        return x->violation < y->violation ? -1 : 1;
    if (x->value != y->value)
        return x->value < y->value ? -1 : 1;
    return (x->candidate > y->candidate) - (x->candidate < y->candidate);
}

static void search_rank(Search *search) {
    SearchRank *ranks = search->model->ranks;
    const SearchScalar scalar = search_scalar(search);
    for (size_t i = 0; i < search->added; i++) {
        const double violation = search_violation(search, i);
        const bool is_failed = violation == (double)INFINITY;
        ranks[i] =
            (SearchRank){violation, is_failed ? 0 : search_scalar_value(search, &scalar, i), i};
    }
    qsort(ranks, search->added, sizeof *ranks, search_compare);
}

// --- The model ---

static size_t search_responses(const Search *search) {
    return 1 + search->space.constraints;
}

// Half of the rows are the best candidates, the rest is spread over all others; then the pending.
static void search_model_choose(Search *search) {
    SearchModel *model = search->model;
    const size_t pending = search->proposed - search->added, room = ROWS - pending, best = room / 2,
                 others = room - best;
    model->known = search->added < room ? search->added : room;
    model->rows = model->known + pending;
    for (size_t i = 0; i < model->known; i++) {
        const size_t rank = search->added <= room || i < best
                                ? i
                                : best + (i - best) * (search->added - best) / others;
        const SearchRank *own = &model->ranks[rank];
        const double *results = search_results(search, own->candidate);
        const bool is_failed = own->violation == (double)INFINITY;
        model->row[i] = own->candidate;
        for (size_t r = 0; r < search_responses(search); r++)
            model->target[r][i] = is_failed ? (double)NAN
                                  : r == 0  ? own->value
                                            : results[search->space.objectives + r - 1];
    }
    for (size_t i = 0; i < pending; i++)
        model->row[model->known + i] = search->added + i;
}

// Objectives above the median, and large distances from a constraint, are compressed: the model
// need not follow them. Then all are standardised; failed ones are as bad as the worst.
static void search_model_standardise(const Search *search, size_t response) {
    SearchModel *model = search->model;
    double *target = model->target[response], sorted[ROWS], sum = 0, squares = 0, worst = -INFINITY;
    size_t count = 0;
    for (size_t i = 0; i < model->known; i++)
        if (!isnan(target[i]))
            sorted[count++] = target[i];
    reals_sort(sorted, count);
    const double median = count > 0 ? sorted[count / 2] : 0,
                 width = count > 0 ? median - sorted[0] : 0;
    for (size_t i = 0; i < model->known; i++) {
        if (response > 0)
            target[i] = copysign(log1p(fabs(target[i])), target[i]);
        else if (width > 0 && target[i] > median)
            target[i] = median + width * log1p((target[i] - median) / width);
        if (isnan(target[i]))
            continue;
        sum += target[i];
        worst = fmax(worst, target[i]);
    }
    const double mean = count > 0 ? sum / (double)count : 0;
    for (size_t i = 0; i < model->known; i++)
        squares += isnan(target[i]) ? 0 : (target[i] - mean) * (target[i] - mean);
    const double variance = count > 0 ? squares / (double)count : 0,
                 deviation = variance > 1e-24 * mean * mean ? sqrt(variance) : 1;
    model->bound[response] = response == 0 ? (double)NAN : -mean / deviation;
    for (size_t i = 0; i < model->known; i++) {
        target[i] = count == 0 ? 0 : ((isnan(target[i]) ? worst : target[i]) - mean) / deviation;
        if (response == 0 && search_violation(search, model->row[i]) == 0)
            model->bound[0] = fmin(model->bound[0], target[i]); // ignores NAN
    }
}

static double search_kernel(const Search *search, const double *a, const double *b) {
    const SearchModel *model = search->model;
    double squares = 0;
    for (size_t j = 0; j < search->space.variables; j++) {
        const double d =
            search_difference(&search->space.variable[j], a[j], b[j]) * model->inverse[j];
        squares += d * d;
    }
    const double r = sqrt(5 * squares);
    return (1 + r + r * r / 3) * exp(-r) + model->share * exp(-r * model->scale);
}

// The kernel of a point with the first rows, and these numbers divided by the factor.
static void search_column(const Search *search, const double *point, size_t rows, double *column,
                          double *half) {
    const SearchModel *model = search->model;
    for (size_t i = 0; i < rows; i++) {
        const double *row = model->factor[i];
        double sum[4] = {0, 0, 0, 0};
        size_t k = 0;
        column[i] = search_kernel(search, point, search_point(search, model->row[i]));
        for (; k + 4 <= i; k += 4) // independent sums: four times as fast
            for (size_t l = 0; l < 4; l++)
                sum[l] += row[k + l] * half[k + l];
        for (; k < i; k++)
            sum[0] += row[k] * half[k];
        half[i] = (column[i] - ((sum[0] + sum[1]) + (sum[2] + sum[3]))) / row[i];
    }
}

// The variance that the first rows leave at a point.
static double search_variance(const SearchModel *model, size_t rows, const double *half) {
    double variance = 1 + model->share + 1e-8;
    for (size_t i = 0; i < rows; i++)
        variance -= half[i] * half[i];
    return fmax(variance, 1e-12);
}

// Factorises the matrix of the first rows.
static void search_model_factorise(Search *search, size_t rows) {
    SearchModel *model = search->model;
    const size_t n = search->space.variables;
    double column[ROWS];
    for (size_t j = 0; j < n; j++)
        model->inverse[j] = exp(-model->parameter[j]);
    model->share = exp(model->parameter[n]);
    model->scale = exp(model->parameter[n + 1]);
    for (size_t i = 0; i < rows; i++) {
        search_column(search, search_point(search, model->row[i]), i, column, model->factor[i]);
        model->factor[i][i] = sqrt(search_variance(model, i, model->factor[i]));
    }
}

// Weights K^-1 target and the spread of each response; returns the logarithm of the likelihood.
static double search_model_weigh(Search *search) {
    SearchModel *model = search->model;
    const size_t rows = model->known, responses = search_responses(search);
    double result = 0;
    for (size_t i = 0; i < rows; i++)
        result -= (double)responses * log(model->factor[i][i]);
    for (size_t r = 0; r < responses; r++) {
        double *weight = model->weight[r], squares = 0;
        for (size_t i = 0; i < rows; i++) {
            weight[i] = model->target[r][i];
            for (size_t k = 0; k < i; k++)
                weight[i] -= model->factor[i][k] * weight[k];
            weight[i] /= model->factor[i][i];
            squares += weight[i] * weight[i];
        }
        for (size_t i = rows; i-- > 0;) {
            weight[i] /= model->factor[i][i];
            for (size_t k = 0; k < i; k++)
                weight[k] -= model->factor[i][k] * weight[i];
        }
        const double variance = fmax(squares / (double)rows, 1e-12);
        model->spread[r] = sqrt(variance);
        result -= 0.5 * (double)rows * log(variance);
    }
    return result;
}

static double search_likelihood(Search *search) {
    const SearchModel *model = search->model;
    double result = 0;
    for (size_t j = 0; j < search->space.variables + 2; j++) {
        const SearchRange *range = search_range(search, j);
        const double off = (model->parameter[j] - range->mean) / range->deviation;
        if (model->parameter[j] < range->low || model->parameter[j] > range->high)
            return -INFINITY;
        result -= 0.5 * off * off;
    }
    search_model_factorise(search, model->known);
    return result + search_model_weigh(search);
}

// Improves one parameter after the other, `count` in all, by a step up or down.
static void search_model_fit(Search *search, size_t count) {
    SearchModel *model = search->model;
    double best = count > 0 ? search_likelihood(search) : 0;
    for (size_t i = 0; i < count; i++) {
        const size_t j = model->fits++ % (search->space.variables + 2);
        const double from = model->parameter[j];
        bool is_better = false;
        for (int sign = 1; sign >= -1 && !is_better; sign -= 2) {
            model->parameter[j] = from + sign * model->step[j];
            const double found = search_likelihood(search);
            is_better = found > best;
            if (is_better)
                best = found;
        }
        if (!is_better)
            model->parameter[j] = from;
        model->step[j] = fmax(0.1, fmin(model->step[j] * (is_better ? 1.4 : 0.6), 2));
    }
}

static void search_model_make(Search *search) {
    SearchModel *model = search->model;
    search_model_choose(search);
    for (size_t r = 0; r < search_responses(search); r++)
        search_model_standardise(search, r);
    // The more rows, the longer a fit takes and the less one more of them changes it.
    const size_t parameters = search->space.variables + 2;
    search_model_fit(search, model->fits == 0     ? FIRST_FITS * parameters
                             : model->known <= 60 ? parameters
                                                  : search->proposed % 4 == 0);
    search_model_factorise(search, model->rows);
    (void)search_model_weigh(search);
}

// --- The choice of a candidate ---

// Logarithm of the normal distribution, in its tail by its asymptote.
static double search_log_normal(double z) {
    return z > -6 ? log(0.5 * erfc(-z * 0.7071067811865476))
                  : -z * z / 2 - log(-z) - 0.9189385332046727;
}

// Logarithm of E[max(0, z - Z)] of a standard normal Z.
static double search_log_improvement(double z) {
    return z > -6
               ? log(z * 0.5 * erfc(-z * 0.7071067811865476) + exp(-z * z / 2) * 0.3989422804014327)
               : -z * z / 2 - 2 * log(-z) - 0.9189385332046727;
}

static double search_merit(const Search *search, const double *point) {
    const SearchModel *model = search->model;
    double column[ROWS], half[ROWS], sum = 0;
    search_column(search, point, model->rows, column, half);
    const double deviation = sqrt(search_variance(model, model->rows, half));
    for (size_t r = 0; r < search_responses(search); r++) {
        const double own = deviation * model->spread[r];
        double mean = 0;
        for (size_t i = 0; i < model->known; i++)
            mean += column[i] * model->weight[r][i];
        const double z = (model->bound[r] - mean) / own;
        if (r > 0)
            sum += search_log_normal(z);
        else if (!isnan(z))
            sum += log(own) + search_log_improvement(z);
    }
    return sum;
}

// The point at shares of 0 to 1 of all ranges.
static void search_point_at(const Search *search, const double *share, double *point) {
    for (size_t j = 0; j < search->space.variables; j++)
        point[j] = search_value(&search->space.variable[j], share[j]);
}

static double search_merit_callback(unsigned count, const double *share, double *gradient,
                                    void *context) {
    double point[SEARCH_VARIABLES];
    (void)count;
    (void)gradient;
    search_point_at(context, share, point);
    return search_merit(context, point);
}

// Maximises the merit from shares, which are changed, by steps of the given length at first.
static Status search_maximise(Search *search, double step, double *share, double *merit) {
    const unsigned n = (unsigned)search->space.variables;
    nlopt_opt optimizer = nlopt_create(NLOPT_LN_SBPLX, n);
    TRY(status_made(optimizer != NULL));
    nlopt_set_max_objective(optimizer, search_merit_callback, search);
    nlopt_set_lower_bounds1(optimizer, 0);
    nlopt_set_upper_bounds1(optimizer, 1);
    nlopt_set_initial_step1(optimizer, step);
    nlopt_set_maxeval(optimizer, (int)(15 + 10 * n));
    // NLopt ends the program where it has no memory for its message that it has none, so what it
    // needs is reserved first and returned to the allocator.
    void *reserve = malloc(OPTIMIZER_BYTES + OPTIMIZER_VARIABLE_BYTES * n * n);
    free(reserve);
    const nlopt_result result =
        reserve != NULL ? nlopt_optimize(optimizer, share, merit) : NLOPT_OUT_OF_MEMORY;
    nlopt_destroy(optimizer);
    return status_made(result != NLOPT_OUT_OF_MEMORY);
}

static bool search_is_new(const Search *search, const double *point) {
    for (size_t i = 0; i < search->proposed; i++)
        if (search_distance(search, point, search_point(search, i)) < 1e-4)
            return false;
    return true;
}

// The best maximum from several starts: the best candidates, and points anywhere.
static Status search_choose(Search *search, double *chosen) {
    const Sampling *drawing = &search->model->drawing;
    const size_t n = search->space.variables;
    double best = -INFINITY;
    for (size_t i = 0; i < STARTS; i++) {
        const size_t row = search->proposed * STARTS + i;
        double share[SEARCH_VARIABLES], point[SEARCH_VARIABLES], merit = -INFINITY;
        for (size_t j = 0; j < n; j++) {
            const double values = fmax(1, (double)search->space.variable[j].values);
            share[j] = sampling_coordinate(drawing, row, j);
            if (i % 2 == 0 && i / 2 < search->added) {
                const size_t centre = search->model->ranks[i / 2].candidate;
                share[j] = (search_point(search, centre)[j] + (values > 1 ? 0.5 : 0)) / values;
            }
        }
        const double step = pow(10, -1 - 2 * sampling_coordinate(drawing, row, n));
        TRY(search_maximise(search, step, share, &merit));
        search_point_at(search, share, point);
        if (i == 0 || (merit > best && search_is_new(search, point))) {
            best = search_is_new(search, point) ? merit : -INFINITY;
            memcpy(chosen, point, n * sizeof *chosen);
        }
    }
    return STATUS_OK;
}

// Point of the space-filling sample; all points where the space has no more.
static void search_fill(const Search *search, double *point) {
    const SearchSpace *space = &search->space;
    const bool is_listed = search_space_points(space) == space->candidates;
    size_t rest = search->proposed;
    for (size_t j = 0; j < space->variables; j++) {
        const SearchVariable *variable = &space->variable[j];
        point[j] = is_listed ? (double)(rest % variable->values)
                             : search_value(variable, sampling_coordinate(&search->model->filling,
                                                                          search->proposed, j));
        rest /= is_listed ? variable->values : 1;
    }
}

// A point anywhere in the box around the best quarter of the sample: where the jumps are larger
// than the slope, the model knows no better place.
static void search_scatter(const Search *search, double *point) {
    const SearchRank *ranks = search->model->ranks;
    for (size_t j = 0; j < search->space.variables; j++) {
        const bool is_real = search->space.variable[j].values == 0;
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0, found = 0; i < search->added && found < search->sample / 4; i++) {
            if (ranks[i].candidate >= search->sample)
                continue;
            low = fmin(low, search_point(search, ranks[i].candidate)[j]);
            high = fmax(high, search_point(search, ranks[i].candidate)[j]);
            found++;
        }
        const double u = sampling_coordinate(&search->model->filling, search->proposed, j);
        point[j] = is_real ? low + u * (high - low) : floor(low + u * (high - low + 1));
    }
}

Status search_propose(Search *search) {
    double *point = search->points + search->proposed * search->space.variables;
    if (search->proposed < search->sample) {
        search_fill(search, point);
    } else {
        const bool is_scattered = search->proposed % SCATTER == 0;
        search_rank(search);
        if (is_scattered)
            search_scatter(search, point);
        if (!is_scattered || !search_is_new(search, point)) {
            search_model_make(search);
            TRY(search_choose(search, point));
        }
    }
    search->proposed++;
    return STATUS_OK;
}
