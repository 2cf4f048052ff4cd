// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/model_comparison.h"

#include <stdlib.h>
#include <string.h>

#include "core/study/compare_run.h"
#include "core/study/compare_variants.h"
#include "core/study/spectrum_accumulator.h"

enum { NAMES = 16 };

const char *const compare_status_names[] = {"run", "refused", "failed", NULL};

// clang-format off
static const Field study_fields[] = {
    FIELD_TEXTS(CompareStudy, models, NULL, NULL, NAMES, PRESENCE_OPTIONAL, 0, "contact models; if absent the scene's own where separations are named, else all"),
    FIELD_TEXTS(CompareStudy, separations, separation_names, NULL, 2, PRESENCE_OPTIONAL, 0, "rules by which linear contacts end; if absent the scene's own where models are named, else both"),
    FIELD_REAL(CompareStudy, part, NULL, WITHIN(1e-6, 1), 0.01, "the motions have parted where their displacements differ by this part of the largest displacement"),
    FIELD_REALS(CompareStudy, band, "Hz", AT_MIN(0), 2, PRESENCE_OPTIONAL, "from where to where the spectra are compared; if absent where the scene's own has 99.9 % of its power"),
    FIELD_COUNT(CompareStudy, storey, NULL, AT_MIN(1), OPTIONAL, "whose displacement and mean_acceleration are compared; the first damper's if absent"),
    FIELD_END
};

const Field compare_contacts_fields[] = {
    FIELD_COUNT(CompareContacts, resting, NULL, AT_MIN(0), OPTIONAL, "intervals of persistent contact"),
    FIELD_REAL(CompareContacts, mean_duration, "s", ANY, OPTIONAL, "of the impacts that ended"),
    FIELD_REAL(CompareContacts, mean_approach_speed, "m/s", ANY, OPTIONAL, "of the impacts"),
    FIELD_REAL(CompareContacts, largest_approach_speed, "m/s", ANY, OPTIONAL, "of them"),
    FIELD_REAL(CompareContacts, mean_restitution, NULL, ANY, OPTIONAL, "separation over approach speed, of the impacts that ended"),
    FIELD_REAL(CompareContacts, energy_lost, "J", ANY, OPTIONAL, "in all contacts"),
    FIELD_END
};

const Field compare_differences_fields[] = {
    FIELD_REAL(CompareDifferences, peak_displacement, NULL, ANY, OPTIONAL, "over the reference's, less 1: 0.1 is a tenth more"),
    FIELD_REAL(CompareDifferences, rms_displacement, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(CompareDifferences, peak_acceleration, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(CompareDifferences, rms_acceleration, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(CompareDifferences, impacts, NULL, ANY, OPTIONAL, "how many more"),
    FIELD_REAL(CompareDifferences, peak_contact_force, NULL, ANY, OPTIONAL, "over the reference's, less 1; unknown where impacts have no force"),
    FIELD_END
};

static const Field divergence_fields[] = {
    FIELD_REAL(CompareDivergence, time, "s", ANY, OPTIONAL, "the displacements differ by the stated part of the largest from here on; unknown: not within the run"),
    FIELD_REAL(CompareDivergence, horizon, "s", ANY, OPTIONAL, "the earlier trust horizon of both; unknown: neither has one within the run"),
    FIELD_FLAG(CompareDivergence, is_trusted, false, "the time is within it: it is the contact that parts them, not rounding"),
    FIELD_TEXT(CompareDivergence, why, 0, PRESENCE_OPTIONAL, 0, "in words"),
    FIELD_END
};

static const Field trace_fields[] = {
    FIELD_REALS(CompareTrace, minimum, "m", ANY, 0, PRESENCE_OPTIONAL, "smallest displacement of each bucket"),
    FIELD_REALS(CompareTrace, maximum, "m", ANY, 0, PRESENCE_OPTIONAL, "largest"),
    FIELD_END
};

const Field compare_entry_fields[] = {
    FIELD_TEXT(CompareEntry, name, 0, PRESENCE_OPTIONAL, 0, "for people"),
    FIELD_TEXT(CompareEntry, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model"),
    FIELD_CHOICE(CompareEntry, separation, separation_names, OPTIONAL, "when its contacts end; unknown where the model needs no rule"),
    FIELD_CHOICE(CompareEntry, status, compare_status_names, COMPARE_RUN, "whether it was run: refused is what the scene's buffers do not allow"),
    FIELD_TEXT(CompareEntry, why, 0, PRESENCE_OPTIONAL, 0, "why it was not run to its end"),
    FIELD_REAL(CompareEntry, steps, NULL, ANY, OPTIONAL, "solver steps, counted"),
    FIELD_LIST(CompareEntry, derived, derived_fields, 0, PRESENCE_DEFAULT, "what the buffers came to"),
    FIELD_ITEM(CompareEntry, summary, summary_fields, NULL, PRESENCE_DEFAULT, "as of any run"),
    FIELD_ITEM(CompareEntry, contacts, compare_contacts_fields, NULL, PRESENCE_DEFAULT, "the ledger of impacts as a whole"),
    FIELD_ITEM(CompareEntry, differences, compare_differences_fields, NULL, PRESENCE_DEFAULT, "from the reference"),
    FIELD_ITEM(CompareEntry, psd, distance_fields, NULL, PRESENCE_DEFAULT, "distance of its spectrum from the reference's"),
    FIELD_ITEM(CompareEntry, displacement, likeness_fields, NULL, PRESENCE_DEFAULT, "beside the reference's, in metres"),
    FIELD_ITEM(CompareEntry, divergence, divergence_fields, NULL, PRESENCE_DEFAULT, "when it parts from the reference"),
    FIELD_REALS(CompareEntry, density, NULL, ANY, 0, PRESENCE_OPTIONAL, "its spectrum"),
    FIELD_ITEM(CompareEntry, trace, trace_fields, NULL, PRESENCE_DEFAULT, "its displacement, the least and the largest of each bucket of samples"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_COUNT(Comparison, storey, NULL, AT_MIN(1), OPTIONAL, "whose displacement and mean_acceleration are compared"),
    FIELD_REAL(Comparison, part, NULL, ANY, OPTIONAL, "of the largest displacement, by which motions have parted"),
    FIELD_TEXT(Comparison, channel, 0, PRESENCE_OPTIONAL, 0, "of the spectra"),
    FIELD_TEXT(Comparison, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(Comparison, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_REAL(Comparison, trace_rate, "Hz", ANY, OPTIONAL, "buckets a second of the traces"),
    FIELD_COUNT(Comparison, trace_samples, NULL, AT_MIN(1), OPTIONAL, "samples in each bucket"),
    FIELD_LIST(Comparison, entries, compare_entry_fields, 0, PRESENCE_DEFAULT, "the variants; the first is the reference, the scene as it is"),
    FIELD_END
};
// clang-format on

static Status check_models(const CompareStudy *study, Problem *problem) {
    const char *names[NAMES + 1] = {NULL};
    for (size_t i = 0, count = 0; contacts[i] != NULL && count < NAMES; i++)
        if (contacts[i]->form != CONTACT_CHOSEN)
            names[count++] = contacts[i]->kind.name;
    Status status = STATUS_OK;
    for (size_t i = 0; i < study->models.count; i++) {
        size_t at = 0;
        while (names[at] != NULL && strcmp(names[at], study->models.at[i]) != 0)
            at++;
        if (names[at] != NULL)
            continue;
        char place[sizeof((Fault){0}.pointer)];
        pointer_index(place, sizeof place, "/study/models", i);
        status = texts_refuse(names, study->models.at[i], place, problem);
    }
    return status;
}

static Status check_storey(CompareStudy *study, const Simulation *simulation, Problem *problem) {
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (study->storey == COUNT_ABSENT)
        study->storey = simulation->scene.dampers.at[0].storey;
    if (study->storey <= storeys)
        return STATUS_OK;
    return problem_add_real(problem, STATUS_INVALID, "/study/storey", (double)study->storey, NULL,
                            "must be at most %zu, the number of storeys, is %llu", storeys,
                            (unsigned long long)study->storey);
}

static Status check_band(const CompareStudy *study, Problem *problem) {
    const Reals *band = &study->band;
    if (band->count == 0 || (band->count == 2 && band->at[0] < band->at[1]))
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study/band",
                       "must be two rising frequencies in Hz, like [0.5, 15]");
}

// False without memory.
static bool put_text(Texts *texts, const char *text) {
    char **at = realloc(texts->at, (texts->count + 1) * sizeof *at);
    if (at == NULL)
        return false;
    texts->at = at;
    if ((at[texts->count] = strdup(text)) == NULL)
        return false;
    texts->count++;
    return true;
}

// Names stand for themselves, so that equal studies have one form.
static bool fill_names(CompareStudy *study, const Simulation *simulation) {
    const bool has_models = study->models.count > 0, has_rules = study->separations.count > 0;
    const Contact *own = scene_contact(&simulation->scene);
    bool is_whole = true;
    for (size_t i = 0; contacts[i] != NULL && !has_models && !has_rules && is_whole; i++)
        if (contacts[i]->form != CONTACT_CHOSEN)
            is_whole = put_text(&study->models, contacts[i]->kind.name);
    if (!has_models && has_rules)
        is_whole = put_text(&study->models,
                            dampers_contact_law(&simulation->scene.dampers, own)->kind.name);
    for (int i = 0; separation_names[i] != NULL && !has_models && !has_rules && is_whole; i++)
        is_whole = put_text(&study->separations, separation_names[i]);
    if (has_models && !has_rules)
        is_whole = put_text(
            &study->separations,
            separation_names[own->separation != CHOICE_ABSENT ? own->separation
                                                              : SEPARATION_ZERO_PENETRATION]);
    return is_whole;
}

static Status check_densities(const CompareStudy *study, const Simulation *simulation,
                              Problem *problem) {
    const SpectrumRequest *psd = &simulation->output.psd;
    const double rules = (double)study->separations.count;
    const double values = (double)(psd->segment / 2 + 1) * ((double)study->models.count + rules);
    if (psd->channels.count == 0 || values <= SPECTRA_VALUES)
        return STATUS_OK;
    return problem_add_real(problem, STATUS_INVALID, "/output/psd/segment", (double)psd->segment,
                            "samples",
                            "gives about %.0f densities of all variants, a comparison takes at "
                            "most %d: ask for shorter segments or fewer models",
                            values, SPECTRA_VALUES);
}

static Status study_complete(Study *asked, const Simulation *simulation,
                             const SimulationLimits *limits, Problem *problem) {
    (void)limits;
    CompareStudy *study = (CompareStudy *)(void *)asked;
    if (simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "compare tries contact models: the scene has no damper");
    const Status models = check_models(study, problem);
    const Status storey = check_storey(study, simulation, problem);
    const Status band = check_band(study, problem);
    if (!fill_names(study, simulation))
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    const Status densities = check_densities(study, simulation, problem);
    return models != STATUS_OK   ? models
           : storey != STATUS_OK ? storey
           : band != STATUS_OK   ? band
                                 : densities;
}

static Status study_cost(const Study *asked, const Simulation *simulation,
                         const SimulationLimits *limits, double *steps, Problem *problem) {
    const CompareStudy *study = (const CompareStudy *)(const void *)asked;
    Comparison answer = {0};
    *steps = 0;
    Status status = variants_make(study, simulation, &answer.entries, problem);
    for (size_t i = 0; i < answer.entries.count && status == STATUS_OK; i++) {
        double own;
        status = compare_foretell(study, simulation, &answer.entries.at[i], limits, &own, problem);
        *steps += own;
    }
    fields_clear(answer_fields, &answer);
    return status;
}

static const Kind compare_answer = {"compare", "what contact models and rules came to",
                                    answer_fields, sizeof(Comparison)};

const StudyKind study_compare = {
    .kind = {"compare", "contact models and separation rules over one scene, side by side",
             study_fields, sizeof(CompareStudy)},
    .answer = &compare_answer,
    .lessen = "ask for fewer models",
    .complete = study_complete,
    .cost = study_cost,
    .members = &compare_members,
};
