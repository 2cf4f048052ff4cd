#include "core/measure/proposal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/measure/sentence.h"

const char *const proposal_form_names[] = {"constant", "table", NULL};

enum { SOURCE_MOST = 1000 };

static bool has(double value) {
    return !isnan(value);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the proposal");
}

void proposal_clear(Proposal *proposal) {
    fields_clear(material_fields, &proposal->material);
    free(proposal->why);
    proposal->why = NULL;
}

// What the material is, without its figures and where they came from.
static Status describe(const Material *before, Material *material) {
    TRY(fields_copy(material_fields, before, material));
    free(material->table.at);
    material->table = (MaterialRows){NULL, 0};
    free(material->measurements.at);
    material->measurements = (Reals){NULL, 0};
    free(material->impactor);
    material->impactor = NULL;
    free(material->source);
    material->source = NULL;
    material->restitution = material->restitution_deviation = (double)NAN;
    material->contact_time = material->contact_time_deviation = (double)NAN;
    material->least_speed = material->most_speed = (double)NAN;
    material->least_temperature = material->most_temperature = (double)NAN;
    material->impactor_mass = material->base_mass = (double)NAN;
    material->base = material->separation = CHOICE_ABSENT;
    return STATUS_OK;
}

static bool is_same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

// What all tests have in common of impactor and base.
static Status take_pair(const Measurement *tests, size_t count, Material *material,
                        Warnings *warnings) {
    const DropTest *first = tests[0].test;
    bool is_one = true;
    for (size_t i = 1; i < count; i++) {
        const DropTest *test = tests[i].test;
        is_one = is_one && text_same(test->impactor, first->impactor) &&
                 is_same(test->impactor_mass, first->impactor_mass) && test->base == first->base &&
                 is_same(test->base_mass, first->base_mass);
    }
    if (!is_one)
        return warnings_add(warnings, "/revision/impactor_mass",
                            "impactor and base are left out: the measurements were made with "
                            "different ones");
    material->impactor_mass = first->impactor_mass;
    material->base = first->base;
    material->base_mass = first->base_mass;
    return first->impactor == NULL || (material->impactor = strdup(first->impactor)) != NULL
               ? STATUS_OK
               : STATUS_NO_MEMORY;
}

static bool stands_before(const Measurement *tests, size_t index) {
    for (size_t i = 0; i < index; i++)
        if (text_same(tests[i].test->source, tests[index].test->source))
            return true;
    return false;
}

// Their sources, else their numbers.
static Status take_source(const Measurement *tests, size_t count, Material *material) {
    char text[SOURCE_MOST + 1] = "", number[32];
    for (size_t i = 0; i < count; i++)
        if (tests[i].test->source != NULL && !stands_before(tests, i))
            text_list(text, sizeof text, tests[i].test->source);
    if (text[0] == '\0') {
        snprintf(text, sizeof text, "measurements of this material:");
        for (size_t i = 0; i < count && tests[i].number != COUNT_ABSENT; i++) {
            snprintf(number, sizeof number, "%s%llu", i > 0 ? ", " : " ",
                     (unsigned long long)tests[i].number);
            if (strlen(text) + strlen(number) < sizeof text)
                memcpy(text + strlen(text), number, strlen(number) + 1);
        }
    }
    material->source = strdup(text);
    if (material->source == NULL || !reals_make(&material->measurements, count))
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        material->measurements.at[i] = (double)tests[i].number;
    return STATUS_OK;
}

// Of some readings: their mean and their spread, of a single one what its instrument leaves.
typedef struct Fold {
    double n, sum, squares, uncertainty;
} Fold;

static void fold_add(Fold *fold, double value, double uncertainty) {
    const double mean = fold->n > 0 ? fold->sum / fold->n : 0, n = fold->n;
    fold->squares += (value - mean) * (value - mean) * n / (n + 1);
    fold->sum += value;
    fold->n++;
    fold->uncertainty = uncertainty;
}

static double fold_mean(const Fold *fold) {
    return fold->n > 0 ? fold->sum / fold->n : (double)NAN;
}

static double spread(double deviation, double mean, double uncertainty) {
    if (deviation > 1e-12 * fabs(mean))
        return deviation;
    return uncertainty > 0 ? uncertainty : (double)NAN;
}

static double fold_spread(const Fold *fold) {
    const double deviation = fold->n > 1 ? sqrt(fold->squares / (fold->n - 1)) : 0;
    return spread(deviation, fold_mean(fold), fold->uncertainty);
}

static Status take_constant(Evaluation *evaluation, Proposal *proposal) {
    Material *material = &proposal->material;
    const Quantity *e = &evaluation->restitution, *T = &evaluation->contact_time;
    if (e->count == 0)
        return sentence(&proposal->why,
                        "no reading that counts tells the restitution: a revision needs one; take "
                        "in a measurement with heights or speeds")
                   ? STATUS_OK
                   : STATUS_NO_MEMORY;
    Fold of_e = {0}, of_T = {0};
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row->restitution_counts)
            fold_add(&of_e, row->restitution, row->restitution_uncertainty);
        if (row->contact_time_counts)
            fold_add(&of_T, row->contact_time, row->contact_time_uncertainty);
    }
    material->restitution = e->mean;
    material->restitution_deviation = fold_spread(&of_e);
    material->contact_time = T->mean;
    if (T->count > 0)
        material->contact_time_deviation = fold_spread(&of_T);
    if (e->trend.verdict == TREND_NOT_CONSTANT)
        TRY(warnings_add(&evaluation->warnings, "/revision/restitution", "%s", e->trend.detail));
    if (T->trend.verdict == TREND_NOT_CONSTANT)
        TRY(warnings_add(&evaluation->warnings, "/revision/contact_time", "%s", T->trend.detail));
    if (T->count == 0)
        TRY(warnings_add(&evaluation->warnings, "/revision/contact_time",
                         "no contact time is known: the material can be used in contact models of "
                         "impulse alone"));
    return STATUS_OK;
}

// One row of a table to be.
typedef struct Bin {
    double from; // [m/s]
    Fold speed, restitution, contact_time;
} Bin;

static int by_speed(const void *a, const void *b) {
    const double left = (*(const EvaluationRow *const *)a)->approach_speed;
    const double right = (*(const EvaluationRow *const *)b)->approach_speed;
    return left < right ? -1 : left > right ? 1 : 0;
}

// Rows that count and have a speed, in bins by rising speed; both arrays have room for all rows.
static size_t make_bins(const Evaluation *evaluation, const EvaluationRow **sorted, Bin *bins) {
    size_t count = 0, bin_count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if ((row->restitution_counts || row->contact_time_counts) && has(row->approach_speed))
            sorted[count++] = row;
    }
    if (count > 0)
        qsort(sorted, count, sizeof *sorted, by_speed);
    for (size_t i = 0; i < count; i++) {
        const EvaluationRow *row = sorted[i];
        if (bin_count == 0 || row->approach_speed > PROPOSAL_BIN * bins[bin_count - 1].from)
            bins[bin_count++] = (Bin){.from = row->approach_speed};
        Bin *bin = &bins[bin_count - 1];
        fold_add(&bin->speed, row->approach_speed, (double)NAN);
        if (row->restitution_counts)
            fold_add(&bin->restitution, row->restitution, row->restitution_uncertainty);
        if (row->contact_time_counts)
            fold_add(&bin->contact_time, row->contact_time, row->contact_time_uncertainty);
    }
    return bin_count;
}

// Every row needs e, and T_c where any has it.
static size_t keep_bins(Bin *bins, size_t count, bool *has_time) {
    size_t kept = 0;
    *has_time = false;
    for (size_t i = 0; i < count; i++)
        *has_time = *has_time || bins[i].contact_time.n > 0;
    for (size_t i = 0; i < count; i++)
        if (bins[i].restitution.n > 0 && (!*has_time || bins[i].contact_time.n > 0))
            bins[kept++] = bins[i];
    return kept;
}

static Status fill_table(const Bin *bins, size_t count, bool has_time, Material *material) {
    const double none = (double)NAN;
    material->table.at = calloc(count, sizeof *material->table.at);
    if (material->table.at == NULL)
        return STATUS_NO_MEMORY;
    material->table.count = count;
    for (size_t i = 0; i < count; i++)
        material->table.at[i] = (MaterialRow){
            .approach_speed = fold_mean(&bins[i].speed),
            .restitution = fold_mean(&bins[i].restitution),
            .contact_time = has_time ? fold_mean(&bins[i].contact_time) : none,
            .restitution_deviation = fold_spread(&bins[i].restitution),
            .contact_time_deviation = has_time ? fold_spread(&bins[i].contact_time) : none,
        };
    return STATUS_OK;
}

static Status take_table(Evaluation *evaluation, Proposal *proposal) {
    const size_t most = evaluation->rows.count + 1;
    const EvaluationRow **sorted = calloc(most, sizeof *sorted);
    Bin *bins = calloc(most, sizeof *bins);
    Status status = sorted != NULL && bins != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (status == STATUS_OK) {
        bool has_time;
        const size_t all = make_bins(evaluation, sorted, bins);
        const size_t kept = keep_bins(bins, all, &has_time);
        if (kept < 2 || kept > MATERIAL_ROWS)
            status = sentence(&proposal->why,
                              "a table needs e%s at two approach speeds at least (%g times one "
                              "another), %d at most; the readings tell %zu",
                              has_time ? " and T_c" : "", PROPOSAL_BIN, MATERIAL_ROWS, kept)
                         ? STATUS_OK
                         : STATUS_NO_MEMORY;
        else
            status = fill_table(bins, kept, has_time, &proposal->material);
        if (status == STATUS_OK && proposal->why == NULL && kept < all)
            status = warnings_add(&evaluation->warnings, "/revision/table",
                                  "%zu of %zu speeds are left out: e%s is not known there",
                                  all - kept, all, has_time ? " or T_c" : "");
        if (status == STATUS_OK && proposal->why == NULL && !has_time)
            status = warnings_add(&evaluation->warnings, "/revision/table",
                                  "no contact time is known at any speed: the material can be "
                                  "used in contact models of impulse alone");
    }
    free(sorted);
    free(bins);
    return status;
}

static bool is_by_pulse(const Evaluation *evaluation) {
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row->contact_time_counts && row->contact_time_by == CONTACT_TIME_BY_PULSE)
            return true;
    }
    return false;
}

static Status make(Evaluation *evaluation, const Measurement *tests, size_t count,
                   const Material *before, ProposalForm form, Proposal *proposal) {
    Material *material = &proposal->material;
    TRY(describe(before, material));
    TRY(take_pair(tests, count, material, &evaluation->warnings));
    TRY(take_source(tests, count, material));
    material->least_speed = evaluation->least_speed;
    material->most_speed = evaluation->most_speed;
    material->least_temperature = evaluation->least_temperature;
    material->most_temperature = evaluation->most_temperature;
    if (is_by_pulse(evaluation))
        material->separation = evaluation->separation;
    return form == PROPOSAL_TABLE ? take_table(evaluation, proposal)
                                  : take_constant(evaluation, proposal);
}

Status proposal_make(Evaluation *evaluation, const Measurement *tests, size_t count,
                     const Material *before, ProposalForm form, Proposal *proposal,
                     Problem *problem) {
    *proposal = (Proposal){.why = NULL};
    const Status status = make(evaluation, tests, count, before, form, proposal);
    if (status != STATUS_OK || proposal->why != NULL)
        fields_clear(material_fields, &proposal->material);
    return status == STATUS_OK ? STATUS_OK : no_memory(problem);
}
