// A run is the scene with another seed and nothing sampled; of what it came to, a row of numbers
// stays and what its spectra add to the fold. A run that fails is a row with its reason.
#include "core/study/ensemble_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/random.h"
#include "core/study/stopping_rule.h"
#include "core/study/spectrum_accumulator.h"
#include "core/study/statistics.h"
#include "core/study/study_run.h"
#include "core/study/candidate_settings.h"

// What the study has at hand.
typedef struct EnsembleWork {
    StudyWork work;
    const EnsembleStudy *study;
    Simulation member; // the scene; its seed is each run's
    bool has_force;
    Ensemble *answer; // whose table has room for all runs
    Status *statuses; // of the table's rows
    SpectraFold fold;
    Spectrum like; // of any run that ended: the shape
    size_t look;   // ended runs at which the target is looked at next
} EnsembleWork;

Status ensemble_member(const Simulation *simulation, uint64_t seed, Simulation *target,
                       Problem *problem) {
    TRY(member_copy(simulation, target, problem));
    ((ExcitationRandom *)(void *)target->scene.excitation)->seed = seed;
    return STATUS_OK;
}

static bool has_target(const EnsembleWork *work) {
    return !isnan(work->study->target);
}

static size_t ended(const EnsembleWork *work) {
    return (size_t)(work->answer->made - work->answer->failed);
}

// Runs that could end: those that failed are of no population.
static size_t population(const EnsembleWork *work) {
    return (size_t)(work->study->runs - work->answer->failed);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static uint64_t seed_of(const EnsembleWork *work, size_t index) {
    return work->study->first_seed + index;
}

static Status make_run(const StudyWork *of, size_t index, const StudyTools *tools, void **made,
                       Problem *problem) {
    const EnsembleWork *work = (const EnsembleWork *)(const void *)of;
    // A view of the scene that all share, with an excitation of its own.
    Simulation member = work->member;
    ExcitationRandom random =
        *(const ExcitationRandom *)(const void *)scene_excitation(&member.scene);
    random.seed = seed_of(work, index);
    member.scene.excitation = (Variant *)(void *)&random;
    MemberPart *part = calloc(1, sizeof *part);
    *made = part;
    return part != NULL ? member_run(&member, tools, part, problem) : no_memory(problem);
}

static void drop_run(void *part) {
    if (part == NULL)
        return;
    member_clear(part);
    free(part);
}

static Status take_spectrum(EnsembleWork *work, MemberPart *part, Problem *problem) {
    TRY(spectra_add(&work->fold, &part->spectrum,
                    has_target(work) && work->study->metric == ENSEMBLE_PSD, problem));
    if (work->like.densities.count == 0) {
        work->like = part->spectrum;
        part->spectrum = (Spectrum){0};
    }
    return STATUS_OK;
}

static Status measure_spread(EnsembleWork *work, Spread *spread, Problem *problem) {
    if (work->study->metric != ENSEMBLE_PSD)
        return statistics_spread(&work->answer->table, work->study->metric, spread, problem);
    *spread = spectra_spread(&work->fold, population(work));
    return STATUS_OK;
}

// Looks at the error, and foretells how many runs it will take. Those are then made ahead.
static Status look(EnsembleWork *work, Problem *problem) {
    EnsembleTarget *target = &work->answer->target;
    const size_t count = ended(work), all = population(work);
    Spread spread;
    TRY(measure_spread(work, &spread, problem));
    // A statistic that no run knows has no mean.
    target->estimated_error = spread.count > 0 ? rule_error(&spread, count, all) : (double)NAN;
    // It ends where it is looked at.
    const size_t fewest = rule_predict(&spread, all, work->study->target);
    size_t foretold = count;
    while (foretold < fewest)
        foretold = rule_next_look(foretold);
    foretold = foretold < all ? foretold : all;
    if (target->pilot == COUNT_ABSENT && count > 1) {
        target->pilot = count;
        target->predicted_runs = foretold;
    }
    work->look = rule_next_look(count);
    const bool is_enough = target->estimated_error <= work->study->target;
    work->work.wanted = (is_enough ? count : foretold) + (size_t)work->answer->failed;
    work->work.expected = work->work.wanted;
    return STATUS_OK;
}

// Runs that failed put off the next look: more are wanted until then.
static void want_look(EnsembleWork *of) {
    StudyWork *work = &of->work;
    const size_t made = (size_t)of->answer->made, until = made + of->look - ended(of);
    if (work->wanted > made)
        return;
    work->wanted = until < work->members ? until : work->members;
    if (work->expected < work->wanted)
        work->expected = work->wanted;
}

static Status fold_run(StudyWork *of, size_t index, void *made, Problem *problem) {
    EnsembleWork *work = (EnsembleWork *)(void *)of;
    Ensemble *answer = work->answer;
    MemberPart *part = made;
    EnsembleRun *run = &answer->table.at[index];
    *run = (EnsembleRun){seed_of(work, index), part->why, part->steps, part->summary};
    part->why = NULL;
    work->statuses[index] = part->status;
    answer->table.count = index + 1;
    answer->made++;
    if (run->why != NULL) {
        answer->failed++;
    } else {
        answer->steps += run->steps;
        if (!work->has_force)
            run->summary.peak_contact_force = (double)NAN;
        TRY(take_spectrum(work, part, problem));
    }
    if (!has_target(work))
        return STATUS_OK;
    if (answer->made == answer->runs || ended(work) >= work->look)
        return look(work, problem);
    want_look(work);
    return STATUS_OK;
}

static Status tell_target(const EnsembleWork *work, Problem *problem) {
    EnsembleTarget *target = &work->answer->target;
    if (!has_target(work))
        return STATUS_OK;
    const char *name = ensemble_metric_names[work->study->metric];
    const unsigned long long made = (unsigned long long)work->answer->made,
                             all = (unsigned long long)work->study->runs;
    char text[320];
    target->error = work->study->target;
    target->metric = work->study->metric;
    target->confidence = ENSEMBLE_CONFIDENCE;
    target->is_kept = target->estimated_error <= target->error;
    if (isnan(target->estimated_error))
        snprintf(text, sizeof text, "no run of %llu came to an end that tells %s", all, name);
    else if (made == all)
        snprintf(text, sizeof text,
                 "all %llu runs were made: no fewer were sure to keep the mean of %s within %g",
                 all, name, target->error);
    else
        snprintf(text, sizeof text,
                 "%llu of %llu runs keep the mean of %s within %g of that of all: within %.2g with "
                 "%g %% confidence",
                 made, all, name, target->error, target->estimated_error, 100 * target->confidence);
    target->why = strdup(text);
    return target->why != NULL ? STATUS_OK : no_memory(problem);
}

static Status end_runs(StudyWork *of, const StudyTools *tools, Problem *problem) {
    const EnsembleWork *work = (const EnsembleWork *)(const void *)of;
    Ensemble *answer = work->answer;
    (void)tools;
    TRY(tell_target(work, problem));
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
        TRY(statistics_fold(&answer->table, metric, ensemble_statistic(&answer->statistics, metric),
                            problem));
    statistics_trust(&answer->table, &answer->trust);
    TRY(statistics_failures(&answer->table, work->statuses, &answer->failures, problem));
    return spectra_tell(&work->fold, &work->like, answer, problem);
}

static void free_runs(StudyWork *of) {
    EnsembleWork *work = (EnsembleWork *)(void *)of;
    spectrum_clear(&work->like);
    spectra_clear(&work->fold);
    simulation_clear(&work->member);
    free(work->statuses);
    free(work);
}

// Bytes of the densities of one run, nearly.
static size_t density_bytes(const Simulation *simulation) {
    const SpectrumRequest *psd = &simulation->output.psd;
    return psd->channels.count == 0
               ? 0
               : sizeof(double) * (psd->channels.count + 1) * ((size_t)psd->segment / 2 + 1);
}

static Status begin_runs(const Study *asked, const Simulation *simulation, const StudyTools *tools,
                         Variant *told, StudyWork **made, Problem *problem) {
    const EnsembleStudy *study = (const EnsembleStudy *)(const void *)asked;
    Ensemble *answer = (Ensemble *)(void *)told;
    const size_t runs = (size_t)study->runs;
    EnsembleWork *work = calloc(1, sizeof *work);
    (void)tools;
    if (work == NULL)
        return no_memory(problem);
    *work = (EnsembleWork){.work = {.kind = &study_ensemble,
                                    .members = runs,
                                    .wanted = runs,
                                    .expected = runs,
                                    .part_bytes = sizeof(MemberPart) + density_bytes(simulation)},
                           .study = study,
                           .has_force = ladder_has_force(simulation),
                           .answer = answer,
                           .statuses = calloc(runs, sizeof(Status)),
                           .look = ENSEMBLE_PILOT};
    if (has_target(work) && runs > ENSEMBLE_PILOT)
        work->work.wanted = ENSEMBLE_PILOT;
    answer->runs = study->runs;
    answer->first_seed = study->first_seed;
    answer->confidence = ENSEMBLE_INTERVAL;
    answer->table.at = calloc(runs, sizeof *answer->table.at);
    Status status = STATUS_OK;
    if (work->statuses == NULL || answer->table.at == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu runs", runs);
    if (status == STATUS_OK)
        status = ensemble_member(simulation, study->first_seed, &work->member, problem);
    if (status == STATUS_OK)
        *made = &work->work;
    else
        free_runs(&work->work);
    return status;
}

const StudyMembers ensemble_members = {
    .begin = begin_runs,
    .make = make_run,
    .fold = fold_run,
    .drop = drop_run,
    .end = end_runs,
    .free = free_runs,
};
