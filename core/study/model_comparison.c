// A rule of separation is the linear contact's alone: the other forms make one entry each.
// The reference's outcome is kept until all others were set beside it; of each other one only its
// numbers stay. A variant that cannot be is a row with its reason; without the reference there is
// no answer.
// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/model_comparison.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/channel_names.h"
#include "core/simulation/impulse_variant.h"
#include "core/study/spectrum_accumulator.h"
#include "core/study/study_run.h"

enum { COMPARE_ENTRIES_MAX = 24, BUCKETS = 400 }; // entries; of a trace

static const ContactLaw *comparison_scene_law(const Simulation *simulation) {
    return dampers_contact_law(&simulation->scene.dampers, scene_contact(&simulation->scene));
}

static bool comparison_has(const CompareEntries *entries, const ContactLaw *law, int separation) {
    for (size_t i = 0; i < entries->count; i++)
        if (strcmp(entries->at[i].contact_model, law->kind.name) == 0 &&
            entries->at[i].separation == separation)
            return true;
    return false;
}

// False without memory.
static bool comparison_add(CompareEntries *entries, const ContactLaw *law, int separation) {
    if (law->form != CONTACT_LINEAR)
        separation = CHOICE_ABSENT;
    if (comparison_has(entries, law, separation) || entries->count == COMPARE_ENTRIES_MAX)
        return true;
    CompareEntry *at = realloc(entries->at, (entries->count + 1) * sizeof *at);
    if (at == NULL)
        return false;
    entries->at = at;
    CompareEntry *entry = &at[entries->count++];
    char name[96];
    (void)fields_default(compare_entry_fields, entry); // absent and 0: nothing to allocate
    if (separation == CHOICE_ABSENT)
        snprintf(name, sizeof name, "%s", law->kind.name);
    else
        snprintf(name, sizeof name, "%s, %s", law->kind.name, separation_names[separation]);
    entry->name = strdup(name);
    entry->contact_model = strdup(law->kind.name);
    entry->separation = separation;
    return entry->name != NULL && entry->contact_model != NULL;
}

static int comparison_separation(const char *name) {
    for (int i = 0; separation_names[i] != NULL; i++)
        if (strcmp(separation_names[i], name) == 0)
            return i;
    return CHOICE_ABSENT;
}

static bool comparison_add_law(CompareEntries *entries, const ContactLaw *law,
                               const CompareStudy *study) {
    bool is_whole = true;
    for (size_t i = 0; i < study->separations.count && is_whole; i++)
        is_whole = comparison_add(entries, law, comparison_separation(study->separations.at[i]));
    return is_whole;
}

static Status comparison_list(const CompareStudy *study, const Simulation *simulation,
                              CompareEntries *entries, Problem *problem) {
    *entries = (CompareEntries){NULL, 0};
    bool is_whole = comparison_add(entries, comparison_scene_law(simulation),
                                   scene_contact(&simulation->scene)->separation);
    for (size_t i = 0; i < study->models.count && is_whole; i++) {
        const Kind *kind = kind_find(&contact_kinds, study->models.at[i]);
        if (kind != NULL)
            is_whole = comparison_add_law(entries, (const ContactLaw *)(const void *)kind, study);
    }
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's variants");
}

static Status comparison_set_contact(Simulation *target, const ContactLaw *law, int separation,
                                     Problem *problem) {
    if (law == comparison_scene_law(target) &&
        (law->form != CONTACT_LINEAR || scene_contact(&target->scene)->separation == separation))
        return STATUS_OK;
    if (law->form == CONTACT_IMPULSIVE)
        return impulses_take(target, problem);
    Variant *contact = variant_new(&law->kind);
    if (contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a contact model");
    if (law->form == CONTACT_LINEAR)
        ((Contact *)(void *)contact)->separation = separation;
    variant_free(target->scene.contact);
    target->scene.contact = contact;
    return STATUS_OK;
}

static Status comparison_set_channel(const Scene *scene, ChannelId channel, uint64_t storey,
                                     Texts *names, Problem *problem) {
    char name[CHANNEL_NAME];
    request_channel_name(scene, channel, (size_t)storey, name);
    for (size_t i = 0; i < names->count; i++)
        free(names->at[i]);
    free(names->at);
    *names = (Texts){calloc(1, sizeof *names->at), 0};
    if (names->at != NULL && (names->at[0] = strdup(name)) != NULL)
        names->count = 1;
    return names->count == 1 ? STATUS_OK
                             : problem_set(problem, STATUS_NO_MEMORY, "no memory for a channel");
}

static Status comparison_apply(const CompareStudy *study, const Simulation *simulation,
                               const CompareEntry *entry, const SimulationLimits *limits,
                               Simulation *target, Problem *problem) {
    const Kind *kind = kind_find(&contact_kinds, entry->contact_model);
    Output *output = &target->output;
    TRY(study_run_copy(simulation, target, problem));
    TRY(study_run_fix_solver(target, problem));
    TRY(comparison_set_contact(target, (const ContactLaw *)(const void *)kind, entry->separation,
                               problem));
    TRY(comparison_set_channel(&target->scene, CHANNEL_DISPLACEMENT, study->storey,
                               &output->channels, problem));
    TRY(comparison_set_channel(&target->scene, CHANNEL_MEAN_ACCELERATION, study->storey,
                               &output->psd.channels, problem));
    output->impacts = true;
    return simulation_complete(target, limits, NULL, problem);
}

// What the study has at hand. Its members are the entries after the first.
typedef struct CompareWork {
    StudyWork work;
    const CompareStudy *study;
    const Simulation *simulation;
    Comparison *answer;
    Outcome *reference;
} CompareWork;

static Status comparison_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

static bool comparison_copy_reals(Reals *target, const double *values, size_t count) {
    if (!reals_make(target, count))
        return false;
    memcpy(target->at, values, count * sizeof *values);
    return true;
}

static bool comparison_copy_derived(const DerivedList *from, DerivedList *target) {
    target->at = calloc(from->count + 1, sizeof *target->at);
    while (target->at != NULL && target->count < from->count) {
        const size_t i = target->count;
        if (fields_copy(derived_fields, &from->at[i], &target->at[i]) != STATUS_OK)
            return false;
        target->count++;
    }
    return target->at != NULL;
}

static bool comparison_has_force(const Outcome *outcome) {
    const ContactLaw *law =
        (const ContactLaw *)(const void *)kind_find(&contact_kinds, outcome->plan.contact_model);
    return law != NULL && law->form != CONTACT_IMPULSIVE;
}

static CompareContacts comparison_contacts(const Outcome *outcome) {
    const Impacts *impacts = &outcome->response.impacts;
    CompareContacts told = {.resting = outcome->response.resting_count,
                            .largest_approach_speed = (double)NAN,
                            .energy_lost = outcome->response.energy.contact};
    double durations = 0, speeds = 0, restitutions = 0, closed = 0, counted = 0;
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *impact = &impacts->at[i];
        if (impact->kind != IMPACT_IMPACT)
            continue;
        counted++;
        speeds += impact->approach_speed;
        told.largest_approach_speed = fmax(told.largest_approach_speed, impact->approach_speed);
        if (isnan(impact->duration) || isnan(impact->restitution))
            continue;
        closed++;
        durations += impact->duration;
        restitutions += impact->restitution;
    }
    told.mean_duration = durations / closed;
    told.mean_restitution = restitutions / closed;
    told.mean_approach_speed = speeds / counted;
    return told;
}

static double comparison_relative(double value, double from) {
    return from > 0 ? value / from - 1 : value == from ? 0 : (double)NAN;
}

static CompareDifferences comparison_differences(const Outcome *reference, const Outcome *outcome) {
    const Summary *from = &reference->summary, *to = &outcome->summary;
    const bool both = comparison_has_force(reference) && comparison_has_force(outcome);
    return (CompareDifferences){
        comparison_relative(to->peak_displacement, from->peak_displacement),
        comparison_relative(to->rms_displacement, from->rms_displacement),
        comparison_relative(to->peak_acceleration, from->peak_acceleration),
        comparison_relative(to->rms_acceleration, from->rms_acceleration),
        (double)to->impacts - (double)from->impacts,
        both ? comparison_relative(to->peak_contact_force, from->peak_contact_force) : (double)NAN,
    };
}

static Signal comparison_displacement(const Outcome *outcome) {
    const Response *response = &outcome->response;
    return (Signal){response->series.at[0].values, response->count, response->sample_rate, 0};
}

static Status comparison_fill_divergence(const CompareWork *work, const Outcome *outcome,
                                         CompareEntry *entry, Problem *problem) {
    CompareDivergence *told = &entry->divergence;
    const double percent = 100 * work->study->part;
    char text[240];
    told->time = entry->displacement.parting;
    told->horizon = fmin(work->reference->summary.trust_horizon, outcome->summary.trust_horizon);
    told->is_trusted = !isnan(told->time) && !(told->time > told->horizon);
    if (isnan(told->time))
        snprintf(text, sizeof text,
                 "the displacements never differ by more than %g %% of the largest within the run",
                 percent);
    else if (told->is_trusted)
        snprintf(text, sizeof text,
                 "the displacements differ by more than %g %% of the largest from %.6g s on, where "
                 "both trajectories can be trusted: it is the contact's doing",
                 percent, told->time);
    else
        snprintf(text, sizeof text,
                 "the displacements differ by more than %g %% of the largest from %.6g s on, "
                 "beyond the trust horizon of %.6g s: rounding alone may have parted them, compare "
                 "statistics",
                 percent, told->time, told->horizon);
    told->why = strdup(text);
    return told->why != NULL ? STATUS_OK : comparison_no_memory(problem);
}

static Status comparison_fill_trace(const Outcome *outcome, uint64_t bucket, CompareEntry *entry,
                                    Problem *problem) {
    const Signal signal = comparison_displacement(outcome);
    const size_t count = (signal.count + (size_t)bucket - 1) / (size_t)bucket;
    CompareTrace *trace = &entry->trace;
    if (!reals_make(&trace->minimum, count) || !reals_make(&trace->maximum, count))
        return comparison_no_memory(problem);
    for (size_t i = 0; i < count; i++) {
        double least = INFINITY, most = -INFINITY;
        for (size_t k = i * (size_t)bucket; k < signal.count && k < (i + 1) * (size_t)bucket; k++) {
            least = fmin(least, signal.values[k]);
            most = fmax(most, signal.values[k]);
        }
        trace->minimum.at[i] = least;
        trace->maximum.at[i] = most;
    }
    return STATUS_OK;
}

// What all entries have in common is the reference's.
static Status comparison_fill_common(CompareWork *work, Problem *problem) {
    Comparison *answer = work->answer;
    const Outcome *reference = work->reference;
    const Spectrum *spectrum = &reference->spectrum;
    const size_t count = reference->response.count;
    answer->trace_samples = (count + BUCKETS - 1) / BUCKETS;
    if (answer->trace_samples < 1)
        answer->trace_samples = 1;
    answer->trace_rate = reference->response.sample_rate / (double)answer->trace_samples;
    answer->channel = strdup(spectrum->densities.at[0].name);
    answer->unit = strdup(spectrum->densities.at[0].unit);
    return answer->channel != NULL && answer->unit != NULL &&
                   comparison_copy_reals(&answer->frequency, spectrum->frequency,
                                         spectrum->densities.rows)
               ? STATUS_OK
               : comparison_no_memory(problem);
}

static Status comparison_measure(const CompareWork *work, const Outcome *outcome,
                                 const Progress *progress, CompareEntry *entry, Problem *problem) {
    const Outcome *reference = work->reference;
    const Reals *band = &work->study->band;
    const Signal from = comparison_displacement(reference), to = comparison_displacement(outcome);
    const Spectrum *spectrum = &outcome->spectrum;
    entry->status = COMPARE_RUN;
    entry->steps = outcome->steps;
    entry->summary = outcome->summary;
    entry->contacts = comparison_contacts(outcome);
    entry->differences = comparison_differences(reference, outcome);
    entry->psd = distance_measure(&reference->spectrum, reference->spectrum.densities.at[0].values,
                                  spectrum, spectrum->densities.at[0].values,
                                  band->count == 2 ? band->at[0] : (double)NAN,
                                  band->count == 2 ? band->at[1] : (double)NAN);
    entry->displacement = likeness_measure(&from, &to, work->study->part, progress);
    if (!progress_advance(progress, 1))
        return problem_set(problem, STATUS_CANCELLED, "stopped at a comparison");
    TRY(comparison_fill_divergence(work, outcome, entry, problem));
    if (!comparison_copy_derived(&outcome->plan.derived, &entry->derived) ||
        !comparison_copy_reals(&entry->density, spectrum->densities.at[0].values,
                               spectrum->densities.rows))
        return comparison_no_memory(problem);
    return comparison_fill_trace(outcome, work->answer->trace_samples, entry, problem);
}

// Runs an entry, whose name is the answer's and whose numbers are `told`.
static Status comparison_run(const CompareWork *work, size_t index, const StudyTools *tools,
                             Outcome **outcome, CompareEntry *told, Problem *problem) {
    Simulation member = {0};
    *outcome = NULL;
    told->status = COMPARE_REFUSED;
    Status status =
        comparison_apply(work->study, work->simulation, &work->answer->entries.at[index],
                         tools->limits, &member, problem);
    if (status == STATUS_OK) {
        told->status = COMPARE_FAILED;
        status = simulation_run(&member, tools->limits, tools->progress, tools->workspace, outcome,
                                problem);
    }
    simulation_clear(&member);
    return status;
}

static void comparison_drop(void *part) {
    if (part == NULL)
        return;
    fields_clear(compare_entry_fields, part);
    free(part);
}

static Status comparison_make(const StudyWork *of, size_t index, const StudyTools *tools,
                              void **made, Problem *problem) {
    const CompareWork *work = (const CompareWork *)(const void *)of;
    CompareEntry *part = calloc(1, sizeof *part);
    Outcome *outcome;
    *made = part;
    if (part == NULL)
        return comparison_no_memory(problem);
    (void)fields_default(compare_entry_fields, part); // absent and 0: nothing to allocate
    Status status = comparison_run(work, index + 1, tools, &outcome, part, problem);
    if (status == STATUS_OK) {
        status = comparison_measure(work, outcome, tools->progress, part, problem);
    } else if (!study_run_ends_all(status)) {
        part->why = study_run_why(problem);
        problem_clear(problem);
        status = part->why != NULL ? STATUS_OK : comparison_no_memory(problem);
    }
    outcome_unref(outcome);
    return status;
}

// Numbers of a part; its name and contact stay the entry's own.
static void comparison_move_entry(CompareEntry *entry, CompareEntry *part) {
    const CompareEntry named = *entry;
    *entry = *part;
    entry->name = named.name;
    entry->contact_model = named.contact_model;
    entry->separation = named.separation;
    (void)fields_default(compare_entry_fields, part);
}

static Status comparison_fold(StudyWork *of, size_t index, void *part, Problem *problem) {
    (void)problem;
    comparison_move_entry(&((CompareWork *)(void *)of)->answer->entries.at[index + 1], part);
    return STATUS_OK;
}

static void comparison_free(StudyWork *of) {
    CompareWork *work = (CompareWork *)(void *)of;
    outcome_unref(work->reference);
    free(work);
}

// A failure to come to a reference is the study's own.
static Status comparison_make_reference(CompareWork *work, const StudyTools *tools,
                                        Problem *problem) {
    CompareEntry told;
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return comparison_no_memory(problem);
    (void)fields_default(compare_entry_fields, &told);
    Status status = comparison_run(work, 0, tools, &work->reference, &told, fault);
    if (status != STATUS_OK)
        (void)problem_set(problem, status, "the scene itself: %s", fault->detail);
    else
        status = comparison_fill_common(work, problem);
    if (status == STATUS_OK)
        status = comparison_measure(work, work->reference, tools->progress, &told, problem);
    if (status == STATUS_OK)
        comparison_move_entry(&work->answer->entries.at[0], &told);
    fields_clear(compare_entry_fields, &told);
    free(fault);
    return status;
}

static Status comparison_predict(const CompareStudy *study, const Simulation *simulation,
                                 const CompareEntry *entry, const SimulationLimits *limits,
                                 double *steps, Problem *problem) {
    Simulation member = {0};
    Problem *fault = calloc(1, sizeof *fault);
    *steps = 0;
    if (fault == NULL)
        return comparison_no_memory(problem);
    const Status status = comparison_apply(study, simulation, entry, limits, &member, fault);
    if (status == STATUS_OK)
        *steps = simulation_cost(&member).steps;
    simulation_clear(&member);
    free(fault);
    return status == STATUS_NO_MEMORY ? comparison_no_memory(problem) : STATUS_OK;
}

static Status comparison_begin(const Study *asked, const Simulation *simulation,
                               const StudyTools *tools, Variant *told, StudyWork **made,
                               Problem *problem) {
    const CompareStudy *study = (const CompareStudy *)(const void *)asked;
    Comparison *answer = (Comparison *)(void *)told;
    CompareWork *work = calloc(1, sizeof *work);
    if (work == NULL)
        return comparison_no_memory(problem);
    *work = (CompareWork){.study = study, .simulation = simulation, .answer = answer};
    answer->storey = study->storey;
    answer->part = study->part;
    Status status = comparison_list(study, simulation, &answer->entries, problem);
    if (status == STATUS_OK)
        status = comparison_make_reference(work, tools, problem);
    if (status != STATUS_OK) {
        comparison_free(&work->work);
        return status;
    }
    const size_t members = answer->entries.count - 1, rows = answer->frequency.count;
    work->work =
        (StudyWork){.kind = &study_compare,
                    .members = members,
                    .wanted = members,
                    .expected = members,
                    .bytes = outcome_bytes(work->reference),
                    .part_bytes = sizeof(CompareEntry) + sizeof(double) * (rows + 2 * BUCKETS)};
    *made = &work->work;
    return STATUS_OK;
}

static const StudyMembers comparison_members = {
    .begin = comparison_begin,
    .make = comparison_make,
    .fold = comparison_fold,
    .drop = comparison_drop,
    .free = comparison_free,
};

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

static Status comparison_check_models(const CompareStudy *study, Problem *problem) {
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

// False without memory.
static bool comparison_add_text(Texts *texts, const char *text) {
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
static bool comparison_fill_names(CompareStudy *study, const Simulation *simulation) {
    const bool has_models = study->models.count > 0, has_rules = study->separations.count > 0;
    const Contact *own = scene_contact(&simulation->scene);
    bool is_whole = true;
    for (size_t i = 0; contacts[i] != NULL && !has_models && !has_rules && is_whole; i++)
        if (contacts[i]->form != CONTACT_CHOSEN)
            is_whole = comparison_add_text(&study->models, contacts[i]->kind.name);
    if (!has_models && has_rules)
        is_whole = comparison_add_text(
            &study->models, dampers_contact_law(&simulation->scene.dampers, own)->kind.name);
    for (int i = 0; separation_names[i] != NULL && !has_models && !has_rules && is_whole; i++)
        is_whole = comparison_add_text(&study->separations, separation_names[i]);
    if (has_models && !has_rules)
        is_whole = comparison_add_text(
            &study->separations,
            separation_names[own->separation != CHOICE_ABSENT ? own->separation
                                                              : SEPARATION_ZERO_PENETRATION]);
    return is_whole;
}

static Status comparison_check_densities(const CompareStudy *study, const Simulation *simulation,
                                         Problem *problem) {
    const SpectrumRequest *psd = &simulation->output.psd;
    const double rules = (double)study->separations.count;
    const double values = (double)(psd->segment / 2 + 1) * ((double)study->models.count + rules);
    if (psd->channels.count == 0 || values <= STUDY_DENSITIES_MAX)
        return STATUS_OK;
    return problem_add_real(problem, STATUS_INVALID, "/output/psd/segment", (double)psd->segment,
                            "samples",
                            "gives about %.0f densities of all variants, a comparison takes at "
                            "most %d: ask for shorter segments or fewer models",
                            values, STUDY_DENSITIES_MAX);
}

static Status comparison_complete(Study *asked, const Simulation *simulation,
                                  const SimulationLimits *limits, Problem *problem) {
    (void)limits;
    CompareStudy *study = (CompareStudy *)(void *)asked;
    if (simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "compare tries contact models: the scene has no damper");
    const Status models = comparison_check_models(study, problem);
    const Status storey = comparison_check_storey(study, simulation, problem);
    const Status band = comparison_check_band(study, problem);
    if (!comparison_fill_names(study, simulation))
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    const Status densities = comparison_check_densities(study, simulation, problem);
    return models != STATUS_OK   ? models
           : storey != STATUS_OK ? storey
           : band != STATUS_OK   ? band
                                 : densities;
}

static Status comparison_cost(const Study *asked, const Simulation *simulation,
                              const SimulationLimits *limits, double *steps, Problem *problem) {
    const CompareStudy *study = (const CompareStudy *)(const void *)asked;
    Comparison answer = {0};
    *steps = 0;
    Status status = comparison_list(study, simulation, &answer.entries, problem);
    for (size_t i = 0; i < answer.entries.count && status == STATUS_OK; i++) {
        double own;
        status =
            comparison_predict(study, simulation, &answer.entries.at[i], limits, &own, problem);
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
    .complete = comparison_complete,
    .cost = comparison_cost,
    .members = &comparison_members,
};
