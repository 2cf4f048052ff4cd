#include "core/drop_test/material_proposal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/text_format.h"
#include "core/drop_test/reading_statistics.h"

const char *const proposal_form_names[] = {"constant", "table", NULL};

enum { SOURCE_MAX = 1000 };

static bool has(double value) {
    return !isnan(value);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the proposal");
}

void material_proposal_clear(MaterialProposal *proposal) {
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

// What stands behind a revision: the tests of whose readings some do, and their ranges.
typedef struct Behind {
    const EvaluationRow **rows;
    size_t count;
    Measurement *tests; // in their order
    size_t test_count;
    Ranges ranges;
} Behind;

// Of rows that are all set; `tests` has room for all.
static void look_behind(const Measurement *tests, size_t count, Behind *behind) {
    behind->ranges = ranges_unknown;
    for (size_t i = 0; i < behind->count; i++)
        ranges_take(&behind->ranges, behind->rows[i], tests);
    for (size_t test = 0; test < count; test++)
        for (size_t i = 0; i < behind->count; i++)
            if (behind->rows[i]->test == test) {
                behind->tests[behind->test_count++] = tests[test];
                break;
            }
}

// What all tests have in common of impactor and base.
static Status take_pair(const Behind *behind, Material *material, Warnings *warnings) {
    const DropTest *first = behind->tests[0].test;
    bool is_one = true;
    for (size_t i = 1; i < behind->test_count; i++) {
        const DropTest *test = behind->tests[i].test;
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
static Status take_source(const Behind *behind, Material *material) {
    char text[SOURCE_MAX + 1] = "", number[32];
    const Measurement *tests = behind->tests;
    const size_t count = behind->test_count;
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

static bool is_by_pulse(const Behind *behind) {
    for (size_t i = 0; i < behind->count; i++)
        if (behind->rows[i]->contact_time_counts &&
            behind->rows[i]->contact_time_by == (int)CONTACT_TIME_BY_PULSE)
            return true;
    return false;
}

static Status take_constant(Evaluation *evaluation, Behind *behind, MaterialProposal *proposal) {
    Material *material = &proposal->material;
    const Statistic *e = &evaluation->restitution, *T = &evaluation->contact_time;
    if (e->count == 0)
        return sentence(&proposal->why,
                        "no reading that counts tells the restitution: a revision needs one; take "
                        "in a measurement with heights or speeds")
                   ? STATUS_OK
                   : STATUS_NO_MEMORY;
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (row_counts(&evaluation->rows.at[i]))
            behind->rows[behind->count++] = &evaluation->rows.at[i];
    material->restitution = e->mean;
    material->restitution_deviation = e->spread;
    material->contact_time = T->mean;
    material->contact_time_deviation = T->spread;
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

// One row of a table to be: so many rows from `first` on, by rising speed.
typedef struct Bin {
    size_t first, count;
    bool has_restitution, has_time;
} Bin;

static int by_speed(const void *a, const void *b) {
    const double left = (*(const EvaluationRow *const *)a)->approach_speed;
    const double right = (*(const EvaluationRow *const *)b)->approach_speed;
    return left < right ? -1 : left > right ? 1 : 0;
}

// Rows that count and have a speed, in bins; `bins` has room for all rows.
static size_t make_bins(const Evaluation *evaluation, Behind *behind, Bin *bins) {
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (row_counts(row) && has(row->approach_speed))
            behind->rows[behind->count++] = row;
    }
    if (behind->count > 0)
        qsort(behind->rows, behind->count, sizeof(const EvaluationRow *), by_speed);
    for (size_t i = 0; i < behind->count; i++) {
        const EvaluationRow *row = behind->rows[i];
        if (count == 0 || row->approach_speed >
                              PROPOSAL_BIN * behind->rows[bins[count - 1].first]->approach_speed)
            bins[count++] = (Bin){.first = i};
        Bin *bin = &bins[count - 1];
        bin->count++;
        bin->has_restitution = bin->has_restitution || row->restitution_counts;
        bin->has_time = bin->has_time || row->contact_time_counts;
    }
    return count;
}

// Every row needs e, and T_c where any has it. The rows of other bins are given up.
static size_t keep_bins(Behind *behind, Bin *bins, size_t count, bool *has_time) {
    size_t kept = 0, rows = 0;
    *has_time = false;
    for (size_t i = 0; i < count; i++)
        *has_time = *has_time || bins[i].has_time;
    for (size_t i = 0; i < count; i++) {
        if (!bins[i].has_restitution || (*has_time && !bins[i].has_time))
            continue;
        bins[kept] = bins[i];
        bins[kept].first = rows;
        for (size_t k = 0; k < bins[i].count; k++)
            behind->rows[rows++] = behind->rows[bins[i].first + k];
        kept++;
    }
    behind->count = rows;
    return kept;
}

// By the same rule as of all readings.
static Status fold(const Behind *behind, const Bin *bin, bool is_time, Reading *readings,
                   double *mean, double *deviation) {
    size_t count = 0;
    for (size_t i = 0; i < bin->count; i++) {
        const EvaluationRow *row = behind->rows[bin->first + i];
        if (is_time ? row->contact_time_counts : row->restitution_counts)
            readings[count++] = (Reading){
                .value = is_time ? row->contact_time : row->restitution,
                .uncertainty =
                    is_time ? row->contact_time_uncertainty : row->restitution_uncertainty,
                .speed = row->approach_speed,
            };
    }
    Statistic quantity;
    const Status status = statistic_make(readings, count, "reading", "", &quantity, NULL);
    *mean = quantity.mean;
    *deviation = quantity.spread;
    statistic_clear(&quantity);
    return status;
}

static Status fill_table(const Behind *behind, const Bin *bins, size_t count, Reading *readings,
                         Material *material) {
    material->table.at = calloc(count, sizeof *material->table.at);
    if (material->table.at == NULL)
        return STATUS_NO_MEMORY;
    material->table.count = count;
    for (size_t i = 0; i < count; i++) {
        MaterialRow *row = &material->table.at[i];
        double sum = 0;
        for (size_t k = 0; k < bins[i].count; k++)
            sum += behind->rows[bins[i].first + k]->approach_speed;
        row->approach_speed = sum / (double)bins[i].count;
        TRY(fold(behind, &bins[i], false, readings, &row->restitution,
                 &row->restitution_deviation));
        TRY(fold(behind, &bins[i], true, readings, &row->contact_time,
                 &row->contact_time_deviation));
    }
    return STATUS_OK;
}

// `bins` and `readings` have room for all rows.
static Status take_table(Evaluation *evaluation, Behind *behind, Bin *bins, Reading *readings,
                         MaterialProposal *proposal) {
    bool has_time;
    const size_t all = make_bins(evaluation, behind, bins);
    const size_t kept = keep_bins(behind, bins, all, &has_time);
    if (kept < 2 || kept > MATERIAL_ROWS)
        return sentence(&proposal->why,
                        "a table needs e%s at two approach speeds at least (%g times one "
                        "another), %d at most; the readings tell %zu",
                        has_time ? " and T_c" : "", PROPOSAL_BIN, MATERIAL_ROWS, kept)
                   ? STATUS_OK
                   : STATUS_NO_MEMORY;
    TRY(fill_table(behind, bins, kept, readings, &proposal->material));
    if (kept < all)
        TRY(warnings_add(&evaluation->warnings, "/revision/table",
                         "%zu of %zu speeds are left out: e%s is not known there", all - kept, all,
                         has_time ? " or T_c" : ""));
    if (!has_time)
        TRY(warnings_add(&evaluation->warnings, "/revision/table",
                         "no contact time is known at any speed: the material can be used in "
                         "contact models of impulse alone"));
    return STATUS_OK;
}

static Status make(Evaluation *evaluation, const Measurement *tests, size_t count,
                   const Material *before, ProposalForm form, Behind *behind,
                   MaterialProposal *proposal) {
    Material *material = &proposal->material;
    TRY(describe(before, material));
    if (form == PROPOSAL_TABLE) {
        const size_t most = evaluation->rows.count + 1;
        Bin *bins = calloc(most, sizeof *bins);
        Reading *readings = calloc(most, sizeof *readings);
        const Status status = bins != NULL && readings != NULL
                                  ? take_table(evaluation, behind, bins, readings, proposal)
                                  : STATUS_NO_MEMORY;
        free(bins);
        free(readings);
        TRY(status);
    } else {
        TRY(take_constant(evaluation, behind, proposal));
    }
    if (proposal->why != NULL)
        return STATUS_OK;
    look_behind(tests, count, behind);
    TRY(take_pair(behind, material, &evaluation->warnings));
    TRY(take_source(behind, material));
    material->least_speed = behind->ranges.least_speed;
    material->most_speed = behind->ranges.most_speed;
    material->least_temperature = behind->ranges.least_temperature;
    material->most_temperature = behind->ranges.most_temperature;
    if (is_by_pulse(behind))
        material->separation = evaluation->separation;
    return STATUS_OK;
}

Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *proposal,
                             Problem *problem) {
    *proposal = (MaterialProposal){.why = NULL};
    Behind behind = {.rows = calloc(evaluation->rows.count + 1, sizeof(const EvaluationRow *)),
                     .tests = calloc(count + 1, sizeof(Measurement))};
    const Status status = behind.rows != NULL && behind.tests != NULL
                              ? make(evaluation, tests, count, before, form, &behind, proposal)
                              : STATUS_NO_MEMORY;
    free(behind.rows);
    free(behind.tests);
    if (status != STATUS_OK || proposal->why != NULL)
        fields_clear(material_fields, &proposal->material);
    return status == STATUS_OK ? STATUS_OK : no_memory(problem);
}
