// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/sensitivity.h"

#include <stdlib.h>
#include <string.h>

#include "core/study/input_uncertainty.h"
#include "core/study/parameter_perturbation.h"
#include "core/study/sensitivity_run.h"
#include "core/study/spectrum_accumulator.h"
#include "core/study/study_run.h"
#include "core/study/uncertainty_bands.h"

enum { RUNS = 2000, RUNS_USUAL = 200, SPREADS = 1000 };

// clang-format off
static const char *const buffer_names[] = {
    [SENSITIVITY_BOTH] = "buffer", [SENSITIVITY_LEFT] = "left_buffer", [SENSITIVITY_RIGHT] = "right_buffer", NULL};

const Field sensitivity_spread_fields[] = {
    FIELD_COUNT(SensitivitySpread, damper, NULL, AT_MIN(1), REQUIRED, "number of the damper, from 1"),
    FIELD_CHOICE(SensitivitySpread, buffer, buffer_names, 0, "which of its buffers"),
    FIELD_TEXT(SensitivitySpread, source, 160, PRESENCE_OPTIONAL, 0, "the material and revision that tells it"),
    FIELD_REAL(SensitivitySpread, restitution, NULL, WITHIN(0, 1), OPTIONAL, "relative standard deviation of its restitution; sure if absent"),
    FIELD_REAL(SensitivitySpread, contact_time, NULL, WITHIN(0, 1), OPTIONAL, "likewise of its contact time; of a table all rows are changed by one factor"),
    FIELD_END
};

static const Field study_fields[] = {
    FIELD_TEXTS(SensitivityStudy, parameters, sensitivity_parameter_names, NULL, SENSITIVITY_PARAMETERS, PRESENCE_OPTIONAL, 0, "by what the response is differentiated, of all dampers and sides at once; if absent by all of restitution, contact_time, stiffness, damping, mass (the free masses') and clearance that the scene has"),
    FIELD_REAL(SensitivityStudy, step, NULL, WITHIN(1e-6, 0.2), 0.01, "relative, of the central differences; half and a quarter of it are tried too"),
    FIELD_REAL(SensitivityStudy, restitution_deviation, NULL, WITHIN(0, 0.5), OPTIONAL, "relative standard deviation of every buffer's restitution, 0: it is sure; if absent that of spread"),
    FIELD_REAL(SensitivityStudy, contact_time_deviation, NULL, WITHIN(0, 0.5), OPTIONAL, "likewise of its contact time"),
    FIELD_LIST(SensitivityStudy, spread, sensitivity_spread_fields, SPREADS, PRESENCE_OPTIONAL, "buffer by buffer; if absent what the revisions of the buffers' materials tell of the deviations of restitution and contact_time, of a table the root mean square of its rows"),
    FIELD_COUNT(SensitivityStudy, runs, NULL, WITHIN(0, RUNS), OPTIONAL, "runs with restitution and contact time drawn; 200 if absent, none without a deviation"),
    FIELD_COUNT(SensitivityStudy, seed, NULL, WITHIN(0, 0x1p53 - 1), 1, "of the draws"),
    FIELD_END
};

static const Field stop_fields[] = {
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
    FIELD_REAL(SensitivityStop, by_damper_mass, NULL, ANY, OPTIONAL, "relative change of k_b and of c_b over that of the free mass; 0 where a rig's masses identify them"),
    FIELD_REAL(SensitivityStop, by_structure_mass, NULL, ANY, OPTIONAL, "over that of all masses of the structure together"),
    FIELD_REAL(SensitivityStop, stiffness_deviation, NULL, ANY, OPTIONAL, "relative standard deviation of k_b that follows of the stated ones, to first order"),
    FIELD_REAL(SensitivityStop, damping_deviation, NULL, ANY, OPTIONAL, "of c_b"),
    FIELD_TEXT(SensitivityStop, why, 0, PRESENCE_OPTIONAL, 0, "why there are no closed forms"),
    FIELD_END
};

static const Field slope_fields[] = {
    FIELD_CHOICE(SensitivitySlope, metric, ensemble_metric_names, OPTIONAL, "the summary's number of this name"),
    FIELD_REAL(SensitivitySlope, value, NULL, ANY, OPTIONAL, "of the scene itself"),
    FIELD_REAL(SensitivitySlope, derivative, NULL, ANY, OPTIONAL, "its relative change over the parameter's, by the central difference of the middle step"),
    FIELD_REAL(SensitivitySlope, spread, NULL, ANY, OPTIONAL, "the largest less the smallest of all steps' differences"),
    FIELD_FLAG(SensitivitySlope, is_settled, false, "the spread is at most a tenth of the largest, or 0.001: the steps agree. Where it is not, the number is no derivative"),
    FIELD_END
};

static const Field row_fields[] = {
    FIELD_CHOICE(SensitivityRow, parameter, sensitivity_parameter_names, OPTIONAL, "of all dampers and sides at once"),
    FIELD_REALS(SensitivityRow, steps, NULL, ANY, 0, PRESENCE_OPTIONAL, "relative, to either side; a restitution goes up no farther than to 1"),
    FIELD_LIST(SensitivityRow, slopes, slope_fields, 0, PRESENCE_DEFAULT, "statistic by statistic"),
    FIELD_TEXT(SensitivityRow, why, 0, PRESENCE_OPTIONAL, 0, "why there are none, or why a run of them failed"),
    FIELD_END
};

static const Field band_fields[] = {
    FIELD_CHOICE(SensitivityBand, metric, ensemble_metric_names, OPTIONAL, "the summary's number of this name"),
    FIELD_TEXT(SensitivityBand, unit, 0, PRESENCE_OPTIONAL, 0, "of all that follows"),
    FIELD_COUNT(SensitivityBand, count, NULL, AT_MIN(0), 0, "runs that know it"),
    FIELD_REAL(SensitivityBand, value, NULL, ANY, OPTIONAL, "of the scene itself"),
    FIELD_REAL(SensitivityBand, mean, NULL, ANY, OPTIONAL, "mean over the runs"),
    FIELD_REAL(SensitivityBand, standard_deviation, NULL, ANY, OPTIONAL, "of one run"),
    FIELD_REAL(SensitivityBand, low, NULL, ANY, OPTIONAL, "the interval of the mean begins here, by Student's t"),
    FIELD_REAL(SensitivityBand, high, NULL, ANY, OPTIONAL, "and ends here"),
    FIELD_REAL(SensitivityBand, minimum, NULL, ANY, OPTIONAL, "the smallest"),
    FIELD_REAL(SensitivityBand, q05, NULL, ANY, OPTIONAL, "5 % of the runs are below"),
    FIELD_REAL(SensitivityBand, median, NULL, ANY, OPTIONAL, "half of them are"),
    FIELD_REAL(SensitivityBand, q95, NULL, ANY, OPTIONAL, "95 % are"),
    FIELD_REAL(SensitivityBand, maximum, NULL, ANY, OPTIONAL, "the largest"),
    FIELD_END
};

static const Field failure_fields[] = {
    FIELD_TEXT(EnsembleFailure, reason, 0, PRESENCE_OPTIONAL, 0, "in a word"),
    FIELD_COUNT(EnsembleFailure, count, NULL, AT_MIN(1), 0, "runs that failed so"),
    {.name = "first_run", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(EnsembleFailure, first_seed, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the first of them"},
    FIELD_TEXT(EnsembleFailure, detail, 0, PRESENCE_OPTIONAL, 0, "what that one said"),
    FIELD_END
};

static const Field spectrum_fields[] = {
    FIELD_TEXT(SensitivitySpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(SensitivitySpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(SensitivitySpectrum, value, NULL, ANY, 0, PRESENCE_OPTIONAL, "of the scene itself"),
    FIELD_REALS(SensitivitySpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean of the runs' densities at each frequency"),
    FIELD_REALS(SensitivitySpectrum, q05, NULL, ANY, 0, PRESENCE_OPTIONAL, "5 % of the runs are below, at each frequency for itself"),
    FIELD_REALS(SensitivitySpectrum, median, NULL, ANY, 0, PRESENCE_OPTIONAL, "half of them are"),
    FIELD_REALS(SensitivitySpectrum, q95, NULL, ANY, 0, PRESENCE_OPTIONAL, "95 % are"),
    FIELD_END
};

static const Field draw_fields[] = {
    FIELD_COUNT(SensitivityDraw, run, NULL, AT_MIN(1), OPTIONAL, "its number; what is drawn follows of it and of the seed"),
    FIELD_TEXT(SensitivityDraw, why, 0, PRESENCE_OPTIONAL, 0, "it failed for this reason"),
    FIELD_REALS(SensitivityDraw, restitution, NULL, ANY, 0, PRESENCE_OPTIONAL, "each given buffer's is this times the scene's: damper by damper, that of both sides, left, right"),
    FIELD_REALS(SensitivityDraw, contact_time, NULL, ANY, 0, PRESENCE_OPTIONAL, "likewise"),
    FIELD_ITEM(SensitivityDraw, summary, summary_fields, NULL, PRESENCE_DEFAULT, "as of any run"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_ITEM(Sensitivity, summary, summary_fields, NULL, PRESENCE_DEFAULT, "of the scene itself"),
    FIELD_REAL(Sensitivity, steps, NULL, ANY, 0, "solver steps of all runs, counted"),
    FIELD_LIST(Sensitivity, contact, stop_fields, 0, PRESENCE_DEFAULT, "what errors do to k_b and c_b, stop by stop"),
    FIELD_LIST(Sensitivity, response, row_fields, 0, PRESENCE_DEFAULT, "what changes do to the response, parameter by parameter"),
    FIELD_FLAG(Sensitivity, is_chaotic, false, "the scene goes on beyond its trust horizon"),
    FIELD_TEXT(Sensitivity, why, 0, PRESENCE_OPTIONAL, 0, "what that means for the derivatives of the response"),
    FIELD_COUNT(Sensitivity, runs, NULL, AT_MIN(0), 0, "runs with restitution and contact time drawn, asked for"),
    FIELD_COUNT(Sensitivity, made, NULL, AT_MIN(0), 0, "of those, made"),
    FIELD_COUNT(Sensitivity, failed, NULL, AT_MIN(0), 0, "of those, failed; the others alone are counted in what follows"),
    FIELD_COUNT(Sensitivity, seed, NULL, AT_MIN(0), OPTIONAL, "of the draws"),
    FIELD_REAL(Sensitivity, restitution_deviation, NULL, ANY, OPTIONAL, "relative, stated for all buffers; where it is unknown that of spread was taken"),
    FIELD_REAL(Sensitivity, contact_time_deviation, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_LIST(Sensitivity, spread, sensitivity_spread_fields, 0, PRESENCE_DEFAULT, "the deviations of each buffer, and whose they are"),
    FIELD_TEXT(Sensitivity, distribution, 0, PRESENCE_OPTIONAL, 0, "of the draws, in words"),
    FIELD_REAL(Sensitivity, confidence, NULL, ANY, OPTIONAL, "of the intervals of means"),
    FIELD_LIST(Sensitivity, statistics, band_fields, 0, PRESENCE_DEFAULT, "over the drawn runs"),
    FIELD_LIST(Sensitivity, failures, failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_REALS(Sensitivity, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Sensitivity, spectra, spectrum_fields, 0, PRESENCE_DEFAULT, "the drawn runs' densities, channel by channel"),
    FIELD_LIST(Sensitivity, table, draw_fields, 0, PRESENCE_DEFAULT, "every drawn run"),
    FIELD_END
};
// clang-format on

static Status check_deviation(const Simulation *simulation, double deviation, int parameter,
                              const char *pointer, Problem *problem) {
    const char *why = deviation > 0 ? change_refuse(simulation, parameter) : NULL;
    return why == NULL ? STATUS_OK
                       : problem_add_real(problem, STATUS_INVALID, pointer, deviation, NULL,
                                          "must be left out: %s", why);
}

static Status check_runs(SensitivityStudy *study, const Simulation *simulation, Problem *problem) {
    const bool has_spread = spread_is_there(study);
    if (study->runs == COUNT_ABSENT)
        study->runs = has_spread ? RUNS_USUAL : 0;
    if (study->runs > 0 && !has_spread)
        return problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                "must be 0 or left out without a spread to draw from: give "
                                "restitution_deviation or contact_time_deviation, or materials "
                                "whose revisions tell theirs");
    const SpectrumRequest *psd = &simulation->output.psd;
    if (psd->channels.count == 0 || study->runs == 0)
        return STATUS_OK;
    const double values = (double)psd->channels.count * ((double)(psd->segment / 2) + 1);
    if (values > SPECTRA_VALUES)
        return problem_add_real(problem, STATUS_INVALID, "/output/psd/segment",
                                (double)psd->segment, "samples",
                                "gives %.0f densities of all channels, the study takes at most "
                                "%d: ask for shorter segments or fewer channels",
                                values, SPECTRA_VALUES);
    if (values * (double)study->runs > BAND_DENSITIES)
        return problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                "must be at most %.0f for spectra of %.0f densities, is %llu: ask "
                                "for fewer, or for shorter segments",
                                floor(BAND_DENSITIES / values), values,
                                (unsigned long long)study->runs);
    return STATUS_OK;
}

// Those that the scene has stand for themselves, so that equal studies have one form.
static Status fill_parameters(SensitivityStudy *study, const Simulation *simulation,
                              Problem *problem) {
    if (study->parameters.count > 0)
        return STATUS_OK;
    study->parameters.at = calloc(SENSITIVITY_PARAMETERS, sizeof *study->parameters.at);
    bool is_whole = study->parameters.at != NULL;
    for (int i = 0; i < SENSITIVITY_PARAMETERS && is_whole; i++) {
        if (change_refuse(simulation, i) != NULL)
            continue;
        char *name = strdup(sensitivity_parameter_names[i]);
        study->parameters.at[study->parameters.count] = name;
        study->parameters.count += name != NULL;
        is_whole = name != NULL;
    }
    return is_whole ? STATUS_OK : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status study_complete(Study *asked, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    (void)limits;
    SensitivityStudy *study = (SensitivityStudy *)(void *)asked;
    if (simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "sensitivity is of a damper's numbers: the scene has no damper");
    TRY(spread_complete(study, simulation, problem));
    const Status restitution =
        check_deviation(simulation, study->restitution_deviation, SENSITIVITY_RESTITUTION,
                        "/study/restitution_deviation", problem);
    const Status contact_time =
        check_deviation(simulation, study->contact_time_deviation, SENSITIVITY_CONTACT_TIME,
                        "/study/contact_time_deviation", problem);
    const Status runs = check_runs(study, simulation, problem);
    TRY(fill_parameters(study, simulation, problem));
    return restitution != STATUS_OK ? restitution : contact_time != STATUS_OK ? contact_time : runs;
}

static Status study_cost(const Study *asked, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps, Problem *problem) {
    (void)limits;
    const SensitivityStudy *study = (const SensitivityStudy *)(const void *)asked;
    Simulation member = {0};
    Status status = member_copy(simulation, &member, problem);
    if (status == STATUS_OK)
        status = member_settle(&member, problem);
    if (status == STATUS_OK)
        *steps = (double)sensitivity_runs(study, simulation) * simulation_cost(&member).steps;
    simulation_clear(&member);
    return status;
}

static const Kind sensitivity_answer = {"sensitivity", "what errors of a buffer's numbers do",
                                        answer_fields, sizeof(Sensitivity)};

const StudyKind study_sensitivity = {
    .kind = {"sensitivity",
             "what errors of restitution, contact time and masses do to k_b, c_b and the response",
             study_fields, sizeof(SensitivityStudy)},
    .answer = &sensitivity_answer,
    .lessen = "ask for fewer runs or parameters",
    .complete = study_complete,
    .cost = study_cost,
    .members = &sensitivity_members,
};
