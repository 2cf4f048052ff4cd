// The outcome of the reference, the scene as it is, is kept while the others run; of each other run
// only the results of its comparison remain. A variant that cannot run is a row with its reason;
// without the reference there is no answer.
#include "core/study/model_comparison.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NAMES_MAX = 16, ENTRIES_MAX = 24, BUCKETS = 400 }; // buckets of a trace

const char *const compare_status_names[] = {"run", "refused", "failed", NULL};

// clang-format off
static const Field compare_study_fields[] = {
    FIELD_TEXTS(CompareStudy, models, NULL, NULL, NAMES_MAX, PRESENCE_OPTIONAL, 0, "contact models; if absent the scene's own if separations are named, else all"),
    FIELD_TEXTS(CompareStudy, separations, separation_names, NULL, 2, PRESENCE_OPTIONAL, 0, "rules by which linear contacts end; if absent the scene's own if models are named, else both"),
    FIELD_REAL(CompareStudy, part, NULL, WITHIN(1e-6, 1), 0.01, "motions diverge when their displacements differ by this part of the largest displacement"),
    FIELD_REALS(CompareStudy, band, "Hz", AT_MIN(0), 2, PRESENCE_OPTIONAL, "band in which the spectra are compared; if absent that with 99.9 % of the power of the scene's own"),
    FIELD_COUNT(CompareStudy, storey, NULL, AT_MIN(1), OPTIONAL, "whose displacement and mean_acceleration are compared; the first damper's if absent"),
    FIELD_END
};

const Field compare_contacts_fields[] = {
    FIELD_COUNT(CompareContacts, resting, NULL, AT_MIN(0), OPTIONAL, "intervals of persistent contact"),
    FIELD_REAL(CompareContacts, mean_duration, "s", ANY, OPTIONAL, "of the impacts that ended"),
    FIELD_REAL(CompareContacts, mean_approach_speed, "m/s", ANY, OPTIONAL, "of the impacts"),
    FIELD_REAL(CompareContacts, largest_approach_speed, "m/s", ANY, OPTIONAL, "largest of these speeds"),
    FIELD_REAL(CompareContacts, mean_restitution, NULL, ANY, OPTIONAL, "separation over approach speed, of the impacts that ended"),
    FIELD_REAL(CompareContacts, energy_lost, "J", ANY, OPTIONAL, "in all contacts"),
    FIELD_END
};

const Field compare_differences_fields[] = {
    FIELD_REAL(CompareDifferences, peak_displacement, NULL, ANY, OPTIONAL, "ratio to the reference less 1: 0.1 is a tenth more"),
    FIELD_REAL(CompareDifferences, rms_displacement, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(CompareDifferences, peak_acceleration, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(CompareDifferences, rms_acceleration, NULL, ANY, OPTIONAL, "likewise"),
    FIELD_REAL(CompareDifferences, impacts, NULL, ANY, OPTIONAL, "difference of the numbers"),
    FIELD_REAL(CompareDifferences, peak_contact_force, NULL, ANY, OPTIONAL, "ratio to the reference less 1; unknown if impacts have no force"),
    FIELD_END
};

static const Field compare_divergence_fields[] = {
    FIELD_REAL(CompareDivergence, time, "s", ANY, OPTIONAL, "first time at which the displacements differ by the stated part of the largest; unknown: not within the run"),
    FIELD_REAL(CompareDivergence, horizon, "s", ANY, OPTIONAL, "the earlier trust horizon of the two; unknown: neither has one within the run"),
    FIELD_FLAG(CompareDivergence, is_trusted, false, "the time is within the horizon: the contact causes the difference, not rounding"),
    FIELD_TEXT(CompareDivergence, why, 0, PRESENCE_OPTIONAL, 0, "explanation in words"),
    FIELD_END
};

static const Field compare_trace_fields[] = {
    FIELD_REALS(CompareTrace, minimum, "m", ANY, 0, PRESENCE_OPTIONAL, "smallest displacement of each bucket"),
    FIELD_REALS(CompareTrace, maximum, "m", ANY, 0, PRESENCE_OPTIONAL, "largest"),
    FIELD_END
};

static const Field compare_entry_fields[] = {
    FIELD_TEXT(CompareEntry, name, 0, PRESENCE_OPTIONAL, 0, "name for display"),
    FIELD_TEXT(CompareEntry, contact_model, 0, PRESENCE_OPTIONAL, 0, "contact model"),
    FIELD_CHOICE(CompareEntry, separation, separation_names, OPTIONAL, "rule by which its contacts end; unknown if the model needs none"),
    FIELD_CHOICE(CompareEntry, status, compare_status_names, COMPARE_RUN, "run; refused: the scene's buffers do not allow it; failed: the run ended early"),
    FIELD_TEXT(CompareEntry, why, 0, PRESENCE_OPTIONAL, 0, "why it did not run to its end"),
    FIELD_REAL(CompareEntry, steps, NULL, ANY, OPTIONAL, "solver steps"),
    FIELD_LIST(CompareEntry, derived, derived_fields, 0, PRESENCE_DEFAULT, "contact parameters derived from the buffers"),
    FIELD_ITEM(CompareEntry, summary, summary_fields, NULL, PRESENCE_DEFAULT, "as in any result; peak_contact_force is unknown if impacts have no force"),
    FIELD_ITEM(CompareEntry, contacts, compare_contacts_fields, NULL, PRESENCE_DEFAULT, "summary of all impacts"),
    FIELD_ITEM(CompareEntry, differences, compare_differences_fields, NULL, PRESENCE_DEFAULT, "from the reference"),
    FIELD_ITEM(CompareEntry, psd, spectrum_distance_fields, NULL, PRESENCE_DEFAULT, "distance of its spectrum from the reference's"),
    FIELD_ITEM(CompareEntry, displacement, signal_comparison_fields, NULL, PRESENCE_DEFAULT, "comparison with the reference's, in metres"),
    FIELD_ITEM(CompareEntry, divergence, compare_divergence_fields, NULL, PRESENCE_DEFAULT, "time at which it departs from the reference"),
    FIELD_REALS(CompareEntry, density, NULL, ANY, 0, PRESENCE_OPTIONAL, "its spectrum"),
    FIELD_ITEM(CompareEntry, trace, compare_trace_fields, NULL, PRESENCE_DEFAULT, "its displacement, smallest and largest of each bucket of samples"),
    FIELD_END
};

static const Field compare_answer_fields[] = {
    FIELD_COUNT(Comparison, storey, NULL, AT_MIN(1), OPTIONAL, "whose displacement and mean_acceleration are compared"),
    FIELD_REAL(Comparison, part, NULL, ANY, OPTIONAL, "part of the largest displacement by which motions diverge"),
    FIELD_TEXT(Comparison, channel, 0, PRESENCE_OPTIONAL, 0, "of the spectra"),
    FIELD_TEXT(Comparison, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(Comparison, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_REAL(Comparison, trace_rate, "Hz", ANY, OPTIONAL, "buckets per second of the traces"),
    FIELD_COUNT(Comparison, trace_samples, NULL, AT_MIN(1), OPTIONAL, "samples in each bucket"),
    FIELD_LIST(Comparison, entries, compare_entry_fields, 0, PRESENCE_DEFAULT, "the variants; the first is the reference, the scene as it is"),
    FIELD_END
};
// clang-format on

static Status comparison_check_models(const CompareStudy *study, Problem *problem) {
    const char *names[NAMES_MAX + 1] = {NULL};
    for (size_t i = 0, count = 0; contacts[i] != NULL && count < NAMES_MAX; i++)
        if (contacts[i]->form != CONTACT_CHOSEN)
            names[count++] = contacts[i]->kind.name;
    return study_run_check_names(&study->models, names, "models", problem);
}

static Status comparison_check_storey(CompareStudy *study, const Simulation *simulation,
                                      Problem *problem) {
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    if (study->storey == COUNT_ABSENT)
        study->storey = simulation->scene.dampers.at[0].storey;
    if (study->storey <= storeys)
        return STATUS_OK;
    return problem_add_real(problem, STATUS_INVALID, "/study/storey", (double)study->storey, NULL,
                            "must be at most %zu, the number of storeys, is %llu", storeys,
                            (unsigned long long)study->storey);
}

static Status comparison_check_band(const CompareStudy *study, Problem *problem) {
    const Reals *band = &study->band;
    if (band->count == 0 || (band->count == 2 && band->at[0] < band->at[1]))
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/study/band",
                       "must be two rising frequencies in Hz, like [0.5, 15]");
}

static const ContactLaw *comparison_scene_law(const Simulation *simulation) {
    return dampers_contact_law(&simulation->scene.dampers, scene_contact(&simulation->scene));
}

// Defaults are written out, so that equal studies have one canonical form.
static Status comparison_fill_names(CompareStudy *study, const Simulation *simulation) {
    const bool has_models = study->models.count > 0, has_rules = study->separations.count > 0;
    const int own = scene_contact(&simulation->scene)->separation;
    if (has_models && has_rules)
        return STATUS_OK;
    if (has_models)
        return texts_append(
            &study->separations,
            separation_names[own != CHOICE_ABSENT ? own : SEPARATION_ZERO_PENETRATION]);
    if (has_rules)
        return texts_append(&study->models, comparison_scene_law(simulation)->kind.name);
    for (size_t i = 0; contacts[i] != NULL; i++)
        if (contacts[i]->form != CONTACT_CHOSEN)
            TRY(texts_append(&study->models, contacts[i]->kind.name));
    for (int i = 0; separation_names[i] != NULL; i++)
        TRY(texts_append(&study->separations, separation_names[i]));
    return STATUS_OK;
}

static Status comparison_complete(void *request, const Simulation *simulation,
                                  const SimulationLimits *limits, Problem *problem) {
    CompareStudy *study = request;
    (void)limits;
    if (simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "compare needs a damper: the scene has none");
    const Status models = comparison_check_models(study, problem);
    const Status storey = comparison_check_storey(study, simulation, problem);
    const Status band = comparison_check_band(study, problem);
    TRY(comparison_fill_names(study, simulation));
    const SpectrumRequest *psd = &simulation->output.psd;
    const double variants = (double)study->models.count + (double)study->separations.count;
    const double values = psd->channels.count > 0 ? (double)(psd->segment / 2 + 1) * variants : 0;
    const Status densities = study_run_check_densities(simulation, values, problem);
    return study_first_failure(study_first_failure(models, storey),
                               study_first_failure(band, densities));
}

// A rule of separation belongs to linear contacts alone: any other law makes one entry.
static Status comparison_add(CompareEntries *entries, const ContactLaw *law, int separation) {
    char name[96];
    if (law->form != CONTACT_LINEAR)
        separation = CHOICE_ABSENT;
    for (size_t i = 0; i < entries->count; i++)
        if (strcmp(entries->at[i].contact_model, law->kind.name) == 0 &&
            entries->at[i].separation == separation)
            return STATUS_OK;
    if (entries->count == ENTRIES_MAX)
        return STATUS_OK;
    CompareEntry *entry = list_append(entries, sizeof *entry);
    TRY(status_made(entry != NULL));
    (void)fields_default(compare_entry_fields, entry); // absent and 0: nothing to allocate
    entry->separation = separation;
    snprintf(name, sizeof name, "%s%s%s", law->kind.name, separation == CHOICE_ABSENT ? "" : ", ",
             separation == CHOICE_ABSENT ? "" : separation_names[separation]);
    TRY(text_copy(name, &entry->name));
    return text_copy(law->kind.name, &entry->contact_model);
}

// The entries of a completed study without results; the first is the scene as it is.
static Status comparison_list(const CompareStudy *study, const Simulation *simulation,
                              CompareEntries *entries) {
    TRY(comparison_add(entries, comparison_scene_law(simulation),
                       scene_contact(&simulation->scene)->separation));
    for (size_t i = 0; i < study->models.count; i++) {
        const Kind *kind = kind_find(&contact_kinds, study->models.at[i]);
        for (size_t k = 0; k < study->separations.count && kind != NULL; k++) {
            int separation = 0;
            while (strcmp(separation_names[separation], study->separations.at[k]) != 0)
                separation++;
            TRY(comparison_add(entries, (const ContactLaw *)(const void *)kind, separation));
        }
    }
    return STATUS_OK;
}

static Status comparison_set_contact(Simulation *target, const ContactLaw *law, int separation,
                                     Problem *problem) {
    if (law == comparison_scene_law(target) &&
        (law->form != CONTACT_LINEAR || scene_contact(&target->scene)->separation == separation))
        return STATUS_OK;
    if (law->form == CONTACT_IMPULSIVE)
        return simulation_use_impulses(target, problem);
    Variant *contact = variant_new(&law->kind);
    TRY(status_made(contact != NULL));
    if (law->form == CONTACT_LINEAR)
        ((Contact *)(void *)contact)->separation = separation;
    variant_free(target->scene.contact);
    target->scene.contact = contact;
    return STATUS_OK;
}

static Status comparison_set_channel(const Scene *scene, ChannelId channel, uint64_t storey,
                                     Texts *names) {
    texts_clear(names);
    return channel_names_add(scene, channel, (size_t)storey, names);
}

// The simulation under an entry's contact, with the compared channels as its output.
static Status comparison_apply(const CompareStudy *study, const Simulation *simulation,
                               const CompareEntry *entry, const SimulationLimits *limits,
                               Simulation *target, Problem *problem) {
    const Kind *kind = kind_find(&contact_kinds, entry->contact_model);
    Output *output = &target->output;
    TRY(study_run_copy(simulation, target));
    TRY(comparison_set_contact(target, (const ContactLaw *)(const void *)kind, entry->separation,
                               problem));
    TRY(comparison_set_channel(&target->scene, CHANNEL_DISPLACEMENT, study->storey,
                               &output->channels));
    TRY(comparison_set_channel(&target->scene, CHANNEL_MEAN_ACCELERATION, study->storey,
                               &output->psd.channels));
    output->impacts = true;
    return simulation_complete(target, limits, NULL, problem);
}

static Status comparison_cost(const void *request, const Simulation *simulation,
                              const SimulationLimits *limits, double *steps) {
    Comparison answer = {0};
    Status status = comparison_list(request, simulation, &answer.entries);
    *steps = 0;
    for (size_t i = 0; i < answer.entries.count && status == STATUS_OK; i++) {
        Simulation member = {0};
        const Status applied =
            comparison_apply(request, simulation, &answer.entries.at[i], limits, &member, NULL);
        if (applied == STATUS_OK)
            *steps += simulation_cost(&member).steps;
        else if (applied == STATUS_NO_MEMORY)
            status = STATUS_NO_MEMORY;
        simulation_clear(&member);
    }
    fields_clear(compare_answer_fields, &answer);
    return status;
}

// Displacement and mean acceleration of the reference and of another run.
static double comparison_bytes(const Simulation *simulation) {
    return sizeof(double) * 4 * (double)scene_sample_count(&simulation->scene);
}

// Its members are the entries after the first.
typedef struct CompareWork {
    StudyWork work;
    const CompareStudy *study;
    Comparison *answer;
    Outcome *reference;
} CompareWork;

typedef struct ComparePart {
    StudyPart part;
    CompareEntry entry; // without a name
} ComparePart;

static CompareContacts comparison_contacts(const Outcome *outcome) {
    const Impacts *impacts = &outcome->response.impacts;
    CompareContacts contact = {.resting = outcome->response.resting_count,
                               .largest_approach_speed = (double)NAN,
                               .energy_lost = outcome->response.energy.contact};
    double durations = 0, speeds = 0, restitutions = 0, closed = 0, counted = 0;
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *impact = &impacts->at[i];
        if (impact->kind != IMPACT_IMPACT)
            continue;
        counted++;
        speeds += impact->approach_speed;
        contact.largest_approach_speed =
            fmax(contact.largest_approach_speed, impact->approach_speed);
        if (isnan(impact->duration) || isnan(impact->restitution))
            continue;
        closed++;
        durations += impact->duration;
        restitutions += impact->restitution;
    }
    contact.mean_duration = durations / closed;
    contact.mean_restitution = restitutions / closed;
    contact.mean_approach_speed = speeds / counted;
    return contact;
}

static double comparison_relative(double value, double from) {
    return from > 0 ? value / from - 1 : value == from ? 0 : (double)NAN;
}

static CompareDifferences comparison_differences(const Outcome *reference, const Outcome *outcome) {
    const Summary *from = &reference->summary, *to = &outcome->summary;
    return (CompareDifferences){
        comparison_relative(to->peak_displacement, from->peak_displacement),
        comparison_relative(to->rms_displacement, from->rms_displacement),
        comparison_relative(to->peak_acceleration, from->peak_acceleration),
        comparison_relative(to->rms_acceleration, from->rms_acceleration),
        (double)to->impacts - (double)from->impacts,
        comparison_relative(to->peak_contact_force, from->peak_contact_force),
    };
}

static Signal comparison_displacement(const Outcome *outcome) {
    const Response *response = &outcome->response;
    return (Signal){response->series.at[0].values, response->count, response->sample_rate, 0};
}

static Status comparison_fill_divergence(const CompareWork *work, const Outcome *outcome,
                                         CompareEntry *entry) {
    CompareDivergence *divergence = &entry->divergence;
    const double percent = 100 * work->study->part, time = entry->displacement.parting;
    const double horizon =
        fmin(work->reference->summary.trust_horizon, outcome->summary.trust_horizon);
    divergence->time = time;
    divergence->horizon = horizon;
    divergence->is_trusted = !isnan(time) && !(time > horizon);
    return status_made(
        isnan(time) ? text_format(&divergence->why,
                                  "the displacements never differ by more than %g %% of the "
                                  "largest within the run",
                                  percent)
        : divergence->is_trusted
            ? text_format(&divergence->why,
                          "the displacements differ by more than %g %% of the largest from %.6g s "
                          "on, where both trajectories can be trusted: the contact model is the "
                          "cause",
                          percent, time)
            : text_format(&divergence->why,
                          "the displacements differ by more than %g %% of the largest from %.6g s "
                          "on, beyond the trust horizon of %.6g s: rounding alone may be the "
                          "cause, compare statistics",
                          percent, time, horizon));
}

static Status comparison_fill_trace(const Signal *signal, size_t bucket, CompareTrace *trace) {
    for (size_t from = 0; from < signal->count; from += bucket) {
        double min = INFINITY, max = -INFINITY;
        for (size_t k = from; k < signal->count && k < from + bucket; k++) {
            min = fmin(min, signal->values[k]);
            max = fmax(max, signal->values[k]);
        }
        TRY(study_add_real(min, &trace->minimum));
        TRY(study_add_real(max, &trace->maximum));
    }
    return STATUS_OK;
}

// Compares an outcome with the reference.
static Status comparison_measure(const CompareWork *work, const Outcome *outcome,
                                 const Progress *progress, CompareEntry *entry, Problem *problem) {
    static const Field rows[] = {
        FIELD_LIST(PlanReport, derived, derived_fields, 0, PRESENCE_DEFAULT, NULL), FIELD_END};
    const Outcome *reference = work->reference;
    const Reals *band = &work->study->band;
    const Signal from = comparison_displacement(reference), to = comparison_displacement(outcome);
    const Spectrum *spectrum = &outcome->spectrum;
    const double *density = spectrum->densities.at[0].values;
    PlanReport plan; // of it the one list
    entry->contacts = comparison_contacts(outcome);
    entry->differences = comparison_differences(reference, outcome);
    entry->psd = spectrum_distance_measure(
        &reference->spectrum, reference->spectrum.densities.at[0].values, spectrum, density,
        band->count == 2 ? band->at[0] : (double)NAN, band->count == 2 ? band->at[1] : (double)NAN);
    entry->displacement = signal_comparison_measure(&from, &to, work->study->part, progress);
    TRY(study_advance(progress, 1, problem));
    TRY(comparison_fill_divergence(work, outcome, entry));
    TRY(fields_copy(rows, &outcome->plan, &plan));
    entry->derived = plan.derived;
    TRY(study_copy_reals(density, spectrum->densities.rows, &entry->density));
    return comparison_fill_trace(&to, (size_t)work->answer->trace_samples, &entry->trace);
}

static Status comparison_scene(const void *of, size_t member, Simulation *scene, StudyPart *made,
                               Problem *problem) {
    const CompareWork *work = of;
    ComparePart *part = (ComparePart *)(void *)made;
    (void)fields_default(compare_entry_fields, &part->entry); // nothing to allocate
    return comparison_apply(work->study, work->work.simulation,
                            &work->answer->entries.at[member + 1], work->work.limits, scene,
                            problem);
}

static Status comparison_keep(const void *of, const Outcome *outcome, const StudyTools *tools,
                              StudyPart *made, Problem *problem) {
    ComparePart *part = (ComparePart *)(void *)made;
    return comparison_measure(of, outcome, tools->progress, &part->entry, problem);
}

static void comparison_clear(StudyPart *made) {
    ComparePart *part = (ComparePart *)(void *)made;
    fields_clear(compare_entry_fields, &part->entry);
}

static Status comparison_fold(void *of, size_t member, StudyPart *made) {
    const CompareWork *work = of;
    ComparePart *part = (ComparePart *)(void *)made;
    RunRecord *run = &part->part.run;
    CompareEntry *entry = &work->answer->entries.at[member + 1];
    const CompareEntry listed = *entry;
    *entry = part->entry;
    entry->name = listed.name;
    entry->contact_model = listed.contact_model;
    entry->separation = listed.separation;
    entry->status = run->why == NULL        ? COMPARE_RUN
                    : part->part.is_refused ? COMPARE_REFUSED
                                            : COMPARE_FAILED;
    entry->why = run->why;
    entry->steps = run->steps;
    entry->summary = run->summary;
    run->why = NULL;
    (void)fields_default(compare_entry_fields, &part->entry); // its contents have moved
    return STATUS_OK;
}

static void comparison_free(void *of) {
    CompareWork *work = of;
    outcome_unref(work->reference);
}

// A failure of the reference is the study's own.
static Status comparison_run_reference(CompareWork *work, const StudyTools *tools,
                                       Problem *problem) {
    Simulation scene = {0};
    Status status = comparison_apply(work->study, work->work.simulation,
                                     &work->answer->entries.at[0], tools->limits, &scene, problem);
    if (status == STATUS_OK)
        status = study_run_scene(&scene, tools, &work->reference, problem);
    simulation_clear(&scene);
    if (status != STATUS_OK) {
        char detail[sizeof problem->detail];
        text_fit(detail, sizeof detail, problem->detail);
        problem_clear(problem);
        (void)problem_set(problem, status, "the scene itself: %s", detail);
    }
    return status;
}

static Status comparison_begin(void *of, const StudyTools *tools, Problem *problem) {
    CompareWork *work = of;
    const CompareStudy *study = work->study = work->work.study;
    Comparison *answer = work->answer = work->work.answer;
    answer->storey = study->storey;
    answer->part = study->part;
    TRY(comparison_list(study, work->work.simulation, &answer->entries));
    TRY(comparison_run_reference(work, tools, problem));
    const Outcome *reference = work->reference;
    const Columns *densities = &reference->spectrum.densities;
    CompareEntry *first = &answer->entries.at[0];
    answer->trace_samples = (reference->response.count + BUCKETS - 1) / BUCKETS;
    if (answer->trace_samples < 1)
        answer->trace_samples = 1;
    answer->trace_rate = reference->response.sample_rate / (double)answer->trace_samples;
    TRY(text_copy(densities->at[0].name, &answer->channel));
    TRY(text_copy(densities->at[0].unit, &answer->unit));
    TRY(study_copy_reals(reference->spectrum.frequency, densities->rows, &answer->frequency));
    first->steps = reference->steps;
    first->summary = reference->summary;
    TRY(comparison_measure(work, reference, tools->progress, first, problem));
    work->work.members = answer->entries.count - 1;
    work->work.part_bytes =
        sizeof(ComparePart) + sizeof(double) * (answer->frequency.count + (size_t)2 * BUCKETS);
    return STATUS_OK;
}

const StudyKind study_compare = {
    .kind = {"compare", "contact models and separation rules over one scene, side by side",
             compare_study_fields, sizeof(CompareStudy)},
    .answer = &(const Kind){"compare", "results of contact models and rules", compare_answer_fields,
                            sizeof(Comparison)},
    .shorten = "ask for fewer models",
    .complete = comparison_complete,
    .cost = comparison_cost,
    .bytes = comparison_bytes,
    .work_size = sizeof(CompareWork),
    .part_size = sizeof(ComparePart),
    .begin = comparison_begin,
    .scene = comparison_scene,
    .keep = comparison_keep,
    .fold = comparison_fold,
    .clear = comparison_clear,
    .free = comparison_free,
};
