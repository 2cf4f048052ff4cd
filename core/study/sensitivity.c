// Three groups of results: closed forms of the contact parameters, central differences of the
// response by each parameter, and runs with restitution and contact time drawn at random.
//
// In a chaotic motion a statistic of one run has no derivative that a step could find: the smaller
// the step, the larger the quotient of differences that exist anyway. Three steps, each half of the
// one before, detect this: only where their quotients agree there is a slope.
//
// Every change starts from the numbers of the original scene, so that changes are independent.
#include "core/study/sensitivity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/philox.h"
#include "core/contact/identification.h"

enum { RUNS_MAX = 2000, RUNS_DEFAULT = 200, DEVIATIONS_MAX = 1000 };
enum { BUFFERS = SENSITIVITY_BUFFERS, DRAWS_MAX = 64, STREAM = 0x53454e53 };

const char *const sensitivity_parameter_names[] = {
    "restitution", "contact_time", "stiffness", "damping", "mass", "clearance", NULL};

Buffer *perturbation_buffer(const Dampers *dampers, size_t buffer) {
    Damper *damper = &dampers->at[buffer / BUFFERS];
    Buffer *const buffers[BUFFERS] = {&damper->buffer, &damper->left_buffer, &damper->right_buffer};
    return buffers[buffer % BUFFERS];
}

// The numbers of a parameter in one buffer and the rows of its table, or in its damper, from 0;
// NULL beyond the last.
static double *perturbation_number(const Dampers *dampers, size_t buffer, int parameter,
                                   size_t index) {
    static const size_t offsets[] = {
        [SENSITIVITY_RESTITUTION] = offsetof(Buffer, restitution),
        [SENSITIVITY_CONTACT_TIME] = offsetof(Buffer, contact_time),
        [SENSITIVITY_STIFFNESS] = offsetof(Buffer, stiffness),
        [SENSITIVITY_DAMPING] = offsetof(Buffer, damping),
        [SENSITIVITY_MASS] = offsetof(Damper, mass),
        [SENSITIVITY_CLEARANCE] = offsetof(Damper, clearance),
    };
    Buffer *of = perturbation_buffer(dampers, buffer);
    Damper *damper = &dampers->at[buffer / BUFFERS];
    const bool is_dampers = parameter >= SENSITIVITY_MASS;
    if (index == 0 && !(is_dampers && buffer % BUFFERS > 0))
        return (double *)(void *)((is_dampers ? (char *)damper : (char *)of) + offsets[parameter]);
    if (parameter > SENSITIVITY_CONTACT_TIME || index > of->table.count)
        return NULL;
    ContactRow *row = &of->table.at[index - 1];
    return parameter == SENSITIVITY_RESTITUTION ? &row->restitution : &row->contact_time;
}

double perturbation_buffer_max(const Dampers *dampers, size_t buffer, int parameter) {
    double max = (double)NAN;
    const double *number;
    for (size_t i = 0; (number = perturbation_number(dampers, buffer, parameter, i)) != NULL; i++)
        max = fmax(max, *number);
    return max;
}

// The same of the scene.
static double perturbation_max(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    double max = (double)NAN;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++)
        max = fmax(max, perturbation_buffer_max(dampers, i, parameter));
    return max;
}

const char *perturbation_refuse(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    const ContactLaw *law = dampers_contact_law(dampers, scene_contact(&simulation->scene));
    const double max = perturbation_max(simulation, parameter);
    if (isnan(max))
        return "no buffer of the scene has it, or the contact model does not use it";
    if (!(max > 0))
        return "it is 0, which has no relative change";
    // A law without loss has the restitution 1 and no other.
    if (parameter == SENSITIVITY_RESTITUTION && law->form == CONTACT_POWER && law->factor == NULL)
        return "the contact model gives all energy back";
    for (size_t i = 0; i < dampers->count && parameter == SENSITIVITY_CLEARANCE; i++)
        if (fabs(dampers->at[i].position) * 2 * (1 + 1e-9) >= dampers->at[i].clearance)
            return "a free mass starts at a stop, which a smaller one would move past it";
    return NULL;
}

double perturbation_max_step(const Simulation *simulation, int parameter, double step) {
    return parameter == SENSITIVITY_RESTITUTION
               ? fmax(0, fmin(step, 1 / perturbation_max(simulation, parameter) - 1))
               : step;
}

void perturbation_scale(const Dampers *from, size_t buffer, int parameter, double factor,
                        Dampers *to) {
    const double max = parameter == SENSITIVITY_RESTITUTION ? 1 : (double)INFINITY;
    const double *number;
    for (size_t i = 0; (number = perturbation_number(from, buffer, parameter, i)) != NULL; i++)
        *perturbation_number(to, buffer, parameter, i) =
            *number * factor > max ? max : *number * factor; // NAN remains
}

void perturbation_apply(const Simulation *simulation, int parameter, double factor,
                        Simulation *target) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++)
        perturbation_scale(dampers, i, parameter, factor, &target->scene.dampers);
}

double perturbation_factor(double normal, double s) {
    const double variance = log1p(s * s);
    return exp(sqrt(variance) * normal - variance / 2);
}

// Draws the factors of restitution and contact time of one buffer, whose largest restitution is
// `max`.
static void perturbation_draw_factors(uint64_t seed, uint64_t run, size_t buffer, double max,
                                      const double deviation[2], double factor[2]) {
    for (uint64_t again = 0; again < DRAWS_MAX; again++) {
        double normal[2];
        philox_normal_pair(seed, STREAM + buffer, DRAWS_MAX * run + again, normal);
        factor[0] = perturbation_factor(normal[0], deviation[0]);
        if (again == 0)
            factor[1] = perturbation_factor(normal[1], deviation[1]);
        if (!(max * factor[0] > 1))
            return;
    }
    factor[0] = 1 / max; // very rare: the restitution becomes 1
}

Status perturbation_draw(const InputUncertainty *uncertainty, uint64_t seed,
                         const Simulation *simulation, uint64_t run, Simulation *target,
                         Reals *restitution, Reals *contact_time) {
    const Dampers *dampers = &simulation->scene.dampers;
    size_t drawn = 0;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        double deviation[2], factor[2];
        if (!buffer_is_given(perturbation_buffer(dampers, i)))
            continue;
        for (int parameter = 0; parameter < 2; parameter++)
            deviation[parameter] = uncertainty_find(uncertainty, i / BUFFERS,
                                                    (SensitivityBuffer)(i % BUFFERS), parameter);
        perturbation_draw_factors(seed, run, drawn++,
                                  perturbation_buffer_max(dampers, i, SENSITIVITY_RESTITUTION),
                                  deviation, factor);
        for (int parameter = 0; parameter < 2; parameter++)
            if (deviation[parameter] > 0)
                perturbation_scale(dampers, i, parameter, factor[parameter],
                                   &target->scene.dampers);
        TRY(study_add_real(factor[0], restitution));
        TRY(study_add_real(factor[1], contact_time));
    }
    return STATUS_OK;
}

// Below, a parameter is SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME.

double uncertainty_recorded(const Buffer *buffer, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION ? buffer->test.restitution_deviation
                                                : buffer->test.contact_time_deviation;
}

double uncertainty_find(const InputUncertainty *uncertainty, size_t damper,
                        SensitivityBuffer buffer, int parameter) {
    double found = uncertainty->common[parameter];
    for (size_t i = 0; i < uncertainty->spread.count && isnan(found); i++) {
        const InputDeviation *deviation = &uncertainty->spread.at[i];
        if (deviation->damper == damper + 1 && deviation->buffer == (int)buffer)
            found = deviation->of[parameter];
    }
    return isnan(found) ? 0 : found;
}

// Whether any number has a deviation.
static bool uncertainty_exists(const InputUncertainty *uncertainty) {
    bool exists = uncertainty->common[0] > 0 || uncertainty->common[1] > 0;
    for (size_t i = 0; i < uncertainty->spread.count; i++)
        exists =
            exists || uncertainty->spread.at[i].of[0] > 0 || uncertainty->spread.at[i].of[1] > 0;
    return exists;
}

// Fills the deviations that are recorded with the buffers' materials, where none is given for all.
static Status uncertainty_fill_recorded(InputUncertainty *uncertainty,
                                        const Simulation *simulation) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < BUFFERS * dampers->count; i++) {
        const Buffer *buffer = perturbation_buffer(dampers, i);
        double recorded[2];
        for (int parameter = 0; parameter < 2; parameter++) {
            recorded[parameter] = uncertainty_recorded(buffer, parameter);
            if (!(recorded[parameter] > 0) || !isnan(uncertainty->common[parameter]) ||
                perturbation_refuse(simulation, parameter) != NULL)
                recorded[parameter] = (double)NAN;
        }
        if (buffer->material == NULL || (isnan(recorded[0]) && isnan(recorded[1])))
            continue;
        InputDeviation *added = list_append(&uncertainty->spread, sizeof *added);
        TRY(status_made(added != NULL));
        *added = (InputDeviation){.damper = i / BUFFERS + 1,
                                  .buffer = (int)(i % BUFFERS),
                                  .restitution = recorded[0],
                                  .contact_time = recorded[1]};
        TRY(text_copy(buffer->material, &added->source));
    }
    return STATUS_OK;
}

static Status uncertainty_check_number(const InputUncertainty *uncertainty,
                                       const InputDeviation *deviation,
                                       const Simulation *simulation, int parameter,
                                       const char *place, Problem *problem) {
    const double value = deviation->of[parameter];
    const char *why = perturbation_refuse(simulation, parameter);
    const char *name = sensitivity_parameter_names[parameter];
    if (value > 0 && why != NULL)
        return json_pointer_fault(problem, place, name, "must be left out: %s", why);
    if (!isnan(value) && !isnan(uncertainty->common[parameter]))
        return json_pointer_fault(problem, place, name,
                                  "must be left out: %s_deviation gives it for all buffers", name);
    if (value > 1)
        return json_pointer_fault(
            problem, place, name,
            "is %.3g of its value, as %.64s records, and must be at most 1 to "
            "be drawn from: give %s_deviation",
            value, deviation->source, name);
    return STATUS_OK;
}

// A source that is named must be the buffer's material, and the numbers must be its own.
static Status uncertainty_check_source(const InputDeviation *deviation, const Buffer *buffer,
                                       const char *place, Problem *problem) {
    if (deviation->source == NULL)
        return STATUS_OK;
    if (!text_same(deviation->source, buffer->material))
        return json_pointer_fault(
            problem, place, "source",
            "is not the material of that buffer: leave it out, or name its material and revision");
    for (int parameter = 0; parameter < 2; parameter++) {
        const double value = deviation->of[parameter],
                     recorded = uncertainty_recorded(buffer, parameter);
        if (!isnan(value) && value != recorded)
            return json_pointer_fault(problem, place, sensitivity_parameter_names[parameter],
                                      "is %.6g, but %.80s records %.6g: leave out the source",
                                      value, deviation->source, recorded);
    }
    return STATUS_OK;
}

static Status uncertainty_check(const InputUncertainty *uncertainty, const Simulation *simulation,
                                size_t index, Problem *problem) {
    const Dampers *dampers = &simulation->scene.dampers;
    const InputDeviation *deviation = &uncertainty->spread.at[index];
    char place[sizeof((Fault){0}.pointer)];
    json_pointer_index(place, sizeof place, "/study/spread", index);
    if (deviation->damper > dampers->count)
        return json_pointer_fault(problem, place, "damper", "must be the number of a damper");
    const Buffer *buffer =
        perturbation_buffer(dampers, (deviation->damper - 1) * BUFFERS + (size_t)deviation->buffer);
    if (!buffer_is_given(buffer))
        return json_pointer_fault(
            problem, place, "buffer",
            "is not given: if both stops have the same it is \"buffer\", else "
            "\"left_buffer\" and \"right_buffer\"");
    for (size_t i = 0; i < index; i++)
        if (uncertainty->spread.at[i].damper == deviation->damper &&
            uncertainty->spread.at[i].buffer == deviation->buffer)
            return problem_add(problem, STATUS_INVALID, place,
                               "names the buffer of another entry: give one each");
    TRY(uncertainty_check_source(deviation, buffer, place, problem));
    Status status = STATUS_OK;
    for (int parameter = 0; parameter < 2; parameter++)
        status =
            study_first_failure(status, uncertainty_check_number(uncertainty, deviation, simulation,
                                                                 parameter, place, problem));
    return status;
}

static int uncertainty_compare(const void *a, const void *b) {
    const InputDeviation *first = a, *second = b;
    if (first->damper != second->damper)
        return first->damper < second->damper ? -1 : 1;
    return (first->buffer > second->buffer) - (first->buffer < second->buffer);
}

// Validates and completes it for a completed simulation, below "/study". A number without a
// deviation is exact.
static Status uncertainty_complete(InputUncertainty *uncertainty, const Simulation *simulation,
                                   Problem *problem) {
    InputDeviations *spread = &uncertainty->spread;
    Status status = STATUS_OK;
    if (spread->count == 0)
        TRY(uncertainty_fill_recorded(uncertainty, simulation));
    for (size_t i = 0; i < spread->count; i++)
        status =
            study_first_failure(status, uncertainty_check(uncertainty, simulation, i, problem));
    TRY(status);
    if (spread->count > 1)
        qsort(spread->at, spread->count, sizeof *spread->at, uncertainty_compare);
    for (int parameter = 0; parameter < 2; parameter++) {
        bool is_exact = isnan(uncertainty->common[parameter]);
        for (size_t i = 0; i < spread->count; i++)
            is_exact = is_exact && isnan(spread->at[i].of[parameter]);
        if (is_exact)
            uncertainty->common[parameter] = 0;
        const double common = uncertainty->common[parameter];
        const char *why = common > 0 ? perturbation_refuse(simulation, parameter) : NULL;
        if (why != NULL)
            status = problem_add_real(problem, STATUS_INVALID,
                                      parameter == SENSITIVITY_RESTITUTION
                                          ? "/study/restitution_deviation"
                                          : "/study/contact_time_deviation",
                                      common, NULL, "must be left out: %s", why);
    }
    return status;
}

// clang-format off
const char *const sensitivity_buffer_names[] = {
    [SENSITIVITY_BOTH] = "buffer", [SENSITIVITY_LEFT] = "left_buffer", [SENSITIVITY_RIGHT] = "right_buffer", NULL};

static const Field sensitivity_spread_fields[] = {
    FIELD_COUNT(InputDeviation, damper, NULL, AT_MIN(1), REQUIRED, "number of the damper, from 1"),
    FIELD_CHOICE(InputDeviation, buffer, sensitivity_buffer_names, 0, "one of its buffers"),
    FIELD_TEXT(InputDeviation, source, 160, PRESENCE_OPTIONAL, 0, "material and revision that the deviations come from"),
    FIELD_REAL(InputDeviation, restitution, NULL, WITHIN(0, 1), OPTIONAL, "relative standard deviation of its restitution; exact if absent"),
    FIELD_REAL(InputDeviation, contact_time, NULL, WITHIN(0, 1), OPTIONAL, "the same for its contact time; all rows of a table are scaled by one factor"),
    FIELD_END
};

static const Field sensitivity_input_fields[] = {
    FIELD_REAL(InputUncertainty, restitution_deviation, NULL, WITHIN(0, 0.5), OPTIONAL, "relative standard deviation of every buffer's restitution, 0: exact; if absent that of spread"),
    FIELD_REAL(InputUncertainty, contact_time_deviation, NULL, WITHIN(0, 0.5), OPTIONAL, "the same for its contact time"),
    FIELD_LIST(InputUncertainty, spread, sensitivity_spread_fields, DEVIATIONS_MAX, PRESENCE_OPTIONAL, "deviations buffer by buffer; if absent those in the revisions of the buffers' materials, of a table the root mean square of its rows"),
    FIELD_END
};

static const Field sensitivity_study_fields[] = {
    FIELD_TEXTS(SensitivityStudy, parameters, sensitivity_parameter_names, NULL, SENSITIVITY_PARAMETERS, PRESENCE_OPTIONAL, 0, "parameters of the derivatives, each for all dampers and sides at once; if absent all of restitution, contact_time, stiffness, damping, mass (of the free masses) and clearance that the scene has"),
    FIELD_REAL(SensitivityStudy, step, NULL, WITHIN(1e-6, 0.2), 0.01, "relative step of the central differences; half and a quarter of it are tried too"),
    FIELD_BASE(SensitivityStudy, uncertainty, sensitivity_input_fields),
    FIELD_COUNT(SensitivityStudy, runs, NULL, WITHIN(0, RUNS_MAX), OPTIONAL, "runs with restitution and contact time drawn at random; 200 if absent, none without a deviation"),
    FIELD_COUNT(SensitivityStudy, seed, NULL, WITHIN(0, 0x1p53 - 1), 1, "seed of the draws"),
    FIELD_END
};

static const Field sensitivity_stop_fields[] = {
    FIELD_COUNT(SensitivityStop, damper, NULL, AT_MIN(1), OPTIONAL, "number of the damper, from 1"),
    FIELD_CHOICE(SensitivityStop, side, side_names, OPTIONAL, "its stop"),
    FIELD_REAL(SensitivityStop, restitution, NULL, ANY, OPTIONAL, "e"),
    FIELD_REAL(SensitivityStop, contact_time, "s", ANY, OPTIONAL, "T_c"),
    FIELD_REAL(SensitivityStop, effective_mass, "kg", ANY, OPTIONAL, "m_e"),
    FIELD_REAL(SensitivityStop, stiffness, "N/m", ANY, OPTIONAL, "k_b"),
    FIELD_REAL(SensitivityStop, damping, "N s/m", ANY, OPTIONAL, "c_b"),
    FIELD_REAL(SensitivityStop, stiffness_by_restitution, NULL, ANY, OPTIONAL, "relative change of k_b over the relative error of e, in closed form"),
    FIELD_REAL(SensitivityStop, stiffness_by_contact_time, NULL, ANY, OPTIONAL, "over that of T_c"),
    FIELD_REAL(SensitivityStop, damping_by_restitution, NULL, ANY, OPTIONAL, "relative change of c_b over the relative error of e; unknown at e = 1, where there is no damping"),
    FIELD_REAL(SensitivityStop, damping_by_contact_time, NULL, ANY, OPTIONAL, "over that of T_c"),
    FIELD_REAL(SensitivityStop, by_damper_mass, NULL, ANY, OPTIONAL, "relative change of k_b and of c_b over that of the free mass; 0 if a rig's masses identify them"),
    FIELD_REAL(SensitivityStop, by_structure_mass, NULL, ANY, OPTIONAL, "over that of all masses of the structure together"),
    FIELD_REAL(SensitivityStop, stiffness_deviation, NULL, ANY, OPTIONAL, "relative standard deviation of k_b that follows from the stated deviations, to first order"),
    FIELD_REAL(SensitivityStop, damping_deviation, NULL, ANY, OPTIONAL, "of c_b"),
    FIELD_TEXT(SensitivityStop, why, 0, PRESENCE_OPTIONAL, 0, "why there are no closed forms"),
    FIELD_END
};

static const Field sensitivity_slope_fields[] = {
    FIELD_CHOICE(SensitivitySlope, metric, statistics_metric_names, OPTIONAL, "metric of the summary"),
    FIELD_REAL(SensitivitySlope, value, NULL, ANY, OPTIONAL, "of the scene itself"),
    FIELD_REAL(SensitivitySlope, derivative, NULL, ANY, OPTIONAL, "relative change over that of the parameter, by the central difference of the middle step"),
    FIELD_REAL(SensitivitySlope, spread, NULL, ANY, OPTIONAL, "largest less smallest difference of all steps"),
    FIELD_FLAG(SensitivitySlope, is_settled, false, "the spread is at most a tenth of the largest, or 0.001: the steps agree. Otherwise the number is no derivative"),
    FIELD_END
};

static const Field sensitivity_row_fields[] = {
    FIELD_CHOICE(SensitivityRow, parameter, sensitivity_parameter_names, OPTIONAL, "parameter, of all dampers and sides at once"),
    FIELD_REALS(SensitivityRow, steps, NULL, ANY, 0, PRESENCE_OPTIONAL, "relative steps down and up; a restitution does not exceed 1"),
    FIELD_LIST(SensitivityRow, slopes, sensitivity_slope_fields, 0, PRESENCE_DEFAULT, "metric by metric"),
    FIELD_TEXT(SensitivityRow, why, 0, PRESENCE_OPTIONAL, 0, "why there are no slopes, or why one of the runs failed"),
    FIELD_END
};

static const Field sensitivity_statistic_fields[] = {
    FIELD_CHOICE(RunStatistic, metric, statistics_metric_names, OPTIONAL, "metric of the summary"),
    FIELD_TEXT(RunStatistic, unit, 0, PRESENCE_OPTIONAL, 0, "of the numbers below"),
    FIELD_COUNT(RunStatistic, count, NULL, AT_MIN(0), 0, "runs in which it is known"),
    FIELD_REAL(RunStatistic, value, NULL, ANY, OPTIONAL, "of the scene itself"),
    FIELD_REAL(RunStatistic, mean, NULL, ANY, OPTIONAL, "mean over the runs"),
    FIELD_REAL(RunStatistic, standard_deviation, NULL, ANY, OPTIONAL, "of one run"),
    FIELD_REAL(RunStatistic, low, NULL, ANY, OPTIONAL, "lower end of the confidence interval of the mean, by Student's t"),
    FIELD_REAL(RunStatistic, high, NULL, ANY, OPTIONAL, "upper end of that interval"),
    FIELD_REAL(RunStatistic, minimum, NULL, ANY, OPTIONAL, "the smallest"),
    FIELD_REAL(RunStatistic, q05, NULL, ANY, OPTIONAL, "5 % of the runs are below"),
    FIELD_REAL(RunStatistic, median, NULL, ANY, OPTIONAL, "half of the runs are below"),
    FIELD_REAL(RunStatistic, q95, NULL, ANY, OPTIONAL, "95 % of the runs are below"),
    FIELD_REAL(RunStatistic, maximum, NULL, ANY, OPTIONAL, "the largest"),
    FIELD_END
};

static const Field sensitivity_failure_fields[] = {STUDY_FAILURE_ROWS("first_run", "the first of them")};

static const Field sensitivity_spectrum_fields[] = {
    FIELD_TEXT(RunSpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(RunSpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(RunSpectrum, value, NULL, ANY, 0, PRESENCE_OPTIONAL, "of the scene itself"),
    FIELD_REALS(RunSpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean of the runs' densities at each frequency"),
    FIELD_REALS(RunSpectrum, q05, NULL, ANY, 0, PRESENCE_OPTIONAL, "5 % of the runs are below, at each frequency separately"),
    FIELD_REALS(RunSpectrum, median, NULL, ANY, 0, PRESENCE_OPTIONAL, "half of the runs are below"),
    FIELD_REALS(RunSpectrum, q95, NULL, ANY, 0, PRESENCE_OPTIONAL, "95 % of the runs are below"),
    {.name = "q16", .kind = FIELD_KIND_REALS, .offset = FIELD_AT(RunSpectrum, q16, Reals), .size = sizeof(double), .range = ANY, .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN},
    {.name = "q84", .kind = FIELD_KIND_REALS, .offset = FIELD_AT(RunSpectrum, q84, Reals), .size = sizeof(double), .range = ANY, .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN},
    FIELD_END
};

// The factors are those of the buffers' numbers, damper by damper, buffer by buffer.
static const Field sensitivity_draw_fields[] = {
    {.name = "run", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(RunRecord, number, uint64_t), .range = AT_MIN(1), .presence = PRESENCE_OPTIONAL, .doc = "its number; number and seed determine the draw"},
    FIELD_TEXT(RunRecord, why, 0, PRESENCE_OPTIONAL, 0, "reason of its failure"),
    FIELD_REALS(RunRecord, restitution, NULL, ANY, 0, PRESENCE_OPTIONAL, "factor of each given buffer's restitution: damper by damper, of both sides, left, right"),
    FIELD_REALS(RunRecord, contact_time, NULL, ANY, 0, PRESENCE_OPTIONAL, "likewise"),
    FIELD_ITEM(RunRecord, summary, summary_fields, NULL, PRESENCE_DEFAULT, "as in any result"),
    FIELD_END
};

static const Field sensitivity_uncertainty_fields[] = {
    FIELD_REAL(InputUncertainty, restitution_deviation, NULL, ANY, OPTIONAL, "relative, stated for all buffers; if unknown, spread was used"),
    FIELD_REAL(InputUncertainty, contact_time_deviation, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_LIST(InputUncertainty, spread, sensitivity_spread_fields, 0, PRESENCE_DEFAULT, "deviations of each buffer and their sources"),
    FIELD_END
};

static const Field sensitivity_answer_fields[] = {
    FIELD_ITEM(Sensitivity, summary, summary_fields, NULL, PRESENCE_DEFAULT, "of the scene itself"),
    FIELD_REAL(Sensitivity, steps, NULL, ANY, 0, "solver steps of all runs"),
    FIELD_LIST(Sensitivity, contact, sensitivity_stop_fields, 0, PRESENCE_DEFAULT, "effect of errors on k_b and c_b, stop by stop"),
    FIELD_LIST(Sensitivity, response, sensitivity_row_fields, 0, PRESENCE_DEFAULT, "effect of changes on the response, parameter by parameter"),
    FIELD_FLAG(Sensitivity, is_chaotic, false, "the scene continues beyond its trust horizon"),
    FIELD_TEXT(Sensitivity, why, 0, PRESENCE_OPTIONAL, 0, "consequence for the derivatives of the response"),
    FIELD_COUNT(Sensitivity, runs, NULL, AT_MIN(0), 0, "requested runs with restitution and contact time drawn at random"),
    FIELD_COUNT(Sensitivity, made, NULL, AT_MIN(0), 0, "drawn runs made"),
    FIELD_COUNT(Sensitivity, failed, NULL, AT_MIN(0), 0, "drawn runs that failed; all numbers below are of the others"),
    FIELD_COUNT(Sensitivity, seed, NULL, AT_MIN(0), OPTIONAL, "seed of the draws"),
    FIELD_BASE(Sensitivity, uncertainty, sensitivity_uncertainty_fields),
    FIELD_TEXT(Sensitivity, distribution, 0, PRESENCE_OPTIONAL, 0, "distribution of the draws"),
    FIELD_REAL(Sensitivity, confidence, NULL, ANY, OPTIONAL, "of the intervals of means"),
    FIELD_LIST(Sensitivity, statistics, sensitivity_statistic_fields, 0, PRESENCE_DEFAULT, "over the drawn runs"),
    FIELD_LIST(Sensitivity, failures, sensitivity_failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_REALS(Sensitivity, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Sensitivity, spectra, sensitivity_spectrum_fields, 0, PRESENCE_DEFAULT, "densities of the drawn runs, channel by channel"),
    FIELD_LIST(Sensitivity, table, sensitivity_draw_fields, 0, PRESENCE_DEFAULT, "every drawn run"),
    FIELD_END
};
// clang-format on

static Status sensitivity_check_runs(SensitivityStudy *study, const Simulation *simulation,
                                     Problem *problem) {
    const bool is_uncertain = uncertainty_exists(&study->uncertainty);
    const double values = study_run_densities(simulation);
    if (study->runs == COUNT_ABSENT)
        study->runs = is_uncertain ? RUNS_DEFAULT : 0;
    if (study->runs > 0 && !is_uncertain)
        return problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                "must be 0 or left out without a deviation to draw from: give "
                                "restitution_deviation or contact_time_deviation, or materials "
                                "whose revisions record theirs");
    if (study->runs > 0)
        TRY(study_run_check_densities(simulation, values, problem));
    if (values * (double)study->runs > SPECTRUM_ACCUMULATOR_MAX)
        return problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                "must be at most %.0f for spectra of %.0f densities, is %llu: ask "
                                "for fewer, or for shorter segments",
                                floor(SPECTRUM_ACCUMULATOR_MAX / values), values,
                                (unsigned long long)study->runs);
    return STATUS_OK;
}

static Status sensitivity_complete(void *request, const Simulation *simulation,
                                   const SimulationLimits *limits, Problem *problem) {
    SensitivityStudy *study = request;
    (void)limits;
    if (simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "sensitivity needs a damper: the scene has none");
    const Status deviations = uncertainty_complete(&study->uncertainty, simulation, problem);
    const Status runs = sensitivity_check_runs(study, simulation, problem);
    // Defaults are written out, so that equal studies have one canonical form.
    const bool has_parameters = study->parameters.count > 0;
    for (int i = 0; i < SENSITIVITY_PARAMETERS && !has_parameters; i++)
        if (perturbation_refuse(simulation, i) == NULL)
            TRY(texts_append(&study->parameters, sensitivity_parameter_names[i]));
    return study_first_failure(deviations, runs);
}

// Members are steps, parameter by parameter, down and up by each of them, and then the drawn runs.
enum { SIDES = 2, ROW_STEPS = SIDES * SENSITIVITY_STEPS };

typedef struct SensitivityWork {
    StudyWork work;
    const SensitivityStudy *study;
    const Simulation *simulation;
    Sensitivity *answer;
    Outcome *own;                        // of the scene itself
    size_t rows[SENSITIVITY_PARAMETERS]; // of the answer, those that have steps
    size_t steps;                        // members
    double values[SENSITIVITY_PARAMETERS * ROW_STEPS][STATISTICS_USUAL]; // of each step
    SpectrumAccumulator sums;                                            // of the drawn runs
} SensitivityWork;

static int sensitivity_parameter(const char *name) {
    int parameter = 0;
    while (strcmp(sensitivity_parameter_names[parameter], name) != 0)
        parameter++;
    return parameter;
}

static Status sensitivity_cost(const void *request, const Simulation *simulation,
                               const SimulationLimits *limits, double *steps) {
    const SensitivityStudy *study = request;
    uint64_t runs = 1 + study->runs;
    Simulation member = {0};
    (void)limits;
    for (size_t i = 0; i < study->parameters.count; i++)
        if (perturbation_refuse(simulation, sensitivity_parameter(study->parameters.at[i])) == NULL)
            runs += ROW_STEPS;
    const Status status = study_run_copy(simulation, &member);
    if (status == STATUS_OK)
        *steps = (double)runs * simulation_cost(&member).steps;
    simulation_clear(&member);
    return status;
}

static double sensitivity_step(const SensitivityWork *work, size_t step) {
    return ldexp(work->study->step, -(int)step);
}

// The step up is smaller where a restitution would exceed 1.
static double sensitivity_step_up(const SensitivityWork *work, int parameter, size_t step) {
    return perturbation_max_step(work->simulation, parameter, sensitivity_step(work, step));
}

static Status sensitivity_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                                Problem *problem) {
    const SensitivityWork *work = of;
    (void)problem;
    TRY(study_run_copy(work->simulation, scene));
    if (member < work->steps) {
        const int parameter = work->answer->response.at[work->rows[member / ROW_STEPS]].parameter;
        const size_t step = member % ROW_STEPS / SIDES;
        const double factor = member % SIDES == 0 ? 1 - sensitivity_step(work, step)
                                                  : 1 + sensitivity_step_up(work, parameter, step);
        perturbation_apply(work->simulation, parameter, factor, scene);
        return STATUS_OK;
    }
    return perturbation_draw(&work->study->uncertainty, work->study->seed, work->simulation,
                             member - work->steps + 1, scene, &part->run.restitution,
                             &part->run.contact_time);
}

static Status sensitivity_fold_draw(SensitivityWork *work, size_t index, StudyPart *part) {
    Sensitivity *answer = work->answer;
    TRY(run_table_add(&answer->table, &part->run, index + 1));
    answer->made++;
    const RunRecord *run = &answer->table.at[index];
    if (run->why == NULL)
        return spectrum_accumulator_add(&work->sums, &part->spectrum, (size_t)work->study->runs);
    answer->failed++;
    return study_failures_add(&answer->failures, (int)run->status, status_slug(run->status),
                              run->number, run->why);
}

static Status sensitivity_fold(void *of, size_t member, StudyPart *part) {
    SensitivityWork *work = of;
    RunRecord *run = &part->run;
    if (run->why == NULL)
        work->answer->steps += run->steps;
    if (member >= work->steps)
        return sensitivity_fold_draw(work, member - work->steps, part);
    for (int metric = 0; metric < STATISTICS_USUAL; metric++)
        work->values[member][metric] = statistics_value(&run->summary, metric);
    if (run->why != NULL) {
        char **why = &work->answer->response.at[work->rows[member / ROW_STEPS]].why;
        free(*why);
        *why = run->why;
        run->why = NULL;
    }
    return STATUS_OK;
}

// Relative change over relative change.
static double sensitivity_quotient(double low, double high, double value, double width) {
    if (value == 0)
        return low == high ? 0 : (double)NAN;
    return (high - low) / value / width;
}

static void sensitivity_fill_slope(const double quotients[SENSITIVITY_STEPS],
                                   SensitivitySlope *slope) {
    // Quotients agree within this part of the largest, or where nothing depends on the parameter.
    static const double settled_part = 0.1, settled_min = 1e-3;
    double min = INFINITY, max = -INFINITY;
    slope->derivative = quotients[SENSITIVITY_STEPS / 2];
    for (int i = 0; i < SENSITIVITY_STEPS; i++) {
        if (isnan(quotients[i]))
            return;
        min = fmin(min, quotients[i]);
        max = fmax(max, quotients[i]);
    }
    slope->spread = max - min;
    slope->is_settled =
        slope->spread <= fmax(settled_part * fmax(fabs(min), fabs(max)), settled_min);
}

static Status sensitivity_fill_row(const SensitivityWork *work, size_t index) {
    SensitivityRow *row = &work->answer->response.at[work->rows[index]];
    for (size_t step = 0; step < SENSITIVITY_STEPS; step++)
        TRY(study_add_real(sensitivity_step(work, step), &row->steps));
    for (int metric = 0; metric < STATISTICS_USUAL; metric++) {
        const double value = statistics_value(&work->own->summary, metric);
        double quotients[SENSITIVITY_STEPS];
        if (metric == STATISTICS_PEAK_CONTACT_FORCE && isnan(value))
            continue;
        for (size_t step = 0; step < SENSITIVITY_STEPS; step++) {
            const size_t low = index * ROW_STEPS + step * SIDES;
            const double width =
                sensitivity_step(work, step) + sensitivity_step_up(work, row->parameter, step);
            quotients[step] = sensitivity_quotient(work->values[low][metric],
                                                   work->values[low + 1][metric], value, width);
        }
        SensitivitySlope *slope = list_append(&row->slopes, sizeof *slope);
        TRY(status_made(slope != NULL));
        *slope = (SensitivitySlope){metric, value, (double)NAN, (double)NAN, false};
        sensitivity_fill_slope(quotients, slope);
    }
    return STATUS_OK;
}

static Status sensitivity_fill_statistics(const SensitivityWork *work) {
    Sensitivity *answer = work->answer;
    for (int metric = 0; metric < STATISTICS_USUAL; metric++) {
        RunStatistic *statistic = list_append(&answer->statistics, sizeof *statistic);
        TRY(status_made(statistic != NULL));
        (void)fields_default(sensitivity_statistic_fields, statistic); // nothing to allocate
        statistic->value = statistics_value(&work->own->summary, metric);
        TRY(statistics_fill(&answer->table, metric, statistic));
    }
    return STATUS_OK;
}

static Status sensitivity_end(void *of, const StudyTools *tools, Problem *problem) {
    const SensitivityWork *work = of;
    Sensitivity *answer = work->answer;
    for (size_t i = 0; i < work->steps / ROW_STEPS; i++)
        TRY(sensitivity_fill_row(work, i));
    if (work->study->runs == 0)
        return STATUS_OK;
    TRY(sensitivity_fill_statistics(work));
    return spectrum_accumulator_report(&work->sums, &work->own->spectrum, SPECTRUM_QUANTILES,
                                       tools->progress, &answer->frequency, &answer->spectra,
                                       problem);
}

// Why a stop has no closed forms; NULL: it has.
static const char *sensitivity_refuse_stop(const ContactLaw *law, const Buffer *buffer) {
    if (law->form == CONTACT_IMPULSIVE)
        return "impulses have no stiffness and no damping";
    if (law->form == CONTACT_POWER)
        return "the stiffness of a power law is that of each approach speed";
    if (buffer->table.count > 0)
        return "the buffer is a table: its numbers are those of each approach speed";
    if (isnan(buffer->contact_time))
        return "stiffness and damping are given themselves";
    return NULL;
}

// k_b and c_b are proportional to m_e, 1 / m_e = 1 / m + (M^-1)_jj: by the free mass they change
// by m_e / m, by all masses of the structure together by the rest. Numbers identified with a rig's
// masses do not change with the scene's masses.
static void sensitivity_fill_stop(const SensitivityStudy *study, const Damper *damper,
                                  Separation separation, SensitivityStop *stop) {
    const IdentificationSensitivity by = identification_sensitivity(stop->restitution, separation);
    const SensitivityBuffer buffer = damper_buffer(damper, (Side)stop->side) == &damper->buffer
                                         ? SENSITIVITY_BOTH
                                     : stop->side == SIDE_LEFT ? SENSITIVITY_LEFT
                                                               : SENSITIVITY_RIGHT;
    const size_t number = (size_t)stop->damper - 1;
    const double e = uncertainty_find(&study->uncertainty, number, buffer, SENSITIVITY_RESTITUTION);
    const double T =
        uncertainty_find(&study->uncertainty, number, buffer, SENSITIVITY_CONTACT_TIME);
    const bool is_rig = damper->identified_for == IDENTIFIED_FOR_RIG;
    stop->stiffness_by_restitution = by.stiffness_by_restitution;
    stop->stiffness_by_contact_time = by.stiffness_by_contact_time;
    stop->damping_by_restitution = by.damping_by_restitution;
    stop->damping_by_contact_time = by.damping_by_contact_time;
    stop->by_damper_mass = is_rig ? 0 : stop->effective_mass / damper->mass;
    stop->by_structure_mass = is_rig ? 0 : 1 - stop->effective_mass / damper->mass;
    if (e > 0 || T > 0) {
        stop->stiffness_deviation =
            hypot(by.stiffness_by_restitution * e, by.stiffness_by_contact_time * T);
        stop->damping_deviation =
            hypot(by.damping_by_restitution * e, by.damping_by_contact_time * T);
    }
}

static Status sensitivity_fill_contact(const SensitivityWork *work) {
    const Scene *scene = &work->simulation->scene;
    const DerivedList *derived = &work->own->plan.derived;
    const Contact *contact = scene_contact(scene);
    const ContactLaw *law = dampers_contact_law(&scene->dampers, contact);
    for (size_t i = 0; i < derived->count; i++) {
        const Derived *from = &derived->at[i];
        const Damper *damper = &scene->dampers.at[from->damper - 1];
        const char *why = sensitivity_refuse_stop(law, damper_buffer(damper, (Side)from->side));
        SensitivityStop *stop = list_append(&work->answer->contact, sizeof *stop);
        TRY(status_made(stop != NULL));
        (void)fields_default(sensitivity_stop_fields, stop); // nothing to allocate
        stop->damper = from->damper;
        stop->side = from->side;
        stop->restitution = from->restitution;
        stop->contact_time = from->contact_time;
        stop->effective_mass = from->effective_mass;
        stop->stiffness = from->stiffness;
        stop->damping = from->damping;
        if (why == NULL)
            sensitivity_fill_stop(work->study, damper, (Separation)contact->separation, stop);
        TRY(text_copy(why, &stop->why));
    }
    return STATUS_OK;
}

// Rows of the answer, and those of them that have steps.
static Status sensitivity_fill_rows(SensitivityWork *work) {
    const Texts *parameters = &work->study->parameters;
    size_t stepped = 0;
    for (size_t i = 0; i < parameters->count; i++) {
        SensitivityRow *row = list_append(&work->answer->response, sizeof *row);
        TRY(status_made(row != NULL));
        row->parameter = sensitivity_parameter(parameters->at[i]);
        const char *refused = perturbation_refuse(work->simulation, row->parameter);
        if (refused == NULL)
            work->rows[stepped++] = i;
        TRY(text_copy(refused, &row->why));
    }
    work->steps = stepped * ROW_STEPS;
    return STATUS_OK;
}

static Status sensitivity_run_scene(SensitivityWork *work, const StudyTools *tools,
                                    Problem *problem) {
    Sensitivity *answer = work->answer;
    Simulation scene = {0};
    Status status = study_run_copy(work->simulation, &scene);
    if (status == STATUS_OK)
        status = study_run_scene(&scene, tools, &work->own, problem);
    simulation_clear(&scene);
    TRY(status);
    const double horizon = work->own->summary.trust_horizon;
    answer->summary = work->own->summary;
    answer->steps = work->own->steps;
    answer->is_chaotic = !isnan(horizon);
    return status_made(
        answer->is_chaotic
            ? text_format(&answer->why,
                          "rounding alone changes the trajectory after %.4g s: from there on a "
                          "small step of a parameter gives another trajectory, and derivatives of "
                          "its statistics may not exist; the spread shows which do",
                          horizon)
            : text_format(&answer->why,
                          "the trajectory can be trusted to the end: derivatives on which the "
                          "steps do not agree are those of numbers that jump, such as the number "
                          "of impacts, or the steps are too large"));
}

static void sensitivity_free(void *of) {
    SensitivityWork *work = of;
    spectrum_accumulator_clear(&work->sums);
    outcome_unref(work->own);
}

static Status sensitivity_begin(void *of, const StudyTools *tools, Problem *problem) {
    SensitivityWork *work = of;
    const SensitivityStudy *study = work->study = work->work.study;
    Sensitivity *answer = work->answer = work->work.answer;
    const size_t runs = (size_t)study->runs;
    work->simulation = work->work.simulation;
    answer->runs = study->runs;
    answer->seed = study->seed;
    answer->confidence = STATISTICS_CONFIDENCE;
    TRY(text_copy(
        study->uncertainty.spread.count == 0
            ? "log-normal factors of mean 1 and the stated relative deviation, independent for the "
              "restitution and the contact time of each buffer; a restitution beyond 1 is drawn "
              "again"
            : "log-normal factors of mean 1 and the relative deviations of spread, independent for "
              "the restitution and the contact time of each buffer, one factor for all rows of a "
              "table. A restitution beyond 1 is drawn again",
        &answer->distribution));
    TRY(fields_copy(sensitivity_uncertainty_fields, &study->uncertainty, &answer->uncertainty));
    TRY(sensitivity_run_scene(work, tools, problem));
    TRY(sensitivity_fill_contact(work));
    TRY(sensitivity_fill_rows(work));
    const size_t densities =
        work->own->spectrum.densities.count * work->own->spectrum.densities.rows;
    work->work.members = work->steps + runs;
    work->work.part_bytes = sizeof(StudyPart) + sizeof(double) * densities;
    return STATUS_OK;
}

const StudyKind study_sensitivity = {
    .kind =
        {"sensitivity",
         "effects of errors of restitution, contact time and masses on k_b, c_b and the response",
         sensitivity_study_fields, sizeof(SensitivityStudy)},
    .answer = &(const Kind){"sensitivity", "effects of errors of a buffer's numbers",
                            sensitivity_answer_fields, sizeof(Sensitivity)},
    .shorten = "ask for fewer runs or parameters",
    .complete = sensitivity_complete,
    .cost = sensitivity_cost,
    .work_size = sizeof(SensitivityWork),
    .part_size = sizeof(StudyPart),
    .begin = sensitivity_begin,
    .scene = sensitivity_scene,
    .fold = sensitivity_fold,
    .end = sensitivity_end,
    .free = sensitivity_free,
};
