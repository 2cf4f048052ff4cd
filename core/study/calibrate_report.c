// The report of a calibration: values with their errors, residuals, the verdict in words.
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/study/calibrate_internal.h"

enum { MOTION_POINTS = 1000, LAGS = 20 };

static const double structured = 0.05;   // of the motion: rms of residuals that is not explained
static const double spectrum_misfit = 3; // of the expected rms

static const char *calibrate_pointer(const CalibrateWork *work, size_t i) {
    return study_axis_pointer(&work->study->parameters.at[i], 0);
}

static Status calibrate_report_parameter(CalibrateWork *work, size_t i, Simulation *scene) {
    const StudyAxis *axis = &work->study->parameters.at[i];
    const CalibrateStart *best = calibrate_best(work);
    const CalibrateAssessment *found = &work->assessment;
    CalibratedParameter *parameter = list_append(&work->answer->parameters, sizeof *parameter);
    TRY(status_made(parameter != NULL));
    parameter->value = parameter->standard_error = (double)NAN;
    TRY(text_copy(calibrate_pointer(work, i), &parameter->pointer));
    for (size_t k = 0; k < axis->pointers.count; k++)
        TRY(texts_append(&parameter->pointers, axis->pointers.at[k]));
    bool is_tag = false;
    const Field *row = study_axis_find(axis, scene, &is_tag, "", NULL);
    TRY(text_copy(row != NULL ? row->unit : NULL, &parameter->unit));
    if (best == NULL)
        return STATUS_OK;
    const double u = best->at[i];
    parameter->value = calibrate_value(axis, u);
    parameter->is_identifiable = found->reasons[i] == UNDETERMINED_NOT;
    if (found->reasons[i] == UNDETERMINED_WIDE)
        return STATUS_OK;
    parameter->standard_error = found->errors[i] * calibrate_derivative(axis, u);
    TRY(status_made(reals_allocate(&parameter->interval_95, 2)));
    parameter->interval_95.at[0] = calibrate_value_beyond(axis, found->low[i]);
    parameter->interval_95.at[1] = calibrate_value_beyond(axis, found->high[i]);
    return STATUS_OK;
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
    const CalibrateStart *best = calibrate_best(work);
    const size_t count = target->values.count;
    const double *own = best->residual + target->place;
    CalibrationResidual *residual = list_append(&work->answer->residuals, sizeof *residual);
    CalibrationMotion *motion = list_append(&work->answer->motions, sizeof *motion);
    TRY(status_made(residual != NULL && motion != NULL));
    size_t number;
    const MeasuredChannel *measured = target->measured;
    const Channel *channel = channel_find(measured->channel, &number);
    const double decibels = target->is_spectrum ? 10 / log(10) : 1;
    const char *unit = target->is_spectrum ? "dB" : channel->unit;
    residual->rms =
        decibels * target->deviation * sqrt(calibrate_sum_squares(own, count) / (double)count);
    residual->measured_rms = target->is_spectrum ? (double)NAN : measured_rms(measured);
    residual->deviation = decibels * target->deviation;
    residual->samples = target->samples;
    motion->is_spectrum = target->is_spectrum;
    TRY(text_copy(measured->channel, &residual->channel));
    TRY(text_copy(unit, &residual->unit));
    TRY(text_copy(measured->channel, &motion->channel));
    TRY(text_copy(target->is_spectrum ? channel->psd_unit : unit, &motion->unit));
    const size_t stride = (count + MOTION_POINTS - 1) / MOTION_POINTS,
                 points = (count - 1) / stride + 1;
    TRY(status_made(reals_allocate(&motion->at, points) &&
                    reals_allocate(&motion->measured, points) &&
                    reals_allocate(&motion->fitted, points)));
    for (size_t k = 0; k < points; k++) {
        const size_t i = k * stride;
        const double value = target->values.at[i], fitted = value + target->deviation * own[i];
        motion->at.at[k] =
            target->is_spectrum
                ? (double)(i + 1) / ((double)target->welch.segment * measured->interval)
                : measured_time(measured, target->first + i);
        motion->measured.at[k] = target->is_spectrum ? exp(value) : value;
        motion->fitted.at[k] = target->is_spectrum ? exp(fitted) : fitted;
    }
    return STATUS_OK;
}

// Whether residuals are correlated in time (Ljung and Box 1978).
static bool calibrate_is_correlated(const double *residual, size_t count) {
    const double squares = calibrate_sum_squares(residual, count), n = (double)count;
    double sum = 0;
    const size_t lags = count / 4 < LAGS ? count / 4 : LAGS;
    for (size_t lag = 1; lag <= lags; lag++) {
        double products = 0;
        for (size_t i = lag; i < count; i++)
            products += residual[i] * residual[i - lag];
        sum += products * products / (squares * squares) / (n - (double)lag);
    }
    return squares > 0 &&
           n * (n + 2) * sum > calibrate_chi_square((double)lags, calibrate_quantile_999);
}

// Whether the model explains the measured motions, and a sentence if not.
static Status calibrate_check_fit(CalibrateWork *work, bool *is_explained) {
    Calibration *answer = work->answer;
    const CalibrateStart *best = calibrate_best(work);
    double chi_square = 0;
    size_t given = 0;
    *is_explained = true;
    for (size_t c = 0; c < work->study->measured.count && *is_explained; c++) {
        const MeasuredTarget *target = &work->targets[c];
        const CalibrationResidual *residual = &answer->residuals.at[c];
        const double *own = best->residual + target->place;
        const size_t count = target->values.count;
        if (target->is_spectrum) {
            // Two estimated spectra, if both are of motions that cannot be predicted.
            *is_explained = residual->rms < spectrum_misfit * residual->deviation *
                                                (work->is_chaotic ? sqrt(2) : 1);
            if (!*is_explained)
                return status_made(text_format(
                    &answer->detail,
                    "the spectrum of %s differs from the best fit by %.2g dB rms, and %.2g dB "
                    "would be expected of spectra of this length",
                    residual->channel, residual->rms, residual->deviation));
        } else if (!isnan(target->measured->deviation)) {
            chi_square += calibrate_sum_squares(own, count);
            given += count;
        } else if (residual->rms >= residual->measured_rms) {
            *is_explained = false;
            return status_made(text_format(
                &answer->detail,
                "the differences of %s from the best fit, %.2g %s rms, are as large as the "
                "measured motion, %.2g %s rms",
                residual->channel, residual->rms, residual->unit, residual->measured_rms,
                residual->unit));
        } else if (count > 0 && calibrate_is_correlated(own, count)) {
            *is_explained = residual->rms < structured * residual->measured_rms;
            if (!*is_explained)
                return status_made(text_format(
                    &answer->detail,
                    "the differences of %s from the best fit, %.2g %s rms or %.2g %% of the "
                    "motion, are correlated in time, which noise is not",
                    residual->channel, residual->rms, residual->unit,
                    100 * residual->rms / residual->measured_rms));
            TRY(warnings_add(&answer->warnings, json_pointer_at("/study/measured", c).at,
                             "the differences of %s from the fit, %.2g %s rms, are correlated in "
                             "time: the true intervals are wider than those given",
                             residual->channel, residual->rms, residual->unit));
        }
    }
    if (given == 0)
        return STATUS_OK;
    answer->chi_square = chi_square;
    answer->freedom = given > work->variables ? given - work->variables : 1;
    const double freedom = (double)answer->freedom,
                 limit = calibrate_chi_square(freedom, calibrate_quantile_999);
    *is_explained = chi_square <= limit;
    if (!*is_explained)
        return status_made(text_format(&answer->detail,
                                       "the differences from the best fit are %.3g times as large "
                                       "as the given deviation: chi square is %.4g for %.0f "
                                       "degrees of freedom, noise exceeds %.4g once in a thousand "
                                       "times",
                                       sqrt(chi_square / freedom), chi_square, freedom, limit));
    return STATUS_OK;
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
                                       pointer, calibrate_value(axis, calibrate_best(work)->at[i]),
                                       calibrate_value(axis, found->rivals[i])));
    if (found->reasons[i] == UNDETERMINED_BOUND)
        return status_made(text_format(
            detail, "%s ends at %.4g, the end of its range: the best value lies beyond, widen it",
            pointer, calibrate_value(axis, calibrate_best(work)->at[i])));
    size_t partner = i;
    for (size_t k = 0; k < work->parameters; k++)
        if (k != i && found->reasons[k] == UNDETERMINED_WIDE &&
            fabs(calibrate_correlation(work, i, k)) > 0.9)
            partner = k;
    if (partner != i)
        return status_made(text_format(detail,
                                       "%s and %s are not determined one by one: only a "
                                       "combination of them is (their correlation is %.4f)",
                                       pointer, calibrate_pointer(work, partner),
                                       calibrate_correlation(work, i, partner)));
    return status_made(
        text_format(detail,
                    isfinite(found->errors[i])
                        ? "%s is not determined: its 95 %% interval is as wide as its range"
                        : "%s is not determined: it does not change the measured channels",
                    pointer));
}

static Status calibrate_report_verdict(CalibrateWork *work) {
    Calibration *answer = work->answer;
    bool is_explained;
    TRY(calibrate_check_fit(work, &is_explained));
    if (!is_explained) {
        answer->verdict = CALIBRATE_NOT_EXPLAINED;
        // The errors are those of noise, not of the model.
        for (size_t i = 0; i < work->parameters; i++) {
            CalibratedParameter *parameter = &answer->parameters.at[i];
            parameter->standard_error = (double)NAN;
            free(parameter->interval_95.at);
            parameter->interval_95 = (Reals){NULL, 0};
        }
        return STATUS_OK;
    }
    for (size_t i = 0; i < work->parameters; i++)
        if (work->assessment.reasons[i] != UNDETERMINED_NOT) {
            answer->verdict = CALIBRATE_NOT_IDENTIFIABLE;
            return calibrate_explain(work, i);
        }
    answer->verdict = CALIBRATE_EXPLAINED;
    const CalibrationResidual *first = &answer->residuals.at[0];
    return status_made(text_format(
        &answer->detail,
        "the fitted scene explains the measured motions to within their noise (%s: %.3g %s rms), "
        "and they determine all parameters",
        first->channel, first->rms, first->unit));
}

static Status calibrate_warn(CalibrateWork *work) {
    Calibration *answer = work->answer;
    const CalibrateStart *best = calibrate_best(work);
    if (work->is_limited && work->fit == CALIBRATE_TIME)
        TRY(warnings_add(&answer->warnings, "/study/measured",
                         "small errors grow too fast to predict the motion beyond about %.3g s: "
                         "only the samples before were fitted",
                         work->horizon));
    if (work->is_limited && work->fit == CALIBRATE_PSD)
        TRY(warnings_add(&answer->warnings, "/study/fit",
                         "small errors grow too fast to predict the motion beyond about %.3g s, "
                         "which is too short to determine the parameters: spectra were fitted",
                         work->horizon));
    if (work->study->fit == CALIBRATE_PSD && work->is_chaotic)
        TRY(warnings_add(&answer->warnings, "/study/fit",
                         "the motion cannot be predicted to the end of the record: its spectrum "
                         "changes with the smallest errors, and the fit is accordingly uncertain"));
    for (size_t i = 0; i < work->parameters; i++)
        if (best->at[i] < 1e-9 || best->at[i] > 1 - 1e-9)
            TRY(warnings_add(&answer->warnings, json_pointer_at("/study/parameters", i).at,
                             "the best value, %.4g, is the end of the range: a wider range may fit "
                             "better",
                             calibrate_value(&work->study->parameters.at[i], best->at[i])));
    if (calibrate_has_shift(work) && fabs(best->at[work->parameters] - 0.5) > 0.5 - 1e-9)
        TRY(warnings_add(&answer->warnings, "/study/max_shift",
                         "the fitted shift is the largest allowed one"));
    return STATUS_OK;
}
Status calibrate_report(CalibrateWork *work) {
    Calibration *answer = work->answer;
    const CalibrateStart *best = calibrate_best(work);
    Simulation scene = {0};
    answer->fit = work->fit;
    Status status = fields_copy(simulation_fields, work->work.simulation, &scene);
    for (size_t i = 0; i < work->parameters && status == STATUS_OK; i++)
        status = calibrate_report_parameter(work, i, &scene);
    simulation_clear(&scene);
    TRY(status);
    if (best == NULL || best->residual == NULL) {
        answer->verdict = CALIBRATE_NOT_EXPLAINED;
        return status_made(text_format(&answer->detail, "none of the %llu runs ended: see failures",
                                       (unsigned long long)answer->runs));
    }
    TRY(calibrate_report_correlation(work));
    for (size_t c = 0; c < work->study->measured.count; c++)
        TRY(calibrate_report_channel(work, c));
    answer->shift = calibrate_shift(work, best->at);
    if (calibrate_has_shift(work))
        answer->shift_error =
            work->assessment.errors[work->parameters] * 2 * work->study->max_shift;
    TRY(calibrate_report_verdict(work));
    return calibrate_warn(work);
}
