// The fields of a simulation, and their validation: first each field by its row, then the relations
// between fields. Completes the simulation to its canonical form.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/result/response.h"
#include "core/simulation/internal.h"

enum { LABELS = 32, TITLE_BYTES = 200 };

// Every channel of 200 storeys and 64 dampers once, and the default ones.
enum { CHANNELS = 4 * STRUCTURE_STOREYS + 4 * SCENE_DAMPERS + 2 };

static const char *const usual[] = {CHANNEL_USUAL, NULL};

// clang-format off
static const Field psd_fields[] = {
    FIELD_TEXTS(SpectrumRequest, channels, channel_requests, usual, CHANNELS, PRESENCE_DEFAULT, FIELD_NUMBERED, "channels to transform; usual: mean_acceleration of the top storey"),
    FIELD_COUNT(SpectrumRequest, segment, "samples", AT_MIN(1), OPTIONAL, "length of a segment; default min(4096, count)"),
    FIELD_COUNT(SpectrumRequest, overlap, "samples", AT_MIN(0), OPTIONAL, "overlap of adjacent segments; default half a segment"),
    FIELD_CHOICE(SpectrumRequest, window, welch_window_names, WELCH_HANN, "window of each segment"),
    FIELD_CHOICE(SpectrumRequest, detrend, welch_detrend_names, WELCH_DETREND_CONSTANT, "trend removed from each segment"),
    FIELD_END
};

static const Field output_fields[] = {
    FIELD_TEXTS(Output, channels, channel_requests, usual, CHANNELS, PRESENCE_DEFAULT, FIELD_NUMBERED, "channels to sample; with several storeys or dampers each name ends with its number from 1, as in displacement_2; usual: displacement, velocity, acceleration, damper_displacement and contact_force, of all storeys and dampers"),
    FIELD_ITEM_OR_NULL(Output, psd, psd_fields, PRESENCE_DEFAULT, "power spectral densities by Welch's method; null: none"),
    FIELD_FLAG(Output, impacts, true, "whether impacts are listed; false: they are counted, and their peaks and energies are summed"),
    FIELD_FLAG(Output, reduction, true, "whether the summary contains the reduction of peaks and rms by the dampers; the scene without dampers is run too"),
    FIELD_REAL(Output, statistics_from, "s", AT_MIN(0), 0, "start of the interval for rms and peaks"),
    FIELD_END
};

const Field simulation_fields[] = {
    FIELD_BASE(Simulation, scene, scene_fields),
    FIELD_VARIANT(Simulation, accuracy, &solver_kinds, PRESENCE_DEFAULT, "solver and its settings"),
    FIELD_ITEM(Simulation, output, output_fields, NULL, PRESENCE_DEFAULT, "requested results"),
    FIELD_TEXT(Simulation, title, TITLE_BYTES, PRESENCE_OPTIONAL, FIELD_NOTE, "a note; does not affect the result"),
    FIELD_TEXTS(Simulation, labels, NULL, NULL, LABELS, PRESENCE_OPTIONAL, FIELD_NOTE | FIELD_PAIRS, "notes; do not affect the result"),
    FIELD_END
};
// clang-format on

void simulation_clear(Simulation *simulation) {
    fields_clear(simulation_fields, simulation);
}

bool simulation_has_target(const Simulation *simulation) {
    const Variant *accuracy = simulation->accuracy;
    return accuracy->kind == &solvers[0]->kind &&
           !isnan(((const AccuracyAuto *)(const void *)accuracy)->target);
}

static Status validate_overlap(const SpectrumRequest *psd, Problem *problem) {
    if (psd->segment == COUNT_ABSENT || psd->segment == 0 || psd->overlap == COUNT_ABSENT ||
        psd->overlap < psd->segment)
        return STATUS_OK;
    return problem_add_real(problem, STATUS_INVALID, "/output/psd/overlap", (double)psd->overlap,
                            "samples", "must be less than the segment, %llu samples, is %llu",
                            (unsigned long long)psd->segment, (unsigned long long)psd->overlap);
}

// `count` is the number of samples, 0 if another fault leaves it unknown.
static Status validate_psd(SpectrumRequest *psd, size_t count, Warnings *warnings,
                           Problem *problem) {
    if (psd->channels.count == 0) {
        psd->segment = psd->overlap = COUNT_ABSENT;
        psd->window = psd->detrend = CHOICE_ABSENT;
        return STATUS_OK;
    }
    if (psd->window == CHOICE_ABSENT)
        psd->window = WELCH_HANN;
    if (psd->detrend == CHOICE_ABSENT)
        psd->detrend = WELCH_DETREND_CONSTANT;
    TRY(validate_overlap(psd, problem));
    if (count == 0)
        return STATUS_OK;
    if (psd->segment == COUNT_ABSENT)
        psd->segment = count < SPECTRUM_SEGMENT ? count : SPECTRUM_SEGMENT;
    if (psd->segment > count) {
        const bool is_overlap_cut = psd->overlap != COUNT_ABSENT && psd->overlap >= count;
        TRY(warnings_add(warnings, "/output/psd/segment",
                         "is %llu samples, more than there are: cut to %zu%s",
                         (unsigned long long)psd->segment, count,
                         is_overlap_cut ? ", and its overlap to half of that" : ""));
        psd->segment = count;
        if (is_overlap_cut)
            psd->overlap = COUNT_ABSENT;
    }
    if (psd->overlap == COUNT_ABSENT)
        psd->overlap = psd->segment / 2;
    return validate_overlap(psd, problem);
}

static Status validate_output(Simulation *simulation, size_t count, Warnings *warnings,
                              Problem *problem) {
    const Scene *scene = &simulation->scene;
    Output *output = &simulation->output;
    output->reduction = output->reduction && scene->dampers.count > 0;
    const Status faults[] = {
        channel_names_complete(scene, &output->channels, false, "/output/channels", problem),
        channel_names_complete(scene, &output->psd.channels, true, "/output/psd/channels", problem),
    };
    Status status = faults[0] != STATUS_OK ? faults[0] : faults[1];
    // Statistics need at least one sample.
    const double last = count > 0 ? (double)(count - 1) / scene->sample_rate : scene->duration;
    if (scene->duration > 0 && output->statistics_from > last &&
        isfinite(output->statistics_from)) {
        status = problem_add_real(problem, STATUS_INVALID, "/output/statistics_from",
                                  output->statistics_from, "s",
                                  "must not be behind the last sample, within [0, %s] s, is %s",
                                  real_text(last).at, real_text(output->statistics_from).at);
    }
    const Status psd = validate_psd(&output->psd, count, warnings, problem);
    return psd == STATUS_NO_MEMORY || status == STATUS_OK ? psd : status;
}

// Erases settings that the solver does not use.
static Status validate_solver(Simulation *simulation, Problem *problem) {
    const Solver *solver = (const Solver *)(const void *)simulation->accuracy->kind;
    const Scene *scene = &simulation->scene;
    const ContactLaw *law = simulation_law(simulation);
    const bool has_power_law = scene->dampers.count > 0 && law->form == CONTACT_POWER;
    if (solver->forget_unused != NULL)
        solver->forget_unused((Accuracy *)(void *)simulation->accuracy, has_power_law);
    if (!solver->is_linear_only || !has_power_law)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/accuracy/solver",
                       "%s serves linear contact and impulses, not the power law of %s: take "
                       "exact, rk4, newmark or adaptive",
                       solver->kind.name, law->kind.name);
}

// As many modes as storeys are the same as no number.
static Status validate_modes(const Simulation *simulation, Problem *problem) {
    Accuracy *accuracy = (Accuracy *)(void *)simulation->accuracy;
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (accuracy->modes == COUNT_ABSENT)
        return STATUS_OK;
    if (accuracy->modes > storeys)
        return problem_add_real(problem, STATUS_INVALID, "/accuracy/modes", (double)accuracy->modes,
                                NULL,
                                "must be at most %zu, the structure has one mode per storey, is "
                                "%llu",
                                storeys, (unsigned long long)accuracy->modes);
    if (accuracy->modes == storeys)
        accuracy->modes = COUNT_ABSENT;
    return STATUS_OK;
}

bool simulation_has_force(const Simulation *simulation) {
    return simulation->scene.dampers.count > 0 &&
           simulation_law(simulation)->form != CONTACT_IMPULSIVE;
}

Status simulation_check_metric(const Simulation *simulation, const char *metric,
                               const char *pointer, Problem *problem) {
    const bool has_damper = simulation->scene.dampers.count > 0;
    if (strcmp(metric, "psd") == 0 && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if (strstr(metric, "force") != NULL && !simulation_has_force(simulation))
        return problem_add(problem, STATUS_INVALID, pointer, "%s needs contacts with a force: %s",
                           metric,
                           has_damper ? "impulses have none, choose another contact model"
                                      : "the scene has no damper");
    const StructureKind *structure = structure_kind(scene_structure(&simulation->scene));
    if (strcmp(metric, "peak_storey_drift") == 0 && !structure->has_drifts)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "%s needs a structure of the kind frame, this one is of the kind %s",
                           metric, structure->kind.name);
    if (strcmp(metric, "impacts") == 0 && !has_damper)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "impacts needs a damper: the scene has none");
    return STATUS_OK;
}

static Status validate_target(const Simulation *simulation, Problem *problem) {
    AccuracyAuto *asked = (AccuracyAuto *)(void *)simulation->accuracy;
    if (asked->accuracy.modes != COUNT_ABSENT)
        return problem_add_real(
            problem, STATUS_INVALID, "/accuracy/modes", (double)asked->accuracy.modes, NULL,
            "must not be given with a target, which chooses the number of modes");
    if (asked->metric == CHOICE_ABSENT)
        asked->metric = METRIC_DISPLACEMENT;
    return simulation_check_metric(simulation, metric_names[asked->metric], "/accuracy/metric",
                                   problem);
}

static Status validate_accuracy(Simulation *simulation, Problem *problem) {
    TRY(validate_modes(simulation, problem));
    if (simulation_has_target(simulation))
        return validate_target(simulation, problem);
    // Without a target the metric has no meaning.
    if (simulation->accuracy->kind == &solvers[0]->kind)
        ((AccuracyAuto *)(void *)simulation->accuracy)->metric = CHOICE_ABSENT;
    return STATUS_OK;
}

// Limits the sum over all channels, not only the samples of each.
static Status validate_values(const Simulation *simulation, const SimulationLimits *limits,
                              Problem *problem) {
    const Output *output = &simulation->output;
    const double samples = (double)scene_sample_count(&simulation->scene);
    const double columns = (double)(output->channels.count + output->psd.channels.count);
    if (limits == NULL || limits->samples == 0 ||
        samples * columns <= (double)limits->samples * (CHANNEL_COUNT + 1))
        return STATUS_OK;
    return problem_add_real(
        problem, STATUS_INVALID, "/output/channels", (double)output->channels.count, NULL,
        "%.0f channels of %.0f samples are %.3g values, must be at most %.3g: "
        "ask for fewer channels or samples",
        columns, samples, samples * columns, (double)limits->samples * (CHANNEL_COUNT + 1));
}

Status simulation_validate(Simulation *simulation, const SimulationLimits *limits,
                           Warnings *warnings, Problem *problem) {
    const size_t most_samples = limits != NULL ? limits->samples : 0;
    const Status rows = fields_validate(simulation_fields, simulation, "", problem);
    const Status scene = scene_complete(&simulation->scene, most_samples, problem);
    // The problem may contain earlier faults of the caller.
    const bool is_sound = rows == STATUS_OK && scene == STATUS_OK && !problem_concerns(problem, "");
    const size_t count = is_sound ? scene_sample_count(&simulation->scene) : 0;
    Status status = validate_output(simulation, count, warnings, problem);
    TRY(rows);
    TRY(scene);
    if (problem_concerns(problem, ""))
        return problem->status;
    if (status == STATUS_OK)
        status = validate_values(simulation, limits, problem);
    if (status == STATUS_OK)
        status = validate_solver(simulation, problem);
    if (status == STATUS_OK)
        status = validate_accuracy(simulation, problem);
    return status == STATUS_NO_MEMORY ? problem_set(problem, status, "no memory for warnings")
                                      : status;
}

static void simulation_fill_restitution(const DerivedList *derived, Dampers *dampers) {
    for (size_t i = 0; i < derived->count; i++) {
        Damper *damper = &dampers->at[i / 2];
        Buffer *const own = i % 2 == SIDE_LEFT ? &damper->left_buffer : &damper->right_buffer;
        Buffer *buffer = buffer_is_given(own) ? own : &damper->buffer;
        if (buffer->table.count > 0 || !isnan(buffer->restitution))
            continue;
        buffer->restitution = derived->at[i].restitution;
        buffer->stiffness = buffer->damping = (double)NAN;
    }
}

Status simulation_use_impulses(Simulation *simulation, Problem *problem) {
    Plan *plan;
    const char *solver = simulation->accuracy->kind->name;
    TRY(plan_new(&simulation->scene, solver, solver, &plan, problem));
    simulation_fill_restitution(&plan->report.derived, &simulation->scene.dampers);
    plan_free(plan);
    Variant *contact = variant_new(&contact_impulse.kind);
    if (contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a contact model");
    variant_free(simulation->scene.contact);
    simulation->scene.contact = contact;
    return STATUS_OK;
}
