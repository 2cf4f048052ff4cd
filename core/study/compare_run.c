// The reference's outcome is kept until all others were set beside it; of each other one only its
// numbers stay. A variant that cannot be is a row with its reason; without the reference there is
// no answer.
#include "core/study/compare_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/compare_variants.h"
#include "core/study/member.h"

enum { BUCKETS = 400 }; // of a trace

// What a study has at hand while it runs.
typedef struct Session {
    const CompareStudy *study;
    const Simulation *simulation;
    const StudyTools *tools;
    Comparison *answer;
    Outcome *reference;
    double *steps;    // foretold, of each entry
    double done, all; // of those
    Problem *fault;   // of an entry
} Session;

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

static bool copy_reals(Reals *target, const double *values, size_t count) {
    target->at = calloc(count + 1, sizeof *target->at);
    if (target->at == NULL)
        return false;
    memcpy(target->at, values, count * sizeof *values);
    target->count = count;
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

static Status tell_divergence(const Session *session, const Outcome *outcome, CompareEntry *entry,
                              Problem *problem) {
    CompareDivergence *told = &entry->divergence;
    const double percent = 100 * session->study->part;
    char text[240];
    told->time = entry->displacement.parting;
    told->horizon = fmin(session->reference->summary.trust_horizon, outcome->summary.trust_horizon);
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
    trace->minimum.at = calloc(count + 1, sizeof(double));
    trace->maximum.at = calloc(count + 1, sizeof(double));
    if (trace->minimum.at == NULL || trace->maximum.at == NULL)
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
    trace->minimum.count = trace->maximum.count = count;
    return STATUS_OK;
}

// What all entries have in common is the reference's.
static Status tell_reference(Session *session, Problem *problem) {
    Comparison *answer = session->answer;
    const Outcome *reference = session->reference;
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

static Status tell(const Session *session, const Outcome *outcome, CompareEntry *entry,
                   Problem *problem) {
    const Outcome *reference = session->reference;
    const Reals *band = &session->study->band;
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
    entry->displacement = likeness_measure(&from, &to, session->study->part);
    TRY(tell_divergence(session, outcome, entry, problem));
    if (!copy_derived(&outcome->plan.derived, &entry->derived) ||
        !copy_reals(&entry->density, spectrum->densities.at[0].values, spectrum->densities.rows))
        return no_memory(problem);
    return tell_trace(outcome, session->answer->trace_samples, entry, problem);
}

static Status set_aside(CompareEntry *entry, int as, const Problem *fault, Problem *problem) {
    if (member_ends_all(fault->status))
        return problem_set(problem, fault->status, "%s", fault->detail);
    entry->status = as;
    entry->why = member_why(fault);
    return entry->why != NULL ? STATUS_OK : no_memory(problem);
}

static Status make_entry(Session *session, size_t index, Problem *problem) {
    CompareEntry *entry = &session->answer->entries.at[index];
    const StudyTools *tools = session->tools;
    Stage stage =
        stage_of(tools->watch, session->done / session->all, session->steps[index] / session->all);
    const Watch watch = stage_watch(&stage);
    Simulation member = {0};
    Outcome *outcome = NULL;
    problem_clear(session->fault);
    int as = COMPARE_REFUSED;
    Status status = variant_apply(session->study, session->simulation, entry, tools->limits,
                                  &member, session->fault);
    if (status == STATUS_OK) {
        as = COMPARE_FAILED;
        status = simulation_run(&member, tools->limits, &watch, tools->workspace, &outcome,
                                session->fault);
    }
    simulation_clear(&member);
    session->done += session->steps[index];
    // A failure to come to a reference is the study's own.
    if (status != STATUS_OK && index == 0)
        return problem_set(problem, status, "the scene itself: %s", session->fault->detail);
    if (status != STATUS_OK)
        return set_aside(entry, as, session->fault, problem);
    if (index == 0) {
        session->reference = outcome_hold(outcome);
        status = tell_reference(session, problem);
    }
    if (status == STATUS_OK)
        status = tell(session, outcome, entry, problem);
    outcome_drop(outcome);
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

Status compare_make(const CompareStudy *study, const Simulation *simulation,
                    const StudyTools *tools, Comparison *answer, Problem *problem) {
    Session session = {.study = study,
                       .simulation = simulation,
                       .tools = tools,
                       .answer = answer,
                       .steps = calloc(COMPARE_VARIANTS, sizeof(double)),
                       .fault = calloc(1, sizeof(Problem))};
    answer->storey = study->storey;
    answer->part = study->part;
    Status status = session.steps == NULL || session.fault == NULL
                        ? no_memory(problem)
                        : variants_make(study, simulation, &answer->entries, problem);
    for (size_t i = 0; i < answer->entries.count && status == STATUS_OK; i++) {
        status = compare_foretell(study, simulation, &answer->entries.at[i], tools->limits,
                                  &session.steps[i], problem);
        session.all += session.steps[i];
    }
    session.all = fmax(session.all, 1);
    for (size_t i = 0; i < answer->entries.count && status == STATUS_OK; i++) {
        if (!watch_advance(tools->watch, session.done / session.all))
            status = problem_set(problem, STATUS_CANCELLED, "the study was stopped");
        else
            status = make_entry(&session, i, problem);
    }
    outcome_drop(session.reference);
    free(session.steps);
    free(session.fault);
    return status;
}
