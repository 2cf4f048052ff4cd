// Calibrations of simulated measurements whose parameters are known: how often the 95 % intervals
// contain them, and how often sets of parameters that the measurement determines, or does not, are
// reported as such.
//
//   truth_test_calibrate_c [TRIALS [SEED [KIND]]]
//
// One trial in SPECTRA_SHARE is added whose spectra are fitted.
//
// Which of both a set is follows from the Fisher information at the true values, computed here: it
// is determined if the interval is at most 0.35 of the range half wide, undetermined if it is at
// least as wide as the range; sets between are not counted. Noise is 1 to 10 % of each channel.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/base/philox.h"
#include "core/math/fft.h"
#include "core/math/least_squares.h"
#include "core/study/calibrate.h"
#include "core/study/study.h"
#include "server/json/parse.h"
#include "tests/support/test.h"
#include "tests/truth/drawn.h"

static unsigned long trials = 7;
static uint64_t seed = 1;
static int only = -1;
static Problem problem;

typedef struct Trial {
    char scene[3000], parameters[1500], measured[400], contact[64];
    const char *channels[2];
    size_t channel_count, count;
    double truth[CALIBRATE_PARAMETERS], from[CALIBRATE_PARAMETERS], to[CALIBRATE_PARAMETERS];
    double max_shift, shift;
    bool is_given; // the deviations
    bool is_degenerate, is_spectrum;
} Trial;

static void parameter_add(Trial *trial, Draws *draws, const char *pointer, double truth) {
    const size_t i = trial->count++, at = strlen(trial->parameters);
    const double width = draws_uniform(draws, 0.6, 1.2), below = draws_uniform(draws, 0.25, 0.75);
    trial->truth[i] = truth;
    trial->from[i] = truth * (1 - width * below);
    trial->to[i] = truth * (1 + width * (1 - below));
    snprintf(trial->parameters + at, sizeof trial->parameters - at,
             "%s{\"pointer\": \"%s\", \"from\": %.17g, \"to\": %.17g}", i > 0 ? ", " : "", pointer,
             trial->from[i], trial->to[i]);
}

// Those from MOTIONS on fit spectra.
enum { MOTIONS = 13, KINDS = 16, SPECTRA_SHARE = 4, TIMED = 5 };
static const char *const kind_names[KINDS] = {"free: e, T_c",
                                              "free, no damper: K, damping ratio",
                                              "sine: clearance, e",
                                              "random: clearance, T_c, shift",
                                              "free: K, clearance, e",
                                              "frame: two stiffnesses",
                                              "free: e, T_c, two channels",
                                              "impulse: clearance, e",
                                              "sine: damper mass, clearance",
                                              "M and K, free",
                                              "M, K, damping ratio, random",
                                              "K, e without a contact",
                                              "frame: all masses and stiffnesses",
                                              "spectrum: free, K, damping ratio",
                                              "spectrum: random, K, damping ratio",
                                              "spectrum: frame, stiffness, damping ratio"};

static void trial_draw(Draws *draws, int kind, Trial *trial) {
    *trial = (Trial){.channels = {"displacement"}, .channel_count = 1};
    const double frequency = draws_scattered(draws, 1, 8), omega = 2 * 3.14159265 * frequency;
    const double mass = draws_scattered(draws, 0.5, 50), stiffness = mass * omega * omega;
    const double ratio = draws_scattered(draws, 0.005, 0.04),
                 share = draws_uniform(draws, 0.05, 0.2);
    const double restitution = draws_uniform(draws, 0.35, 0.75);
    const double contact = draws_scattered(draws, 0.03, 0.15) / frequency;
    trial->is_spectrum = kind >= MOTIONS;
    const double cycles = draws_uniform(draws, 12, 25) * (trial->is_spectrum ? 3 : 1);
    double motion = 0.01, clearance = motion * draws_uniform(draws, 0.6, 1.6);
    char excitation[400], structure[400];
    const bool has_damper = kind != 1 && kind != 5 && kind != 9 && kind != 10 && kind < 12;
    const bool is_frame = kind == 5 || kind == 12 || kind == 15;
    snprintf(excitation, sizeof excitation, "{\"kind\": \"free\", \"displacement\": %.17g}",
             motion);
    if (kind == 2 || kind == 8)
        snprintf(excitation, sizeof excitation,
                 "{\"kind\": \"sine\", \"frequency\": %.17g, \"amplitude\": %.17g}",
                 frequency * draws_uniform(draws, 0.9, 1.1), motion * omega * omega * 0.3);
    if (kind == 3 || kind == 10 || kind == 14 || kind == 15)
        snprintf(excitation, sizeof excitation,
                 "{\"kind\": \"random\", \"band\": [0, %.17g], \"rms\": %.17g, \"seed\": %llu}",
                 3 * frequency, motion * omega * omega * 0.4,
                 (unsigned long long)(draws_bits(draws) >> 40));
    snprintf(structure, sizeof structure,
             "{\"mass\": %.17g, \"stiffness\": %.17g, \"damping_ratio\": %.17g}", mass, stiffness,
             ratio);
    if (is_frame) {
        snprintf(structure, sizeof structure,
                 "{\"kind\": \"frame\", \"masses\": [%.17g, %.17g], \"stiffnesses\": [%.17g, "
                 "%.17g], \"damping_ratio\": %.17g}",
                 mass, mass, 2.6 * stiffness, 2.2 * stiffness, ratio);
        if (kind != 15)
            snprintf(excitation, sizeof excitation,
                     "{\"kind\": \"free\", \"displacement\": [%.17g, %.17g]}", 0.4 * motion,
                     motion);
        trial->channels[0] = "displacement_2";
    }
    if (kind == 11)
        clearance = 5 * motion;
    char damper[400] = "";
    if (has_damper)
        snprintf(damper, sizeof damper,
                 "{\"mass\": %.17g, \"clearance\": %.17g, \"buffer\": {\"restitution\": %.17g, "
                 "\"contact_time\": %.17g}}",
                 share * mass, clearance, restitution, contact);
    snprintf(trial->scene, sizeof trial->scene,
             "{\"structure\": %s, \"dampers\": [%s], \"contact\": {\"model\": \"%s\"}, "
             "\"excitation\": %s, \"duration\": %.17g, \"sample_rate\": %.17g",
             structure, damper, kind == 7 ? "impulse" : "auto", excitation, cycles / frequency,
             40 * frequency);
    trial->is_given = draws_chance(draws, 0.5);
    trial->is_degenerate = kind >= 9 && !trial->is_spectrum;
    if (kind == 6) {
        trial->channels[1] = "acceleration";
        trial->channel_count = 2;
        trial->is_given = false;
    }
    if (kind == 3) {
        trial->max_shift = 0.1 / frequency;
        trial->shift = draws_uniform(draws, -0.7, 0.7) * trial->max_shift;
    }
    static const char buffer_e[] = "/dampers/0/buffer/restitution",
                      buffer_t[] = "/dampers/0/buffer/contact_time", gap[] = "/dampers/0/clearance";
    if (kind == 9 || kind == 10)
        parameter_add(trial, draws, "/structure/mass", mass);
    if (kind == 1 || kind == 4 || (kind >= 9 && kind <= 11) || kind == 13 || kind == 14)
        parameter_add(trial, draws, "/structure/stiffness", stiffness);
    if (kind == 1 || kind == 10 || (kind >= 13 && kind <= 15))
        parameter_add(trial, draws, "/structure/damping_ratio", ratio);
    if (kind == 8)
        parameter_add(trial, draws, "/dampers/0/mass", share * mass);
    if (kind == 2 || kind == 3 || kind == 4 || kind == 7 || kind == 8)
        parameter_add(trial, draws, gap, clearance);
    if (kind == 0 || kind == 2 || kind == 4 || kind == 6 || kind == 7 || kind == 11) {
        parameter_add(trial, draws, buffer_e, restitution);
        char *text = strstr(trial->parameters, buffer_e);
        const size_t i = trial->count - 1;
        trial->from[i] = fmax(trial->from[i], 0.05);
        trial->to[i] = fmin(trial->to[i], 0.98);
        sprintf(strstr(text, "\"from\""), "\"from\": %.17g, \"to\": %.17g}", trial->from[i],
                trial->to[i]);
    }
    if (kind == 0 || kind == 3 || kind == 6)
        parameter_add(trial, draws, buffer_t, contact);
    if (kind == 12) {
        parameter_add(trial, draws, "/structure/masses/0", mass);
        parameter_add(trial, draws, "/structure/masses/1", mass);
    }
    if (is_frame) {
        parameter_add(trial, draws, "/structure/stiffnesses/0", 2.6 * stiffness);
        if (kind != 15)
            parameter_add(trial, draws, "/structure/stiffnesses/1", 2.2 * stiffness);
    }
}

static const Kind *study_only(size_t index) {
    return index == 0 ? &study_calibrate.kind : NULL;
}

static const KindTable study_table = {"kind", study_only, true};
static const Field request_fields[] = {
    FIELD_BASE(StudyRequest, simulation, simulation_fields),
    FIELD_VARIANT(StudyRequest, study, &study_table, PRESENCE_OPTIONAL, "the calibration"),
    FIELD_END,
};

static void request_read(const char *text, StudyRequest *request) {
    problem_clear(&problem);
    if (json_parse(text, strlen(text), request_fields, request, &problem) != STATUS_OK ||
        study_request_complete(request, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%.3000s: %s %s", text, problem.faults[0].pointer, problem.detail);
}

// The channels of the scene with other values of the parameters, one after the other.
static void scene_run(const CalibrateStudy *study, const Simulation *simulation, const Trial *trial,
                      const double *values, double *samples, size_t count) {
    Simulation scene;
    Outcome *outcome;
    StudyValue set[CALIBRATE_PARAMETERS];
    for (size_t i = 0; i < trial->count; i++)
        set[i] = (StudyValue){NULL, values[i]};
    if (study_scene_make(simulation, &study->parameters, set, NULL, false, NULL, &scene,
                         &problem) != STATUS_OK ||
        simulation_run(&scene, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    for (size_t c = 0; c < trial->channel_count; c++)
        memcpy(samples + c * count, outcome->response.series.at[c].values, count * sizeof *samples);
    outcome_unref(outcome);
    simulation_clear(&scene);
}

typedef struct Tally {
    unsigned long trials, determined, undetermined, between, wrong_determined, wrong_undetermined,
        not_explained, intervals, contained, lost;
    double cpu, runs, alone, log_width; // of errors over those of the Fisher information
    double cost;                        // largest, over the predicted one
} Tally;
static Tally tallies[KINDS];

static double cpu_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// CPU of a calibration, and of the same runs without it.
static void runs_time(const StudyRequest *request, Tally *tally) {
    Workspace workspace = {0};
    const StudyTools tools = {.workspace = &workspace};
    Variant *answer;
    StudyWork *work;
    double alone = 0;
    const double began = cpu_now();
    if (study_begin(request->study, &request->simulation, &tools, &answer, &work, &problem) !=
        STATUS_OK)
        fail_msg("%s", problem.detail);
    double begun = cpu_now() - began;
    for (size_t i = 0; i < work->wanted; i++) {
        StudyPart *part, *copy = calloc(1, work->kind->part_size);
        Simulation scene = {0};
        Outcome *outcome;
        assert_int_equal(work->kind->scene(work, i, &scene, copy, &problem), STATUS_OK);
        const double run_began = cpu_now();
        if (simulation_run(&scene, NULL, NULL, &workspace, &outcome, &problem) == STATUS_OK)
            outcome_unref(outcome);
        alone += cpu_now() - run_began;
        simulation_clear(&scene);
        free(copy);
        const double part_began = cpu_now();
        assert_int_equal(study_part_make(work, i, &tools, &part, &problem), STATUS_OK);
        assert_int_equal(study_part_fold(work, i, part, &problem), STATUS_OK);
        study_part_free(work, part);
        begun += cpu_now() - part_began;
    }
    assert_int_equal(study_end(work, &tools, &problem), STATUS_OK);
    tally->cpu += begun;
    tally->alone += alone;
    study_free(work);
    variant_free(answer);
    workspace_clear(&workspace);
}

static void trial_run(Draws *draws, int kind, uint64_t number) {
    Trial *trial = calloc(1, sizeof *trial);
    trial_draw(draws, kind, trial);
    const double noise = draws_scattered(draws, 0.01, 0.1);
    // The measured motion, at the times that the shift makes wrong.
    static char text[1 << 20];
    StudyRequest plain, request;
    char names[200];
    snprintf(names, sizeof names, "\"%s\"%s%s%s", trial->channels[0],
             trial->channel_count > 1 ? ", \"" : "",
             trial->channel_count > 1 ? trial->channels[1] : "",
             trial->channel_count > 1 ? "\"" : "");
    const size_t fine = trial->max_shift > 0 ? 50 : 1;
    snprintf(text, sizeof text,
             "%s, \"output\": {\"channels\": [%s], \"psd\": {\"channels\": []}}}", trial->scene,
             names);
    request_read(text, &plain);
    const size_t count = scene_sample_count(&plain.simulation.scene);
    const double rate = plain.simulation.scene.sample_rate;
    plain.simulation.scene.sample_rate = rate * (double)fine; // of a completed scene
    Outcome *outcome;
    if (simulation_run(&plain.simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    double deviation[2], motion_rms[2];
    double *measured = calloc(2 * count, sizeof *measured), true_cost = 0;
    size_t at = (size_t)snprintf(
        text, sizeof text,
        "%s, \"output\": {\"channels\": [%s], \"psd\": {\"channels\": []}}, "
        "\"study\": {\"kind\": \"calibrate\", \"parameters\": [%s], "
        "\"fit\": \"%s\", \"max_shift\": %.17g, \"measured\": [",
        trial->scene, names, trial->parameters,
        calibrate_fit_names[trial->is_spectrum ? CALIBRATE_PSD : CALIBRATE_TIME], trial->max_shift);
    const long moved = lround(trial->shift * rate * (double)fine);
    trial->shift = (double)moved / rate / (double)fine;
    for (size_t c = 0; c < trial->channel_count; c++) {
        const Column *column = columns_find(&outcome->response.series, trial->channels[c]);
        double sum = 0, squares = 0;
        for (size_t i = 0; i < count; i++) {
            const long place = (long)(i * fine) + moved;
            const long last =
                (long)column->values - (long)column->values + (long)outcome->response.count - 1;
            measured[c * count + i] = column->values[place < 0 ? 0 : place > last ? last : place];
            sum += measured[c * count + i];
            squares += measured[c * count + i] * measured[c * count + i];
        }
        const double mean = sum / (double)count;
        motion_rms[c] = sqrt(squares / (double)count - mean * mean);
        deviation[c] = noise * motion_rms[c];
        at += (size_t)snprintf(text + at, sizeof text - at,
                               "%s{\"channel\": \"%s\", \"interval\": %.17g, ", c > 0 ? ", " : "",
                               trial->channels[c], 1 / rate);
        if (trial->is_given)
            at += (size_t)snprintf(text + at, sizeof text - at, "\"deviation\": %.17g, ",
                                   deviation[c]);
        at += (size_t)snprintf(text + at, sizeof text - at, "\"samples\": [");
        for (size_t i = 0; i < count; i++) {
            double normal[2];
            philox_normal_pair(number, 77 + c, i, normal);
            measured[c * count + i] += deviation[c] * normal[0];
            true_cost += normal[0] * normal[0];
            at += (size_t)snprintf(text + at, sizeof text - at, "%s%.17g", i > 0 ? ", " : "",
                                   measured[c * count + i]);
        }
        at += (size_t)snprintf(text + at, sizeof text - at, "]}");
    }
    snprintf(text + at, sizeof text - at, "]}}");
    outcome_unref(outcome);
    request_read(text, &request);
    const CalibrateStudy *study = (const CalibrateStudy *)(const void *)request.study;
    // Fisher information at the truth.
    double *columns[CALIBRATE_PARAMETERS + 1], *base = calloc(2 * count, sizeof *base);
    const double *const *views = (const double *const *)columns;
    for (size_t i = 0; i < trial->count; i++) {
        double values[CALIBRATE_PARAMETERS], width = 1e-5;
        columns[i] = calloc(2 * count, sizeof *base);
        for (int again = 0; again < 3; again++) {
            memset(columns[i], 0, 2 * count * sizeof *base);
            for (int side = 0; side < 2; side++) {
                const double step = width * (trial->to[i] - trial->from[i]);
                memcpy(values, trial->truth, sizeof values);
                values[i] += side == 0 ? step : -step;
                scene_run(study, &request.simulation, trial, values, base, count);
                for (size_t k = 0; k < trial->channel_count * count; k++)
                    columns[i][k] +=
                        (side == 0 ? 1 : -1) * base[k] / (2 * width) / deviation[k / count];
            }
            double squares = 0;
            for (size_t k = 0; k < trial->channel_count * count; k++)
                squares += columns[i][k] * columns[i][k];
            width = fmin(0.5 / sqrt(squares), 1e-4);
        }
    }
    NormalEquations equations;
    double covariance[LEAST_SQUARES_VARIABLES * LEAST_SQUARES_VARIABLES];
    normal_equations_make(views, trial->count, base, trial->channel_count * count, &equations);
    least_squares_covariance(&equations, covariance);
    double widest = 0;
    for (size_t i = 0; i < trial->count; i++)
        widest = fmax(widest, 1.96 * sqrt(covariance[i * trial->count + i]));
    const bool is_determined = !trial->is_degenerate && widest < 0.35;
    const bool is_undetermined = trial->is_degenerate || widest > 1;
    // The calibration.
    Workspace workspace = {0};
    const StudyTools tools = {.workspace = &workspace};
    Variant *made;
    const Status status = study_run(request.study, &request.simulation, &tools, &made, &problem);
    if (status != STATUS_OK)
        fail_msg("%llu: %s %s", (unsigned long long)number, status_slug(status), problem.detail);
    Tally *tally = &tallies[kind];
    const Calibration *answer = (const Calibration *)(const void *)made;
    tally->runs += (double)answer->made.runs;
    double predicted = 0;
    assert_int_equal(study_calibrate.cost(request.study, &request.simulation, NULL, &predicted),
                     STATUS_OK);
    tally->cost = fmax(tally->cost, answer->made.steps / predicted);
    if (number % TIMED == 0)
        runs_time(&request, tally);
    tally->trials++;
    tally->determined += is_determined;
    tally->undetermined += is_undetermined;
    tally->between += !is_determined && !is_undetermined;
    double fit_cost = 0;
    for (size_t c = 0; c < answer->residuals.count; c++)
        fit_cost += pow(answer->residuals.at[c].rms / deviation[c], 2) *
                    (double)answer->residuals.at[c].samples;
    bool is_lost = false, is_all_identified = true;
    for (size_t i = 0; i < trial->count; i++) {
        const CalibratedParameter *parameter = &answer->parameters.at[i];
        is_all_identified &= parameter->identifiable == 1;
        if (!is_determined || parameter->interval_95.count != 2)
            continue;
        const bool is_contained = parameter->interval_95.at[0] <= trial->truth[i] &&
                                  trial->truth[i] <= parameter->interval_95.at[1];
        const double off = fabs(parameter->value - trial->truth[i]) / parameter->standard_error;
        tally->intervals++;
        tally->log_width += log(parameter->standard_error / (trial->to[i] - trial->from[i]) /
                                sqrt(covariance[i * (trial->count + 1)]));
        tally->contained += is_contained;
        is_lost |= off > 6 && !is_contained;
        if (!is_contained && getenv("CALIBRATE_MISSED") != NULL)
            printf("missed %llu kind %d %zu/%zu: off %.2f, outside by %.2g of the interval, cost "
                   "%.6g truth %.6g, "
                   "samples %llu of %zu, widest %.2g %s, error %.2g of the range\n",
                   (unsigned long long)number, kind, i, trial->count, off,
                   fmax(parameter->interval_95.at[0] - trial->truth[i],
                        trial->truth[i] - parameter->interval_95.at[1]) /
                       (parameter->interval_95.at[1] - parameter->interval_95.at[0]),
                   fit_cost, true_cost, (unsigned long long)answer->residuals.at[0].samples, count,
                   widest, answer->fit == CALIBRATE_PSD ? "PSD" : "",
                   parameter->standard_error / (trial->to[i] - trial->from[i]));
        if (getenv("CALIBRATE_VERBOSE") != NULL)
            printf("   %zu: true %.6g fit %.6g +- %.3g (%.1f)\n", i, trial->truth[i],
                   parameter->value, parameter->standard_error, off);
    }
    const bool is_explained = answer->verdict != CALIBRATE_NOT_EXPLAINED;
    tally->not_explained += !is_explained;
    tally->lost += is_lost;
    tally->wrong_determined += is_determined && !is_all_identified;
    tally->wrong_undetermined += is_undetermined && answer->verdict != CALIBRATE_NOT_IDENTIFIABLE;
    if (getenv("CALIBRATE_VERBOSE") != NULL || is_lost || !is_explained ||
        (is_determined && !is_all_identified) ||
        (is_undetermined && answer->verdict != CALIBRATE_NOT_IDENTIFIABLE))
        printf("%llu kind %d noise %.3f widest %.3g cost %.5g, of the truth %.5g, runs %llu: %s: "
               "%s%s\n",
               (unsigned long long)number, kind, noise, widest, fit_cost, true_cost,
               (unsigned long long)answer->made.runs, calibrate_verdict_names[answer->verdict],
               answer->detail, is_lost ? " LOST" : "");
    if (getenv("CALIBRATE_VERBOSE") != NULL)
        for (size_t i = 0; i < answer->made.warnings.count; i++)
            printf("   %s\n", answer->made.warnings.at[i].detail);
    if (getenv("CALIBRATE_HISTORY") != NULL)
        for (size_t i = 0; i < answer->history.count; i++) {
            const CalibrationStep *step = &answer->history.at[i];
            printf("   start %llu until %.3g cost %.6g:", (unsigned long long)step->start,
                   step->until, step->cost);
            for (size_t k = 0; k < step->values.count; k++)
                printf(" %.6g", step->values.at[k]);
            printf(" shift %.4g (%.4g)\n", step->shift, trial->shift);
        }
    variant_free(made);
    workspace_clear(&workspace);
    for (size_t i = 0; i < trial->count; i++)
        free(columns[i]);
    free(base);
    free(measured);
    study_request_clear(&request);
    study_request_clear(&plain);
    free(trial);
}

static void tally_print(const char *name, const Tally *tally) {
    printf("%-36s %5lu trials, determined %4lu (wrong %3lu), not %4lu (wrong %3lu), intervals "
           "%5lu hold %5.1f %%, errors %.2f of the smallest possible, not explained %lu, lost %lu, "
           "runs %.0f, steps at most %.2f of the predicted, CPU over that of the runs "
           "%.2f\n",
           name, tally->trials, tally->determined, tally->wrong_determined, tally->undetermined,
           tally->wrong_undetermined, tally->intervals,
           100 * (double)tally->contained / (double)tally->intervals,
           exp(tally->log_width / (double)tally->intervals), tally->not_explained, tally->lost,
           tally->runs / (double)tally->trials, tally->cost, tally->cpu / tally->alone);
}

static void tally_add(const Tally *tally, Tally *sum) {
    const unsigned long *from = &tally->trials;
    unsigned long *to = &sum->trials;
    for (size_t k = 0; k < 10; k++)
        to[k] += from[k];
    sum->log_width += tally->log_width;
    sum->cost = fmax(sum->cost, tally->cost);
    sum->cpu += tally->cpu;
    sum->runs += tally->runs;
    sum->alone += tally->alone;
}

static void trials_run(unsigned long i, int kind) {
    Draws draws = {(seed * 1000003 + i) * 0x2545f4914f6cdd1dU};
    trial_run(&draws, kind, seed * 1000003 + i);
}

TEST(intervals_contain_the_true_values_and_undetermined_sets_are_reported) {
    Tally sum = {0}, motions = {0}, spectra = {0};
    const char *first = getenv("CALIBRATE_FIRST");
    for (unsigned long i = first ? strtoul(first, NULL, 10) : 0; i < trials; i++)
        trials_run(i, only >= 0 ? only : (int)(i % MOTIONS));
    for (unsigned long i = 0; i < trials / SPECTRA_SHARE && only < 0; i++)
        trials_run(i, MOTIONS + (int)(i % (KINDS - MOTIONS)));
    for (int kind = 0; kind < KINDS; kind++) {
        const Tally *tally = &tallies[kind];
        if (tally->trials == 0)
            continue;
        tally_print(kind_names[kind], tally);
        tally_add(tally, kind < MOTIONS ? &motions : &spectra);
        tally_add(tally, &sum);
    }
    tally_print("motions", &motions);
    tally_print("spectra", &spectra);
    if (trials < 100)
        return;
    const double share = (double)sum.contained / (double)sum.intervals;
    assert_true(share >= 0.92 && share <= 0.98);
    assert_true((double)sum.wrong_determined <= 0.05 * (double)sum.determined);
    assert_true((double)sum.wrong_undetermined <= 0.05 * (double)sum.undetermined);
    assert_true(sum.cost < 5);
}

int main(int argc, char **argv) {
    if (argc > 1)
        trials = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        seed = strtoull(argv[2], NULL, 10);
    if (argc > 3)
        only = atoi(argv[3]);
    fft_start();
    return test_run(0, NULL);
}
