// Efficient global optimisation (Jones, Schonlau and Welch 1998). A Gaussian process with a Matern
// 5/2 kernel, one length for each variable and independent noise models the objective and every
// constraint; the noise stands for the jumps that impacts cause. Objective and constraints share
// one matrix, hence the lengths and the noise, which maximise the likelihood of all. The next
// candidate has the largest
//
//     log of expected improvement on the best feasible candidate + log of the probability that the
//     constraints hold (Schonlau 1997)
//
// Two objectives are reduced to one by weights that differ from candidate to candidate (Knowles
// 2006, "ParEGO"): max(w a, (1 - w) b) + 0.05 (w a + (1 - w) b) of the objectives scaled to 0 to 1.
//
// The first candidates fill the space, a Sobol sequence. Candidates without results are believed to
// be as predicted (Ginsbourger, Le Riche and Carraro 2010).
#include "core/study/search.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/study/inputs.h"

enum {
    ROWS = 160, // of the model at most
    RESULTS = SEARCH_OBJECTIVES + SEARCH_CONSTRAINTS,
    RESPONSES = 1 + SEARCH_CONSTRAINTS, // modelled: an objective and the constraints
    PARAMETERS = SEARCH_VARIABLES + 2,  // logarithms of lengths, share and scale of the roughness
    CENTRES = 4,                        // candidates around which others are tried
    FIRST_FITS = 8,
    ROWS_PER_FIT = 40,
};

static const double log_length_min = -3.5, log_length_max = 2.5, log_noise_min = -14,
                    log_noise_max = 0;

typedef struct SearchModel {
    size_t rows;
    size_t row[ROWS];               // candidates
    double factor[ROWS][ROWS];      // lower triangle, Cholesky
    double target[RESPONSES][ROWS]; // standardised
    double weight[RESPONSES][ROWS]; // K^-1 target
    double mean[RESPONSES], deviation[RESPONSES];
    double spread[RESPONSES]; // sqrt of the process's variance, of standardised targets
    double best;              // feasible and standardised; NAN: none
    double bend, width;       // of the objective's transformation
    double widths[RESPONSES];
} SearchModel;

struct Search {
    SearchSpace space;
    size_t proposed, added, sample;
    bool is_listed; // every point is a candidate
    Sampling filling;
    double *points; // candidate by candidate
    double *results;
    double parameter[PARAMETERS], step[PARAMETERS];
    size_t fits;
    SearchModel model, trial;
};

static size_t search_result_count(const Search *search) {
    return search->space.objectives + search->space.constraints;
}

const double *search_point(const Search *search, size_t candidate) {
    return search->points + candidate * search->space.variables;
}

const double *search_results(const Search *search, size_t candidate) {
    return search->results + candidate * search_result_count(search);
}

size_t search_added(const Search *search) {
    return search->added;
}

size_t search_candidates(const Search *search) {
    return search->space.candidates;
}

size_t search_proposed(const Search *search) {
    return search->proposed;
}

size_t search_sample(const Search *search) {
    return search->sample;
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

Status search_new(const SearchSpace *space, Search **made) {
    Search *search = *made = calloc(1, sizeof *search);
    TRY(status_made(search != NULL));
    search->space = *space;
    const size_t points = search_space_points(space);
    if (points < space->candidates)
        search->space.candidates = points;
    const size_t candidates = search->space.candidates, n = space->variables;
    search->is_listed = points <= space->candidates;
    size_t sample = candidates * 3 / 10;
    sample = sample < 2 * n + 4 ? 2 * n + 4 : sample;
    sample = sample > 10 * n + 10 ? 10 * n + 10 : sample;
    search->sample = search->is_listed || sample > candidates ? candidates : sample;
    search->points = calloc(candidates * n, sizeof *search->points);
    search->results = calloc(candidates * search_result_count(search), sizeof *search->results);
    for (size_t j = 0; j < PARAMETERS; j++)
        search->step[j] = 0.7;
    for (size_t j = 0; j < n; j++)
        search->parameter[j] = log(0.4);
    search->parameter[n] = log(1e-2);
    search->parameter[n + 1] = 2.5;
    if (search->points != NULL && search->results != NULL &&
        sampling_make(SAMPLING_SOBOL, space->seed, candidates, n, &search->filling) == STATUS_OK)
        return STATUS_OK;
    search_free(search);
    *made = NULL;
    return STATUS_NO_MEMORY;
}

void search_free(Search *search) {
    if (search == NULL)
        return;
    sampling_clear(&search->filling);
    free(search->points);
    free(search->results);
    free(search);
}

void search_add(Search *search, const double *results) {
    const size_t count = search_result_count(search);
    memcpy(search->results + search->added++ * count, results, count * sizeof *results);
}

double search_violation(const Search *search, size_t candidate) {
    const double *results = search_results(search, candidate);
    double violation = 0;
    for (size_t i = 0; i < search_result_count(search); i++) {
        if (isnan(results[i]))
            return INFINITY;
        if (i >= search->space.objectives)
            violation = fmax(violation, results[i]);
    }
    return violation;
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

// Uniform in 0 to 1.
static double search_uniform(const Search *search, size_t draw) {
    const uint64_t seed = search->space.seed;
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    const uint32_t counter[4] = {(uint32_t)(draw / 4), (uint32_t)search->proposed, 0x5ea4c4u, 0};
    uint32_t words[4];
    philox_words(counter, key, words);
    return ((double)words[draw % 4] + 0.5) / 0x1p32;
}

// The value of a variable at a share of 0 to 1.
static double search_value(const SearchVariable *variable, double share) {
    return variable->values == 0
               ? share
               : fmin(floor(share * (double)variable->values), (double)(variable->values - 1));
}

// Point of the space-filling sample; all points where the space has no more.
static void search_fill(const Search *search, double *point) {
    const SearchSpace *space = &search->space;
    size_t rest = search->proposed;
    for (size_t j = 0; j < space->variables; j++) {
        const size_t values = space->variable[j].values;
        if (search->is_listed) {
            point[j] = (double)(rest % values);
            rest /= values;
        } else {
            point[j] = search_value(&space->variable[j],
                                    sampling_coordinate(&search->filling, search->proposed, j));
        }
    }
}

// Difference of two values of a variable, in units in which the whole range is 1.
static double search_difference(const SearchVariable *variable, double a, double b) {
    if (variable->values == 0)
        return a - b;
    if (!variable->is_ordered)
        return a != b;
    return variable->values > 1 ? (a - b) / (double)(variable->values - 1) : 0;
}

typedef struct SearchKernel {
    double inverse[SEARCH_VARIABLES]; // of the lengths
    double share, scale;              // of the rough part
} SearchKernel;

static double search_kernel(const SearchSpace *space, const SearchKernel *kernel, const double *a,
                            const double *b) {
    double squares = 0;
    for (size_t j = 0; j < space->variables; j++) {
        const double d = search_difference(&space->variable[j], a[j], b[j]) * kernel->inverse[j];
        squares += d * d;
    }
    const double r = sqrt(5 * squares);
    return (1 + r + r * r / 3) * exp(-r) + kernel->share * exp(-r * kernel->scale);
}

static void search_kernel_set(const Search *search, const double *parameter, SearchKernel *kernel) {
    const size_t n = search->space.variables;
    for (size_t j = 0; j < n; j++)
        kernel->inverse[j] = exp(-parameter[j]);
    kernel->share = exp(parameter[n]);
    kernel->scale = exp(parameter[n + 1]);
}

// Solves L x = b.
static void search_solve_lower(const SearchModel *model, const double *b, double *x) {
    for (size_t i = 0; i < model->rows; i++) {
        double sum0 = 0, sum1 = 0, sum2 = 0, sum3 = 0;
        const double *row = model->factor[i];
        size_t k = 0;
        for (; k + 4 <= i; k += 4) {
            sum0 += row[k] * x[k];
            sum1 += row[k + 1] * x[k + 1];
            sum2 += row[k + 2] * x[k + 2];
            sum3 += row[k + 3] * x[k + 3];
        }
        for (; k < i; k++)
            sum0 += row[k] * x[k];
        x[i] = (b[i] - ((sum0 + sum1) + (sum2 + sum3))) / row[i];
    }
}

// Factorises the matrix row by row; the first ones are `factorised`. False: it is not definite.
static bool search_model_factorise(const Search *search, SearchModel *model,
                                   const double *parameter, size_t factorised) {
    const size_t rows = model->rows;
    double column[ROWS];
    SearchKernel kernel;
    search_kernel_set(search, parameter, &kernel);
    for (size_t i = factorised; i < rows; i++) {
        const double *point = search_point(search, model->row[i]);
        for (size_t k = 0; k < i; k++)
            column[k] =
                search_kernel(&search->space, &kernel, point, search_point(search, model->row[k]));
        model->rows = i;
        search_solve_lower(model, column, model->factor[i]);
        model->rows = rows;
        double left = 1 + kernel.share + 1e-8;
        for (size_t k = 0; k < i; k++)
            left -= model->factor[i][k] * model->factor[i][k];
        if (!(left > 1e-12))
            return false;
        model->factor[i][i] = sqrt(left);
    }
    return true;
}

static size_t search_responses(const Search *search) {
    return 1 + search->space.constraints;
}

// Weights K^-1 target and the spread of each response; returns the logarithm of the likelihood.
static double search_model_weigh(const Search *search, SearchModel *model) {
    const size_t rows = model->rows, responses = search_responses(search);
    double half[ROWS], result = 0;
    for (size_t r = 0; r < responses; r++) {
        double *weight = model->weight[r], squares = 0;
        search_solve_lower(model, model->target[r], half);
        for (size_t i = 0; i < rows; i++)
            squares += half[i] * half[i];
        const double variance = fmax(squares / (double)rows, 1e-12);
        model->spread[r] = sqrt(variance);
        memcpy(weight, half, rows * sizeof *weight);
        for (size_t i = rows; i-- > 0;) {
            weight[i] /= model->factor[i][i];
            for (size_t k = 0; k < i; k++)
                weight[k] -= model->factor[i][k] * weight[i];
        }
        result -= 0.5 * (double)rows * log(variance);
    }
    for (size_t i = 0; i < rows; i++)
        result -= (double)responses * log(model->factor[i][i]);
    return result;
}

static double search_likelihood(Search *search, const double *parameter) {
    const size_t n = search->space.variables;
    SearchModel *trial = &search->trial;
    double result = 0;
    for (size_t j = 0; j < n; j++) {
        const double off = (parameter[j] - log(0.4)) / 1.5;
        result -= 0.5 * off * off;
        if (parameter[j] < log_length_min || parameter[j] > log_length_max)
            return -INFINITY;
    }
    if (parameter[n] < log_noise_min || parameter[n] > log_noise_max || parameter[n + 1] < 0.7 ||
        parameter[n + 1] > 6)
        return -INFINITY;
    const double off = parameter[n + 1] - 2.5;
    result -= 0.5 * off * off;
    if (!search_model_factorise(search, trial, parameter, 0))
        return -INFINITY;
    return result + search_model_weigh(search, trial);
}

// Improves one parameter after the other, `count` in all, by a step up or down.
static void search_fit(Search *search, size_t count) {
    const size_t parameters = search->space.variables + 2;
    SearchModel *trial = &search->trial;
    trial->rows = search->model.rows;
    memcpy(trial->row, search->model.row, sizeof trial->row);
    memcpy(trial->target, search->model.target, sizeof trial->target);
    double best = count > 0 ? search_likelihood(search, search->parameter) : 0;
    for (size_t i = 0; i < count; i++) {
        const size_t j = search->fits++ % parameters;
        const double from = search->parameter[j];
        bool is_better = false;
        for (int sign = 1; sign >= -1 && !is_better; sign -= 2) {
            search->parameter[j] = from + sign * search->step[j];
            const double found = search_likelihood(search, search->parameter);
            is_better = found > best;
            if (is_better)
                best = found;
        }
        if (!is_better)
            search->parameter[j] = from;
        search->step[j] = fmax(0.1, fmin(search->step[j] * (is_better ? 1.4 : 0.6), 2));
    }
}

// One number that stands for the objectives under the weights of the next candidate.
typedef struct SearchScale {
    double low[SEARCH_OBJECTIVES], range[SEARCH_OBJECTIVES], share;
} SearchScale;

// From the best value of each objective to that which it has where the other one is best.
static SearchScale search_scale(const Search *search) {
    SearchScale scale = {{0, 0}, {1, 1}, 0};
    double whole;
    scale.share = modf((double)search->proposed * 0.6180339887498949, &whole);
    for (size_t k = 0; k < search->space.objectives && search->space.objectives > 1; k++) {
        const size_t own = search_best(search, k), other = search_best(search, 1 - k);
        if (own == SIZE_MAX)
            continue;
        scale.low[k] = search_results(search, own)[k];
        const double range = search_results(search, other)[k] - scale.low[k];
        scale.range[k] = range > 0 ? range : 1;
    }
    return scale;
}

static double search_scalar(const Search *search, const SearchScale *scale, size_t candidate) {
    const double *results = search_results(search, candidate);
    if (search->space.objectives == 1)
        return results[0];
    const double a = scale->share * (results[0] - scale->low[0]) / scale->range[0];
    const double b = (1 - scale->share) * (results[1] - scale->low[1]) / scale->range[1];
    return fmax(a, b) + 0.05 * (a + b);
}

// A candidate in the order of merit: feasible ones first.
typedef struct SearchRank {
    double violation, value;
    size_t candidate;
} SearchRank;

static int search_compare(const void *a, const void *b) {
    const SearchRank *x = a, *y = b;
    if (x->violation != y->violation)
        return x->violation < y->violation ? -1 : 1;
    if (x->value != y->value && !(isnan(x->value) && isnan(y->value)))
        return x->value < y->value || isnan(y->value) ? -1 : 1;
    return (x->candidate > y->candidate) - (x->candidate < y->candidate);
}

static Status search_rank(const Search *search, const SearchScale *scale, SearchRank **made) {
    SearchRank *ranks = *made = calloc(search->added + 1, sizeof *ranks);
    TRY(status_made(ranks != NULL));
    for (size_t i = 0; i < search->added; i++)
        ranks[i] = (SearchRank){search_violation(search, i), search_scalar(search, scale, i), i};
    qsort(ranks, search->added, sizeof *ranks, search_compare);
    return STATUS_OK;
}

// Large values of an objective, and large distances from a constraint, are compressed: the model
// need not follow them.
static double search_transform(const SearchModel *model, size_t response, double value) {
    const double width = model->widths[response];
    if (response == 0)
        return value > model->bend ? model->bend + width * log1p((value - model->bend) / width)
                                   : value;
    return width * asinh(value / width);
}

static int search_compare_reals(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Fills the targets of the rows with results, standardised. Failed ones are as bad as the worst.
static void search_model_targets(Search *search, const SearchScale *scale, size_t rows) {
    SearchModel *model = &search->model;
    for (size_t r = 0; r < search_responses(search); r++) {
        double *target = model->target[r], sorted[ROWS], sum = 0, squares = 0;
        size_t known = 0;
        for (size_t i = 0; i < rows; i++) {
            const size_t candidate = model->row[i];
            target[i] = search_violation(search, candidate) == INFINITY ? (double)NAN
                        : r == 0
                            ? search_scalar(search, scale, candidate)
                            : search_results(search, candidate)[search->space.objectives + r - 1];
            if (!isnan(target[i]))
                sorted[known++] = r == 0 ? target[i] : fabs(target[i]);
        }
        qsort(sorted, known, sizeof *sorted, search_compare_reals);
        const double median = known > 0 ? sorted[known / 2] : 0;
        const double width = known == 0 ? 1 : r == 0 ? median - sorted[0] : median;
        model->widths[r] = width > 0 ? width : 1;
        if (r == 0)
            model->bend = median;
        double worst = -INFINITY;
        for (size_t i = 0; i < rows; i++)
            worst = fmax(worst, target[i] = search_transform(model, r, target[i]));
        for (size_t i = 0; i < rows; i++) {
            if (isnan(target[i]))
                target[i] = isfinite(worst) ? worst : 0;
            sum += target[i] / (double)rows;
        }
        for (size_t i = 0; i < rows; i++)
            squares += (target[i] - sum) * (target[i] - sum) / (double)rows;
        model->mean[r] = sum;
        model->deviation[r] = squares > 0 ? sqrt(squares) : 1;
        for (size_t i = 0; i < rows; i++)
            target[i] = (target[i] - sum) / model->deviation[r];
    }
}

// A prediction, standardised; deviations are those of a new candidate, noise included.
typedef struct SearchPrediction {
    double mean[RESPONSES], deviation;
} SearchPrediction;

static void search_predict(const Search *search, const SearchKernel *kernel, const double *point,
                           bool has_deviation, SearchPrediction *prediction) {
    const SearchModel *model = &search->model;
    double column[ROWS], half[ROWS];
    for (size_t i = 0; i < model->rows; i++)
        column[i] =
            search_kernel(&search->space, kernel, point, search_point(search, model->row[i]));
    for (size_t r = 0; r < search_responses(search); r++) {
        double sum = 0;
        for (size_t i = 0; i < model->rows; i++)
            sum += column[i] * model->weight[r][i];
        prediction->mean[r] = sum;
    }
    if (!has_deviation)
        return;
    double left = 1 + kernel->share;
    search_solve_lower(model, column, half);
    for (size_t i = 0; i < model->rows; i++)
        left -= half[i] * half[i];
    prediction->deviation = sqrt(fmax(left, 1e-12));
}

// Half of the rows are the best candidates, the rest is spread over all others.
static Status search_model_choose(Search *search, const SearchScale *scale) {
    SearchModel *model = &search->model;
    const size_t pending = search->proposed - search->added, room = ROWS - pending;
    model->rows = 0;
    if (search->added <= room) {
        for (size_t i = 0; i < search->added; i++)
            model->row[model->rows++] = i;
        return STATUS_OK;
    }
    SearchRank *ranks;
    TRY(search_rank(search, scale, &ranks));
    const size_t best = room / 2, others = room - best;
    for (size_t i = 0; i < best; i++)
        model->row[model->rows++] = ranks[i].candidate;
    for (size_t i = 0; i < others; i++)
        model->row[model->rows++] = ranks[best + i * (search->added - best) / others].candidate;
    free(ranks);
    return STATUS_OK;
}

// The model of all candidates with results; those without are believed.
static Status search_model_make(Search *search, const SearchScale *scale, size_t fits) {
    SearchModel *model = &search->model;
    SearchKernel kernel;
    TRY(search_model_choose(search, scale));
    search_model_targets(search, scale, model->rows);
    search_fit(search, fits);
    search_kernel_set(search, search->parameter, &kernel);
    model->best = (double)NAN;
    for (size_t i = 0; i < model->rows; i++)
        if (search_violation(search, model->row[i]) == 0)
            model->best = fmin(model->best, model->target[0][i]); // fmin ignores NAN
    if (!search_model_factorise(search, model, search->parameter, 0))
        return STATUS_OK;
    (void)search_model_weigh(search, model);
    const size_t known = model->rows, pending = search->proposed - search->added;
    for (size_t i = 0; i < pending; i++) {
        SearchPrediction prediction;
        model->row[known + i] = search->added + i;
        search_predict(search, &kernel, search_point(search, search->added + i), false,
                       &prediction);
        for (size_t r = 0; r < search_responses(search); r++)
            model->target[r][known + i] = prediction.mean[r];
    }
    model->rows += pending;
    if (pending > 0 && search_model_factorise(search, model, search->parameter, known))
        (void)search_model_weigh(search, model);
    return STATUS_OK;
}

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

typedef struct SearchMerit {
    const Search *search;
    SearchKernel kernel;
    const double *point; // whose choices are kept
    size_t evaluations;
} SearchMerit;

static double search_merit(const SearchMerit *merit, const double *point) {
    const SearchModel *model = &merit->search->model;
    SearchPrediction prediction;
    search_predict(merit->search, &merit->kernel, point, true, &prediction);
    double sum = 0;
    if (!isnan(model->best)) {
        const double deviation = prediction.deviation * model->spread[0];
        sum =
            log(deviation) + search_log_improvement((model->best - prediction.mean[0]) / deviation);
    }
    for (size_t r = 1; r < search_responses(merit->search); r++) {
        const double bound = -model->mean[r] / model->deviation[r];
        sum += search_log_normal((bound - prediction.mean[r]) /
                                 (prediction.deviation * model->spread[r]));
    }
    return sum;
}

// For NLopt, whose variables are the real ones of the point.
static double search_merit_callback(unsigned count, const double *x, double *gradient,
                                    void *context) {
    SearchMerit *merit = context;
    const SearchSpace *space = &merit->search->space;
    double point[SEARCH_VARIABLES];
    (void)count;
    (void)gradient;
    merit->evaluations++;
    for (size_t j = 0, k = 0; j < space->variables; j++)
        point[j] = space->variable[j].values == 0 ? x[k++] : merit->point[j];
    return search_merit(merit, point);
}

// Maximises the merit over the real variables, from `point`, which is changed.
static Status search_polish(SearchMerit *merit, double *point, double *value) {
    const SearchSpace *space = &merit->search->space;
    double x[SEARCH_VARIABLES];
    unsigned count = 0;
    for (size_t j = 0; j < space->variables; j++)
        if (space->variable[j].values == 0)
            x[count++] = point[j];
    if (count == 0)
        return STATUS_OK;
    nlopt_opt optimizer = nlopt_create(NLOPT_LN_SBPLX, count);
    TRY(status_made(optimizer != NULL));
    merit->point = point;
    nlopt_set_max_objective(optimizer, search_merit_callback, merit);
    nlopt_set_lower_bounds1(optimizer, 0);
    nlopt_set_upper_bounds1(optimizer, 1);
    nlopt_set_initial_step1(optimizer, 0.02);
    nlopt_set_maxeval(optimizer, (int)(15 + 10 * count));
    double found;
    const nlopt_result result = nlopt_optimize(optimizer, x, &found);
    nlopt_destroy(optimizer);
    TRY(status_made(result != NLOPT_OUT_OF_MEMORY));
    if (result < 0 && result != NLOPT_ROUNDOFF_LIMITED)
        return STATUS_OK;
    for (size_t j = 0, k = 0; j < space->variables; j++)
        if (space->variable[j].values == 0)
            point[j] = x[k++];
    *value = found;
    return STATUS_OK;
}

static bool search_is_new(const Search *search, const double *point) {
    const size_t n = search->space.variables;
    for (size_t i = 0; i < search->proposed; i++) {
        double largest = 0;
        for (size_t j = 0; j < n; j++)
            largest = fmax(largest, fabs(search_difference(&search->space.variable[j], point[j],
                                                           search_point(search, i)[j])));
        if (largest < 1e-6)
            return false;
    }
    return true;
}

// A point around `centre`, or anywhere if that is NULL.
static size_t search_draw(const Search *search, const double *centre, size_t draw, double *point) {
    static const double steps[] = {0.3, 0.1, 0.03, 0.01, 0.003};
    const SearchSpace *space = &search->space;
    const size_t n = space->variables;
    const double step = steps[(size_t)(search_uniform(search, draw++) * COUNT(steps))];
    const size_t always = (size_t)(search_uniform(search, draw++) * (double)n);
    const double share = n > 3 ? 3 / (double)n : 1;
    for (size_t j = 0; j < n; j++) {
        const SearchVariable *variable = &space->variable[j];
        const double is_changed = search_uniform(search, draw++),
                     u = search_uniform(search, draw++);
        if (centre == NULL) {
            point[j] = search_value(variable, u);
            continue;
        }
        point[j] = centre[j];
        if (j != always && is_changed > share)
            continue;
        if (variable->values > 0 && !variable->is_ordered) {
            if (j == always || is_changed < 0.3)
                point[j] = search_value(variable, u);
            continue;
        }
        const double length = variable->values == 0 ? 1 : (double)variable->values - 1;
        double moved = centre[j] / fmax(length, 1) + step * (2 * u - 1);
        moved = moved < 0 ? -moved : moved > 1 ? 2 - moved : moved;
        point[j] = variable->values == 0 ? moved : nearbyint(moved * length);
    }
    return draw;
}

static Status search_choose(Search *search, const SearchScale *scale, double *chosen) {
    const size_t n = search->space.variables, tries = 60 + 30 * n;
    SearchMerit merit = {.search = search};
    SearchRank *ranks;
    double best = -INFINITY, second = -INFINITY, other[SEARCH_VARIABLES];
    bool is_found = false;
    size_t draw = 0;
    search_kernel_set(search, search->parameter, &merit.kernel);
    TRY(search_rank(search, scale, &ranks));
    const size_t centres = search->added < CENTRES ? search->added : CENTRES;
    for (size_t i = 0; i < tries || (!is_found && i < 4 * tries); i++) {
        double point[SEARCH_VARIABLES];
        const double *centre =
            i % 3 == 0 || centres == 0 ? NULL : search_point(search, ranks[i % centres].candidate);
        draw = search_draw(search, centre, draw, point);
        if (!search_is_new(search, point))
            continue;
        const double value = search_merit(&merit, point);
        if (!is_found || value > best) {
            second = best;
            memcpy(other, chosen, n * sizeof *other);
            best = value;
            memcpy(chosen, point, n * sizeof *chosen);
            is_found = true;
        } else if (value > second) {
            second = value;
            memcpy(other, point, n * sizeof *other);
        }
    }
    free(ranks);
    double *const starts[] = {chosen, other};
    double *const values[] = {&best, &second};
    for (size_t i = 0; i < 2; i++) {
        double point[SEARCH_VARIABLES], value = -INFINITY;
        if (*values[i] == -INFINITY)
            continue;
        memcpy(point, starts[i], n * sizeof *point);
        TRY(search_polish(&merit, point, &value));
        if (value > best && search_is_new(search, point)) {
            best = value;
            memcpy(chosen, point, n * sizeof *chosen);
        }
    }
    return STATUS_OK;
}

Status search_propose(Search *search) {
    const size_t n = search->space.variables;
    double *point = search->points + search->proposed * n;
    if (search->proposed < search->sample) {
        search_fill(search, point);
    } else {
        const SearchScale scale = search_scale(search);
        // The more rows, the longer a fit takes and the less one more of them changes it.
        const size_t every = 1 + search->added / ROWS_PER_FIT;
        const size_t fits = search->fits == 0 ? (size_t)FIRST_FITS * (n + 2)
                                              : (size_t)(search->proposed % every == 0);
        TRY(search_model_make(search, &scale, fits));
        TRY(search_choose(search, &scale, point));
    }
    search->proposed++;
    return STATUS_OK;
}

double search_distance(const Search *search, size_t a, size_t b) {
    double largest = 0;
    for (size_t j = 0; j < search->space.variables; j++)
        largest = fmax(
            largest, fabs(search_difference(&search->space.variable[j], search_point(search, a)[j],
                                            search_point(search, b)[j])));
    return largest;
}

// The region around a candidate along one variable.
typedef struct SearchLine {
    const Search *search;
    SearchKernel kernel;
    double point[SEARCH_VARIABLES], bounds[RESPONSES]; // of predictions within the region
    size_t variable;
    double centre;
} SearchLine;

static bool search_line_is_inside(SearchLine *line, double value) {
    SearchPrediction prediction;
    line->point[line->variable] = value;
    search_predict(line->search, &line->kernel, line->point, false, &prediction);
    for (size_t r = 0; r < search_responses(line->search); r++)
        if (!(prediction.mean[r] <= line->bounds[r]))
            return false;
    return true;
}

// The end of the region below (sign -1) or above the centre: the first of so many steps that leaves
// it, then by bisection.
static double search_line_end(SearchLine *line, int sign) {
    enum { STEPS = 64, HALVINGS = 12 };
    const size_t values = line->search->space.variable[line->variable].values;
    const double end = sign < 0 ? 0 : values > 0 ? (double)(values - 1) : 1;
    double inside = line->centre, outside = (double)NAN;
    for (size_t i = 1; isnan(outside) && inside != end && (values > 0 || i <= STEPS); i++) {
        const double next = values > 0   ? inside + sign
                            : i == STEPS ? end
                                         : line->centre + (end - line->centre) * (double)i / STEPS;
        if (search_line_is_inside(line, next))
            inside = next;
        else
            outside = next;
    }
    for (int i = 0; i < HALVINGS && !isnan(outside) && values == 0; i++) {
        const double middle = (inside + outside) / 2;
        if (search_line_is_inside(line, middle))
            inside = middle;
        else
            outside = middle;
    }
    return inside;
}

Status search_region(Search *search, size_t candidate, size_t variable, double tolerance,
                     double *low, double *high) {
    const SearchVariable *of = &search->space.variable[variable];
    const SearchScale scale = search_scale(search);
    const SearchModel *model = &search->model;
    *low = *high = (double)NAN;
    if (of->values > 0 && !of->is_ordered)
        return STATUS_OK;
    TRY(search_model_make(search, &scale, 0));
    SearchLine line = {.search = search, .variable = variable};
    SearchPrediction prediction;
    search_kernel_set(search, search->parameter, &line.kernel);
    memcpy(line.point, search_point(search, candidate),
           search->space.variables * sizeof *line.point);
    line.centre = line.point[variable];
    search_predict(search, &line.kernel, line.point, false, &prediction);
    const double value = search_results(search, candidate)[0];
    line.bounds[0] = prediction.mean[0] + (search_transform(model, 0, value + tolerance) -
                                           search_transform(model, 0, value)) /
                                              model->deviation[0];
    for (size_t r = 1; r < search_responses(search); r++)
        line.bounds[r] = fmax(prediction.mean[r], -model->mean[r] / model->deviation[r]);
    *low = search_line_end(&line, -1);
    *high = search_line_end(&line, 1);
    return STATUS_OK;
}
