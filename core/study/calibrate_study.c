// Weighted least squares from several starts. All numbers of the search lie in [0, 1]: parameter i
// is from + u_i (to - from), or from (to / from)^(u_i) where the range spans two decades.
//
// Where errors grow so fast that the motion cannot be predicted to the end of the record, its first
// part is fitted; where this does not determine all parameters, spectra are.
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/study/calibrate_search.h"

enum { SAMPLES_MIN = 16, SPECTRUM_SAMPLES_MIN = 64, MOTION_POINTS = 1000 };

static const double structured = 0.05; // of the motion: rms of residuals that is not explained
// Correlation of neighbouring residuals that is not of noise, in standard errors, and that of
// residuals that are not noise for the most part.
static const double correlated_errors = 3.3, smooth_errors = 4, smooth_min = 0.2;
static const double rms_min = 1e-100; // of samples: squares of less underflow
// Of the expected variance: spectra that differ. Those of chaotic motions scatter more than those
// of noise: few strong impacts make most of them.
static const double spectrum_misfit = 2, spectrum_misfit_chaos = 9;

const char *const calibrate_fit_names[] = {"time", "psd", NULL};
const char *const calibrate_verdict_names[] = {"explained", "not_explained", "not_identifiable",
                                               NULL};

// clang-format off
static const Field measured_channel_fields[] = {
    FIELD_TEXT(MeasuredChannel, channel, 40, PRESENCE_REQUIRED, 0, "channel that was measured, as in output.channels"),
    FIELD_REALS(MeasuredChannel, samples, NULL, WITHIN(-1e100, 1e100), MEASURED_SAMPLES, PRESENCE_REQUIRED, "measured values in the channel's unit"),
    FIELD_REAL(MeasuredChannel, interval, "s", ABOVE(0), REQUIRED, "between samples"),
    FIELD_REAL(MeasuredChannel, start, "s", AT_MIN(0), 0, "time of the first sample in the scene"),
    FIELD_REAL(MeasuredChannel, deviation, NULL, AT_MIN(1e-100), OPTIONAL, "standard deviation of the noise in the channel's unit; estimated if absent"),
    FIELD_END
};

static const Field calibrate_study_fields[] = {
    FIELD_LIST(CalibrateStudy, parameters, study_range_fields, CALIBRATE_PARAMETERS, PRESENCE_REQUIRED, "numbers of the scene to be fitted, each within a range from ... to"),
    FIELD_LIST(CalibrateStudy, measured, measured_channel_fields, MEASURED_CHANNELS, PRESENCE_REQUIRED, "measured motions"),
    FIELD_CHOICE(CalibrateStudy, fit, calibrate_fit_names, CALIBRATE_TIME, "time: sample by sample; psd: spectra by Welch's method with the settings of output.psd"),
    FIELD_REAL(CalibrateStudy, max_shift, "s", AT_MIN(0), 0, "the measured times may be wrong by a common shift of at most this, which is fitted too"),
    FIELD_COUNT(CalibrateStudy, starts, NULL, WITHIN(1, CALIBRATE_STARTS), 8, "points from which the search starts"),
    FIELD_COUNT(CalibrateStudy, search_seed, NULL, WITHIN(0, 0x1p53 - 1), 1, "seed of these points"),
    FIELD_BASE(CalibrateStudy, names, study_names_fields),
    FIELD_END
};

static const Field calibrated_parameter_fields[] = {
    FIELD_BASE(CalibratedParameter, member, study_member_fields),
    FIELD_TEXT(CalibratedParameter, unit, 0, PRESENCE_OPTIONAL, 0, "of its value"),
    FIELD_REAL(CalibratedParameter, value, NULL, ANY, OPTIONAL, "fitted"),
    FIELD_REAL(CalibratedParameter, standard_error, NULL, ANY, OPTIONAL, "standard deviation of the fitted value in its valley; null if the interval is as wide as the range or the verdict is not_explained"),
    FIELD_REALS_OR_NULL(CalibratedParameter, interval_95, NULL, "95 % confidence interval"),
    FIELD_FLAG_OR_NULL(CalibratedParameter, identifiable, "the measured motions determine it within its range; null if the verdict is not_explained"),
    FIELD_END
};

static const Field calibration_residual_fields[] = {
    FIELD_TEXT(CalibrationResidual, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(CalibrationResidual, unit, 0, PRESENCE_OPTIONAL, 0, "of the numbers; dB of spectra"),
    {.name = "value", .kind = FIELD_KIND_REAL, .offset = FIELD_AT(CalibrationResidual, rms, double), .range = ANY, .presence = PRESENCE_OPTIONAL, .doc = "rms of the differences between fit and measurement"},
    FIELD_REAL(CalibrationResidual, measured_rms, NULL, ANY, OPTIONAL, "of the measured motion about its mean"),
    FIELD_REAL(CalibrationResidual, deviation, NULL, ANY, OPTIONAL, "standard deviation of the noise, given or estimated"),
    FIELD_COUNT(CalibrationResidual, samples, NULL, AT_MIN(0), 0, "samples compared"),
    FIELD_END
};

static const Field calibration_motion_fields[] = {
    FIELD_TEXT(CalibrationMotion, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(CalibrationMotion, unit, 0, PRESENCE_OPTIONAL, 0, "of the values"),
    FIELD_FLAG(CalibrationMotion, is_spectrum, false, "of a spectrum: at frequencies [Hz], else at times [s]"),
    FIELD_REALS(CalibrationMotion, at, NULL, ANY, 0, PRESENCE_OPTIONAL, "measured times, not shifted, or frequencies"),
    FIELD_REALS(CalibrationMotion, measured, NULL, ANY, 0, PRESENCE_OPTIONAL, "measured values"),
    FIELD_REALS(CalibrationMotion, fitted, NULL, ANY, 0, PRESENCE_OPTIONAL, "values of the fitted scene"),
    FIELD_END
};

static const Field calibration_step_fields[] = {
    FIELD_COUNT(CalibrationStep, index, NULL, AT_MIN(0), 0, "number of the step"),
    FIELD_COUNT(CalibrationStep, start, NULL, AT_MIN(0), 0, "number of its start"),
    FIELD_REAL(CalibrationStep, until, "s", ANY, OPTIONAL, "end of the part of the record that was fitted"),
    FIELD_REALS(CalibrationStep, values, NULL, ANY, 0, PRESENCE_OPTIONAL, "of the parameters"),
    FIELD_REAL(CalibrationStep, shift, "s", ANY, OPTIONAL, "of the measured times"),
    FIELD_REAL(CalibrationStep, cost, NULL, ANY, OPTIONAL, "weighted sum of squared differences"),
    FIELD_END
};

static const Field calibration_fields[] = {
    FIELD_BASE(Calibration, made, study_runs_fields),
    FIELD_CHOICE(Calibration, fit, calibrate_fit_names, OPTIONAL, "what was fitted in the end: time, or psd where the motion cannot be predicted far enough"),
    FIELD_LIST(Calibration, parameters, calibrated_parameter_fields, 0, PRESENCE_DEFAULT, "fitted parameters, in the order of the request"),
    FIELD_ROWS_OR_NULL(Calibration, correlation, NULL, "correlation of the fitted values, in that order"),
    FIELD_REAL(Calibration, shift, "s", ANY, OPTIONAL, "by which the measured times are moved to later times; unknown if spectra are fitted in place of motions"),
    FIELD_REAL(Calibration, shift_error, "s", ANY, OPTIONAL, "standard deviation of the shift, if it was fitted"),
    {.name = "residual_rms", .kind = FIELD_KIND_LIST, .offset = FIELD_LIST_AT(Calibration, residuals), .fields = calibration_residual_fields, .size = sizeof(CalibrationResidual), .presence = PRESENCE_DEFAULT, .doc = "differences between fit and measurement, channel by channel"},
    FIELD_REAL(Calibration, chi_square, NULL, ANY, OPTIONAL, "sum of squared differences over the squared given deviations; unknown without them"),
    FIELD_COUNT(Calibration, freedom, NULL, AT_MIN(0), OPTIONAL, "degrees of freedom of chi_square: samples with a given deviation, less the numbers fitted"),
    FIELD_CHOICE(Calibration, verdict, calibrate_verdict_names, OPTIONAL, "whether the fitted scene explains the measured motions, and these determine all parameters"),
    FIELD_TEXT(Calibration, detail, 0, PRESENCE_OPTIONAL, 0, "the verdict in words"),
    FIELD_LIST(Calibration, motions, calibration_motion_fields, 0, PRESENCE_DEFAULT, "each measured channel and the same of the fitted scene, at most 1000 points of them"),
    FIELD_LIST(Calibration, history, calibration_step_fields, 0, PRESENCE_DEFAULT, "steps of the search"),
    FIELD_END
};
// clang-format on

// That a measured channel has samples to fit, and that runs can have it at its interval.
static Status calibrate_check_channel(const CalibrateStudy *study, const Simulation *simulation,
                                      const SimulationLimits *limits, size_t i, Problem *own,
                                      Problem *problem) {
    const size_t min = study->fit == CALIBRATE_PSD ? SPECTRUM_SAMPLES_MIN : SAMPLES_MIN;
    const double duration = simulation->scene.duration;
    const JsonPointer place = json_pointer_at("/study/measured", i);
    MeasuredChannel measured = study->measured.at[i];
    const double end = measured_time(&measured, measured.samples.count - 1);
    const double from = fmax(measured.start, study->max_shift);
    const double to = fmin(end, duration - study->max_shift);
    Status status = STATUS_OK;
    if (end > duration * (1 + 1e-9))
        status = json_pointer_fault(problem, place.at, "samples",
                                    "end at %.12g s, the scene ends at %.12g s: give the scene a "
                                    "longer duration, or fewer samples",
                                    end, duration);
    else if (!((to - from) / measured.interval + 1.000001 >= (double)min))
        status = json_pointer_fault(problem, place.at, "samples",
                                    "must be at least %zu within the scene%s, for a fit of %s", min,
                                    study->max_shift > 0 ? ", also when they are moved by max_shift"
                                                         : "",
                                    study->fit == CALIBRATE_PSD ? "spectra" : "motions");
    else if (!(measured_rms(&measured) > rms_min))
        status = json_pointer_fault(problem, place.at, "samples",
                                    "have the same value, or differ by less than %g: there is no "
                                    "motion to fit",
                                    rms_min);
    if (strcmp(measured.channel, CHANNEL_USUAL) == 0)
        return json_pointer_fault(problem, place.at, "channel",
                                  "must name one channel, as displacement");
    Simulation base = {0};
    measured.interval = study->measured.at[0].interval;
    problem_clear(own);
    Status made =
        calibrate_make_base(&(MeasuredChannels){&measured, 1}, simulation, duration, &base);
    if (made == STATUS_OK)
        made = simulation_complete(&base, limits, NULL, own);
    simulation_clear(&base);
    const Fault *fault = &own->faults[0];
    if (made == STATUS_INVALID && strncmp(fault->pointer, "/output/channels", 16) == 0)
        made = json_pointer_fault(problem, place.at, "channel", "%s", fault->detail);
    else if (made == STATUS_INVALID)
        made = json_pointer_fault(problem, "/study/measured/0", "interval",
                                  "gives a scene that is not valid: %s: %s", fault->pointer,
                                  fault->detail);
    return study_first_failure(status, made);
}

static Status calibrate_check_measured(const CalibrateStudy *study, const Simulation *simulation,
                                       const SimulationLimits *limits, Problem *own,
                                       Problem *problem) {
    Status status = STATUS_OK;
    size_t samples = 0;
    if (study->measured.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/measured",
                           "must have at least one measured channel");
    for (size_t i = 0; i < study->measured.count; i++) {
        samples += study->measured.at[i].samples.count;
        status = study_first_failure(
            status, calibrate_check_channel(study, simulation, limits, i, own, problem));
    }
    if (samples > MEASURED_SAMPLES)
        status = problem_add(problem, STATUS_INVALID, "/study/measured",
                             "has %zu samples in all, at most %d are allowed: give fewer channels, "
                             "or a longer interval",
                             samples, MEASURED_SAMPLES);
    if (study->fit == CALIBRATE_PSD && study->max_shift > 0)
        status = problem_add(problem, STATUS_INVALID, "/study/max_shift",
                             "must be 0 for a fit of spectra, which do not depend on it");
    return status;
}

// That each parameter is a real number, and each end of its range possible in the scene as it is.
static Status calibrate_check_parameters(const CalibrateStudy *study, const Simulation *simulation,
                                         const SimulationLimits *limits, Problem *own,
                                         Problem *problem) {
    static const char place[] = "/study/parameters";
    const StudyAxes *axes = &study->parameters;
    const Field *rows[CALIBRATE_PARAMETERS];
    bool are_tags[CALIBRATE_PARAMETERS];
    if (axes->count == 0)
        return problem_add(problem, STATUS_INVALID, place,
                           "must have at least one parameter to fit");
    TRY(study_axes_check(axes, false, place, problem));
    Status status = study_axes_find(axes, simulation, place, rows, are_tags, problem);
    for (size_t i = 0; i < axes->count && status != STATUS_NO_MEMORY; i++) {
        if (rows[i] == NULL)
            continue;
        if (!study_field_is_real(rows[i], are_tags[i])) {
            status = problem_add(problem, STATUS_INVALID, json_pointer_at(place, i).at,
                                 "%s is not a real number", study_axis_pointer(&axes->at[i], 0));
            continue;
        }
        for (size_t end = 0; end < 2; end++)
            status = study_first_failure(status, study_axes_check_value(axes, i, end, simulation,
                                                                        &study->names, limits,
                                                                        place, own, problem));
    }
    return status;
}

static Status calibrate_complete(void *request, const Simulation *simulation,
                                 const SimulationLimits *limits, Problem *problem) {
    const CalibrateStudy *study = request;
    Problem *own = malloc(sizeof *own); // of scenes that are tried
    TRY(status_made(own != NULL));
    const Status status =
        study_first_failure(calibrate_check_parameters(study, simulation, limits, own, problem),
                            calibrate_check_measured(study, simulation, limits, own, problem));
    free(own);
    return status;
}

static Status calibrate_cost(const void *request, const Simulation *simulation,
                             const SimulationLimits *limits, double *steps) {
    const CalibrateStudy *study = request;
    const double windows = study->fit == CALIBRATE_PSD ? 1 : 3.4; // in lengths of the last
    Simulation base = {0};
    (void)limits;
    const Status status =
        calibrate_make_base(&study->measured, simulation, simulation->scene.duration, &base);
    if (status == STATUS_OK)
        *steps = calibrate_expect_runs(study, simulation, windows) * simulation_cost(&base).steps;
    simulation_clear(&base);
    return status;
}

static void calibrate_references(void *request, StudyReferences *references) {
    CalibrateStudy *study = request;
    *references = (StudyReferences){
        .axes = &study->parameters, .axes_place = "/study/parameters", .names = &study->names};
}

// --- The answer ---

static const char *calibrate_pointer(const CalibrateWork *work, size_t i) {
    return study_axis_pointer(&work->study->parameters.at[i], 0);
}

// The errors are those of noise: there are none if the model does not explain the motions.
static Status calibrate_report_parameter(CalibrateWork *work, size_t i, const char *unit) {
    const StudyAxis *axis = &work->study->parameters.at[i];
    const CalibrateAssessment *found = &work->assessment;
    CalibratedParameter *parameter = list_append(&work->answer->parameters, sizeof *parameter);
    TRY(status_made(parameter != NULL));
    parameter->value = parameter->standard_error = (double)NAN;
    parameter->identifiable = CHOICE_ABSENT;
    TRY(study_axis_member(axis, &parameter->member));
    TRY(text_copy(unit, &parameter->unit));
    if (work->start_count == 0)
        return STATUS_OK;
    parameter->value = calibrate_value(axis, work->starts[0].fit.at[i]);
    if (work->answer->verdict == CALIBRATE_NOT_EXPLAINED)
        return STATUS_OK;
    parameter->identifiable = found->reasons[i] == UNDETERMINED_NOT;
    if (found->reasons[i] == UNDETERMINED_WIDE)
        return STATUS_OK;
    parameter->standard_error =
        found->errors[i] * (calibrate_is_logarithmic(axis)
                                ? parameter->value * log(axis->to / axis->from)
                                : axis->to - axis->from);
    const double interval[] = {calibrate_value(axis, found->low[i]),
                               calibrate_value(axis, found->high[i])};
    return study_copy_reals(interval, 2, &parameter->interval_95);
}

static double calibrate_correlation(const CalibrateWork *work, size_t i, size_t k) {
    const double *covariance = work->assessment.covariance;
    const size_t n = work->variables;
    const double product = covariance[i * n + i] * covariance[k * n + k];
    return i == k ? 1 : isfinite(product) ? covariance[i * n + k] / sqrt(product) : (double)NAN;
}

static Status calibrate_report_correlation(CalibrateWork *work) {
    for (size_t i = 0; i < work->parameters; i++) {
        Reals *row = list_append(&work->answer->correlation, sizeof *row);
        TRY(status_made(row != NULL && reals_allocate(row, work->parameters)));
        for (size_t k = 0; k < work->parameters; k++)
            row->at[k] = calibrate_correlation(work, i, k);
    }
    return STATUS_OK;
}

static Status calibrate_report_channel(CalibrateWork *work, size_t c) {
    const MeasuredTarget *target = &work->targets[c];
    const MeasuredChannel *measured = target->measured;
    const bool is_spectrum = target->is_spectrum;
    const size_t count = target->values.count;
    const double *own = work->starts[0].residual + target->place;
    CalibrationResidual *residual = list_append(&work->answer->residuals, sizeof *residual);
    CalibrationMotion *motion = list_append(&work->answer->motions, sizeof *motion);
    TRY(status_made(residual != NULL && motion != NULL));
    size_t number;
    const Channel *channel = channel_find(measured->channel, &number);
    residual->measured_rms = is_spectrum ? (double)NAN : measured_rms(measured);
    residual->deviation = is_spectrum ? 10 / log(10) * target->deviation : work->deviations[c];
    residual->samples = target->samples;
    motion->is_spectrum = is_spectrum;
    TRY(text_copy(measured->channel, &residual->channel));
    TRY(text_copy(is_spectrum ? "dB" : channel->unit, &residual->unit));
    TRY(text_copy(measured->channel, &motion->channel));
    TRY(text_copy(is_spectrum ? channel->psd_unit : channel->unit, &motion->unit));
    const size_t stride = (count + MOTION_POINTS - 1) / MOTION_POINTS;
    double squares = 0;
    for (size_t i = 0; i < count; i++) {
        double value = target->values.at[i], fitted = value + target->deviation * own[i];
        double difference = fitted - value, at = measured_time(measured, target->first + i);
        if (is_spectrum) {
            value = calibrate_density(target, value);
            fitted = calibrate_density(target, fitted);
            difference = 10 * log10(fitted / value); // dB
            at = (double)(i + 1) / ((double)target->welch.segment * measured->interval);
        }
        squares += difference * difference;
        if (i % stride != 0)
            continue;
        TRY(study_add_real(at, &motion->at));
        TRY(study_add_real(value, &motion->measured));
        TRY(study_add_real(fitted, &motion->fitted));
    }
    residual->rms = sqrt(squares / (double)count);
    return STATUS_OK;
}

// The sentence if the model does not explain a spectrum. Compared are the frequencies at which the
// measured or the fitted motion stands out from the noise: most of a spectrum may be noise, which
// any model fits.
static Status calibrate_check_spectrum(CalibrateWork *work, const MeasuredTarget *target,
                                       const CalibrationResidual *residual) {
    const double *own = work->starts[0].residual + target->place, deviation = target->deviation;
    const double noise = target->floor * exp(calibrate_quantile_999 * deviation);
    double squares = 0, bins = 0;
    for (size_t i = 0; i < target->values.count; i++) {
        const double value = target->values.at[i];
        if (calibrate_density(target, fmax(value, value + deviation * own[i])) <= noise)
            continue;
        squares += own[i] * own[i];
        bins++;
    }
    // Two estimated spectra, if both are of motions that cannot be predicted.
    const double expected = work->is_chaotic ? 2 : 1;
    const double freedom = fmax(calibrate_independent(work, bins), 1);
    const double scatter = calibrate_chi_square(freedom, calibrate_quantile_999) / freedom;
    const double misfit = work->is_chaotic ? spectrum_misfit_chaos : spectrum_misfit;
    if (squares <= fmax(misfit, scatter) * expected * bins)
        return STATUS_OK;
    return status_made(text_format(
        &work->answer->detail,
        "the spectrum of %s differs from the best fit, where the motion exceeds the noise, by %.2g "
        "times the deviation that is expected of spectra of this length",
        residual->channel, sqrt(squares / (expected * bins))));
}

// The correlation r of neighbouring residuals: the mean square of their differences is 2 (1 - r)
// times the variance, and |r| of noise is about 1 / sqrt(count) (von Neumann 1941).
static double calibrate_neighbours(const double *residual, size_t count) {
    double differences = 0;
    for (size_t i = 1; i < count; i++)
        differences += (residual[i] - residual[i - 1]) * (residual[i] - residual[i - 1]);
    return 1 - differences / (2 * calibrate_sum_squares(residual, count));
}

// The sentence if the model does not explain a channel, whose noise was not given.
static Status calibrate_check_channel_fit(CalibrateWork *work, size_t c) {
    Calibration *answer = work->answer;
    const MeasuredTarget *target = &work->targets[c];
    const CalibrationResidual *residual = &answer->residuals.at[c];
    const char *name = residual->channel, *unit = residual->unit;
    const double rms = residual->rms, motion = residual->measured_rms;
    if (target->is_spectrum)
        return calibrate_check_spectrum(work, target, residual);
    if (rms >= motion)
        return status_made(text_format(&answer->detail,
                                       "the differences of %s from the best fit, %.2g %s rms, are "
                                       "as large as the measured motion, %.2g %s rms",
                                       name, rms, unit, motion, unit));
    const double correlation =
        calibrate_neighbours(work->starts[0].residual + target->place, target->values.count);
    const double noise = 1 / sqrt((double)target->values.count);
    if (!(fabs(correlation) > correlated_errors * noise))
        return STATUS_OK;
    if (rms >= structured * motion || correlation > fmax(smooth_min, smooth_errors * noise))
        return status_made(text_format(
            &answer->detail,
            "the differences of %s from the best fit, %.2g %s rms or %.2g %% of the motion, are "
            "correlated in time, which noise is not. Give a deviation that includes the error of "
            "the model itself, and the fit is compared with that",
            name, rms, unit, 100 * rms / motion));
    return warnings_add(&answer->made.warnings, json_pointer_at("/study/measured", c).at,
                        "the differences of %s from the fit, %.2g %s rms, are correlated in time: "
                        "the true intervals are wider than those given",
                        name, rms, unit);
}

// The sentence if the model does not explain the measured motions.
static Status calibrate_check_fit(CalibrateWork *work) {
    Calibration *answer = work->answer;
    double chi_square = 0;
    size_t given = 0;
    for (size_t c = 0; c < work->study->measured.count; c++) {
        const MeasuredTarget *target = &work->targets[c];
        const size_t count = target->values.count;
        if (target->is_spectrum || isnan(target->measured->deviation)) {
            if (answer->detail == NULL)
                TRY(calibrate_check_channel_fit(work, c));
            continue;
        }
        chi_square += calibrate_sum_squares(work->starts[0].residual + target->place, count);
        given += count;
    }
    if (given == 0)
        return STATUS_OK;
    answer->chi_square = chi_square;
    answer->freedom = given > work->variables ? given - work->variables : 1;
    const double freedom = (double)answer->freedom;
    const double limit = calibrate_chi_square(freedom, calibrate_quantile_999);
    if (answer->detail != NULL || chi_square <= limit)
        return STATUS_OK;
    return status_made(text_format(
        &answer->detail,
        "the differences from the best fit are %.3g times as large as the given deviation: chi "
        "square is %.4g for %.0f degrees of freedom, noise exceeds %.4g once in a thousand times",
        sqrt(chi_square / freedom), chi_square, freedom, limit));
}

// Why a parameter is not identifiable.
static Status calibrate_explain(CalibrateWork *work, size_t i) {
    const CalibrateAssessment *found = &work->assessment;
    const StudyAxis *axis = &work->study->parameters.at[i];
    const char *pointer = calibrate_pointer(work, i);
    char **detail = &work->answer->detail;
    if (found->reasons[i] == UNDETERMINED_RIVAL)
        return status_made(text_format(detail,
                                       "%s is not determined: %.4g and %.4g fit equally well",
                                       pointer, calibrate_value(axis, work->starts[0].fit.at[i]),
                                       calibrate_value(axis, found->rivals[i])));
    if (work->is_chaotic)
        return status_made(text_format(
            detail,
            "%s is not determined: the motion is chaotic, and its spectrum scatters by %.2g dB "
            "from run to run, by more than %s changes it; spectra of a longer record scatter less",
            pointer, sqrt(2) * work->answer->residuals.at[0].deviation, pointer));
    for (size_t k = 0; k < work->parameters; k++)
        if (k != i && found->reasons[k] == UNDETERMINED_WIDE &&
            fabs(calibrate_correlation(work, i, k)) > 0.9)
            return status_made(text_format(detail,
                                           "%s and %s are not determined one by one: only a "
                                           "combination of them is (their correlation is %.4f)",
                                           pointer, calibrate_pointer(work, k),
                                           calibrate_correlation(work, i, k)));
    return status_made(
        text_format(detail,
                    isfinite(found->errors[i])
                        ? "%s is not determined: its 95 %% interval is as wide as its range"
                        : "%s is not determined: it does not change the measured channels",
                    pointer));
}

static Status calibrate_report_verdict(CalibrateWork *work) {
    Calibration *answer = work->answer;
    TRY(calibrate_check_fit(work));
    answer->verdict = answer->detail != NULL ? CALIBRATE_NOT_EXPLAINED : CALIBRATE_NOT_IDENTIFIABLE;
    for (size_t i = 0; i < work->parameters && answer->detail == NULL; i++)
        if (work->assessment.reasons[i] != UNDETERMINED_NOT)
            TRY(calibrate_explain(work, i));
    if (answer->detail != NULL)
        return STATUS_OK;
    answer->verdict = CALIBRATE_EXPLAINED;
    const CalibrationResidual *first = &answer->residuals.at[0];
    return status_made(text_format(
        &answer->detail,
        "the fitted scene explains the measured motions to within their noise (%s: %.3g %s rms), "
        "and they determine all parameters",
        first->channel, first->rms, first->unit));
}

static Status calibrate_warn(CalibrateWork *work) {
    Warnings *warnings = &work->answer->made.warnings;
    const double *at = work->starts[0].fit.at;
    if (work->limit > 0)
        TRY(warnings_add(
            warnings, "/study/measured",
            "small errors grow too fast to predict the motion beyond about %.3g s%s", work->limit,
            work->fit == CALIBRATE_TIME
                ? ": only the samples before were fitted"
                : ", which is too short to determine the parameters: spectra were fitted"));
    else if (work->is_chaotic)
        TRY(warnings_add(warnings, "/study/fit",
                         "the motion cannot be predicted to the end of the record: its spectrum "
                         "changes with the smallest errors, and the fit is accordingly uncertain"));
    for (size_t i = 0; i < work->variables; i++)
        if (at[i] < 1e-9 || at[i] > 1 - 1e-9)
            TRY(warnings_add(warnings,
                             i < work->parameters ? json_pointer_at("/study/parameters", i).at
                                                  : "/study/max_shift",
                             "the best value, %.4g, is the end of the range: a wider range may fit "
                             "better",
                             i < work->parameters
                                 ? calibrate_value(&work->study->parameters.at[i], at[i])
                                 : calibrate_shift(work, at)));
    return STATUS_OK;
}

static Status calibrate_report_fit(CalibrateWork *work) {
    Calibration *answer = work->answer;
    if (work->start_count == 0) {
        answer->verdict = CALIBRATE_NOT_EXPLAINED;
        return status_made(text_format(&answer->detail, "none of the %llu runs ended: see failures",
                                       (unsigned long long)answer->made.runs));
    }
    TRY(calibrate_report_correlation(work));
    for (size_t c = 0; c < work->study->measured.count; c++)
        TRY(calibrate_report_channel(work, c));
    const bool has_shift = work->study->max_shift == 0 || work->fit == CALIBRATE_TIME;
    answer->shift = has_shift ? calibrate_shift(work, work->starts[0].fit.at) : (double)NAN;
    if (work->variables > work->parameters)
        answer->shift_error =
            work->assessment.errors[work->parameters] * 2 * work->study->max_shift;
    TRY(calibrate_report_verdict(work));
    return calibrate_warn(work);
}

static Status calibrate_end(void *of, const StudyTools *tools, Problem *problem) {
    CalibrateWork *work = of;
    const Field *rows[CALIBRATE_PARAMETERS];
    bool are_tags[CALIBRATE_PARAMETERS];
    (void)tools;
    work->answer->fit = work->fit;
    TRY(study_axes_find(&work->study->parameters, work->work.simulation, "/study/parameters", rows,
                        are_tags, problem));
    TRY(calibrate_report_fit(work));
    for (size_t i = 0; i < work->parameters; i++)
        TRY(calibrate_report_parameter(work, i, rows[i]->unit));
    return STATUS_OK;
}

static Status calibrate_solution(const void *request, const Variant *answer, StudyValue *values,
                                 Problem *problem) {
    const CalibrateStudy *study = request;
    const Calibration *calibration = (const Calibration *)(const void *)answer;
    for (size_t i = 0; i < study->parameters.count; i++) {
        values[i] = (StudyValue){NULL, calibration->parameters.at[i].value};
        if (isnan(values[i].number))
            return problem_set(problem, STATUS_NOT_FOUND, "there are no fitted values: %s",
                               calibration->detail);
    }
    return STATUS_OK;
}

const StudyKind study_calibrate = {
    .kind = {"calibrate", "parameters of the scene fitted to measured motions",
             calibrate_study_fields, sizeof(CalibrateStudy)},
    .answer = &(const Kind){"calibrate", "fitted parameters and their uncertainty",
                            calibration_fields, sizeof(Calibration)},
    .shorten = "ask for fewer starts or parameters, or a shorter record",
    .document = "calibration",
    .references = calibrate_references,
    .max_runs = 1000,
    .complete = calibrate_complete,
    .cost = calibrate_cost,
    .work_size = sizeof(CalibrateWork),
    .part_size = sizeof(CalibratePart),
    .begin = calibrate_begin,
    .scene = calibrate_scene,
    .keep = calibrate_keep,
    .fold = calibrate_fold,
    .end = calibrate_end,
    .solution = calibrate_solution,
    .clear = calibrate_clear_part,
    .free = calibrate_free,
};
