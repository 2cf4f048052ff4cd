// The reference's outcome is kept until all others were set beside it; of each other one only its
// numbers stay. A variant that cannot be is a row with its reason; without the reference there is
// no answer.
#include "core/study/compare_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/compare_variants.h"
#include "core/study/study_run.h"

enum { BUCKETS = 400 }; // of a trace

// What the study has at hand. Its members are the entries after the first.
typedef struct CompareWork {
    StudyWork work;
    const CompareStudy *study;
    const Simulation *simulation;
    Comparison *answer;
    Outcome *reference;
} CompareWork;

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

static bool copy_reals(Reals *target, const double *values, size_t count) {
    if (!reals_make(target, count))
        return false;
    memcpy(target->at, values, count * sizeof *values);
    return true;
}

static bool copy_derived(const DerivedList *from, DerivedList *target) {
    target->at = calloc(from->count + 1, sizeof *target->at);
    while (target->at != NULL && target->count < from->count) {
        const size_t i = target->count;
        if (fields_copy(derived_fields, &from->at[i], &target->at[i]) != STATUS_OK)
            return false;
        target->count++;
    }
    return target->at != NULL;
}

static bool has_force(const Outcome *outcome) {
    const ContactLaw *law =
        (const ContactLaw *)(const void *)kind_find(&contact_kinds, outcome->plan.contact_model);
    return law != NULL && law->form != CONTACT_IMPULSIVE;
}

static CompareContacts contacts_of(const Outcome *outcome) {
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

static double relative(double value, double from) {
    return from > 0 ? value / from - 1 : value == from ? 0 : (double)NAN;
}

static CompareDifferences differences_of(const Outcome *reference, const Outcome *outcome) {
    const Summary *from = &reference->summary, *to = &outcome->summary;
    const bool both = has_force(reference) && has_force(outcome);
    return (CompareDifferences){
        relative(to->peak_displacement, from->peak_displacement),
        relative(to->rms_displacement, from->rms_displacement),
        relative(to->peak_acceleration, from->peak_acceleration),
        relative(to->rms_acceleration, from->rms_acceleration),
        (double)to->impacts - (double)from->impacts,
        both ? relative(to->peak_contact_force, from->peak_contact_force) : (double)NAN,
    };
}

static Signal displacement_of(const Outcome *outcome) {
    const Response *response = &outcome->response;
    return (Signal){response->series.at[0].values, response->count, response->sample_rate, 0};
}

static Status tell_divergence(const CompareWork *work, const Outcome *outcome, CompareEntry *entry,
                              Problem *problem) {
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
    return told->why != NULL ? STATUS_OK : no_memory(problem);
}

static Status tell_trace(const Outcome *outcome, uint64_t bucket, CompareEntry *entry,
                         Problem *problem) {
    const Signal signal = displacement_of(outcome);
    const size_t count = (signal.count + (size_t)bucket - 1) / (size_t)bucket;
    CompareTrace *trace = &entry->trace;
    if (!reals_make(&trace->minimum, count) || !reals_make(&trace->maximum, count))
        return no_memory(problem);
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
static Status tell_reference(CompareWork *work, Problem *problem) {
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
                   copy_reals(&answer->frequency, spectrum->frequency, spectrum->densities.rows)
               ? STATUS_OK
               : no_memory(problem);
}

static Status tell(const CompareWork *work, const Outcome *outcome, const Progress *progress,
                   CompareEntry *entry, Problem *problem) {
    const Outcome *reference = work->reference;
    const Reals *band = &work->study->band;
    const Signal from = displacement_of(reference), to = displacement_of(outcome);
    const Spectrum *spectrum = &outcome->spectrum;
    entry->status = COMPARE_RUN;
    entry->steps = outcome->steps;
    entry->summary = outcome->summary;
    entry->contacts = contacts_of(outcome);
    entry->differences = differences_of(reference, outcome);
    entry->psd = distance_measure(&reference->spectrum, reference->spectrum.densities.at[0].values,
                                  spectrum, spectrum->densities.at[0].values,
                                  band->count == 2 ? band->at[0] : (double)NAN,
                                  band->count == 2 ? band->at[1] : (double)NAN);
    entry->displacement = likeness_measure(&from, &to, work->study->part, progress);
    if (!progress_advance(progress, 1))
        return problem_set(problem, STATUS_CANCELLED, "stopped at a comparison");
    TRY(tell_divergence(work, outcome, entry, problem));
    if (!copy_derived(&outcome->plan.derived, &entry->derived) ||
        !copy_reals(&entry->density, spectrum->densities.at[0].values, spectrum->densities.rows))
        return no_memory(problem);
    return tell_trace(outcome, work->answer->trace_samples, entry, problem);
}

// Runs an entry, whose name is the answer's and whose numbers are `told`.
static Status run_entry(const CompareWork *work, size_t index, const StudyTools *tools,
                        Outcome **outcome, CompareEntry *told, Problem *problem) {
    Simulation member = {0};
    *outcome = NULL;
    told->status = COMPARE_REFUSED;
    Status status = variant_apply(work->study, work->simulation, &work->answer->entries.at[index],
                                  tools->limits, &member, problem);
    if (status == STATUS_OK) {
        told->status = COMPARE_FAILED;
        status = simulation_run(&member, tools->limits, tools->progress, tools->workspace, outcome,
                                problem);
    }
    simulation_clear(&member);
    return status;
}

static void drop_entry(void *part) {
    if (part == NULL)
        return;
    fields_clear(compare_entry_fields, part);
    free(part);
}

static Status make_entry(const StudyWork *of, size_t index, const StudyTools *tools, void **made,
                         Problem *problem) {
    const CompareWork *work = (const CompareWork *)(const void *)of;
    CompareEntry *part = calloc(1, sizeof *part);
    Outcome *outcome;
    *made = part;
    if (part == NULL)
        return no_memory(problem);
    (void)fields_default(compare_entry_fields, part); // absent and 0: nothing to allocate
    Status status = run_entry(work, index + 1, tools, &outcome, part, problem);
    if (status == STATUS_OK) {
        status = tell(work, outcome, tools->progress, part, problem);
    } else if (!member_ends_all(status)) {
        part->why = member_why(problem);
        problem_clear(problem);
        status = part->why != NULL ? STATUS_OK : no_memory(problem);
    }
    outcome_unref(outcome);
    return status;
}

// Numbers of a part; its name and contact stay the entry's own.
static void take_entry(CompareEntry *entry, CompareEntry *part) {
    const CompareEntry named = *entry;
    *entry = *part;
    entry->name = named.name;
    entry->contact_model = named.contact_model;
    entry->separation = named.separation;
    (void)fields_default(compare_entry_fields, part);
}

static Status fold_entry(StudyWork *of, size_t index, void *part, Problem *problem) {
    (void)problem;
    take_entry(&((CompareWork *)(void *)of)->answer->entries.at[index + 1], part);
    return STATUS_OK;
}

static void free_entries(StudyWork *of) {
    CompareWork *work = (CompareWork *)(void *)of;
    outcome_unref(work->reference);
    free(work);
}

// A failure to come to a reference is the study's own.
static Status make_reference(CompareWork *work, const StudyTools *tools, Problem *problem) {
    CompareEntry told;
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return no_memory(problem);
    (void)fields_default(compare_entry_fields, &told);
    Status status = run_entry(work, 0, tools, &work->reference, &told, fault);
    if (status != STATUS_OK)
        (void)problem_set(problem, status, "the scene itself: %s", fault->detail);
    else
        status = tell_reference(work, problem);
    if (status == STATUS_OK)
        status = tell(work, work->reference, tools->progress, &told, problem);
    if (status == STATUS_OK)
        take_entry(&work->answer->entries.at[0], &told);
    fields_clear(compare_entry_fields, &told);
    free(fault);
    return status;
}

Status compare_foretell(const CompareStudy *study, const Simulation *simulation,
                        const CompareEntry *entry, const SimulationLimits *limits, double *steps,
                        Problem *problem) {
    Simulation member = {0};
    Problem *fault = calloc(1, sizeof *fault);
    *steps = 0;
    if (fault == NULL)
        return no_memory(problem);
    const Status status = variant_apply(study, simulation, entry, limits, &member, fault);
    if (status == STATUS_OK)
        *steps = simulation_cost(&member).steps;
    simulation_clear(&member);
    free(fault);
    return status == STATUS_NO_MEMORY ? no_memory(problem) : STATUS_OK;
}

static Status begin_entries(const Study *asked, const Simulation *simulation,
                            const StudyTools *tools, Variant *told, StudyWork **made,
                            Problem *problem) {
    const CompareStudy *study = (const CompareStudy *)(const void *)asked;
    Comparison *answer = (Comparison *)(void *)told;
    CompareWork *work = calloc(1, sizeof *work);
    if (work == NULL)
        return no_memory(problem);
    *work = (CompareWork){.study = study, .simulation = simulation, .answer = answer};
    answer->storey = study->storey;
    answer->part = study->part;
    Status status = variants_make(study, simulation, &answer->entries, problem);
    if (status == STATUS_OK)
        status = make_reference(work, tools, problem);
    if (status != STATUS_OK) {
        free_entries(&work->work);
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

const StudyMembers compare_members = {
    .begin = begin_entries,
    .make = make_entry,
    .fold = fold_entry,
    .drop = drop_entry,
    .free = free_entries,
};
