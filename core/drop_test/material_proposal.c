#include "core/drop_test/material_proposal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"

const char *const proposal_form_names[] = {"constant", "table", NULL};

enum { SOURCE_MAX = 1000 };

void material_proposal_clear(MaterialProposal *proposal) {
    fields_clear(material_fields, &proposal->material);
    free(proposal->why);
    proposal->why = NULL;
}

// The description of the material without its figures and their source.
static Status proposal_describe(const Material *before, Material *material) {
    Material described = {.name = NULL};
    fields_clear(material_fields, &described);
    described.name = before->name;
    described.kind = before->kind;
    described.thickness = before->thickness;
    described.hardness = before->hardness;
    described.supplier = before->supplier;
    described.notes = before->notes;
    described.tags = before->tags;
    return fields_copy(material_fields, &described, material);
}

// The rows that a revision is based on; by rising speed for a table.
typedef struct Basis {
    const EvaluationRow **rows;
    size_t count;
    Measurement *tests; // of the rows, in order
    size_t test_count;
} Basis;

static bool proposal_is_same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

// Impactor and base, if all tests have the same.
static Status proposal_set_pair(const Basis *basis, Material *material, Warnings *warnings) {
    const DropTest *first = basis->tests[0].test;
    bool is_one = true;
    for (size_t i = 1; i < basis->test_count; i++) {
        const DropTest *test = basis->tests[i].test;
        is_one = is_one && text_same(test->impactor, first->impactor) &&
                 proposal_is_same(test->impactor_mass, first->impactor_mass) &&
                 test->base == first->base && proposal_is_same(test->base_mass, first->base_mass);
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

// The different sources of the tests, else their numbers.
static Status proposal_set_source(const Basis *basis, Material *material) {
    char text[SOURCE_MAX + 1] = "", number[32];
    const Measurement *tests = basis->tests;
    const size_t count = basis->test_count;
    for (size_t i = 0; i < count; i++) {
        size_t first = 0;
        while (!text_same(tests[first].test->source, tests[i].test->source))
            first++;
        if (tests[i].test->source != NULL && first == i)
            text_list(text, sizeof text, tests[i].test->source);
    }
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
    if (material->source == NULL || !reals_allocate(&material->measurements, count))
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < count; i++)
        material->measurements.at[i] = (double)tests[i].number;
    return STATUS_OK;
}

// Ranges, separation rule, pair and source. `tests` of the basis has room for all.
static Status proposal_set_basis(Evaluation *evaluation, const Measurement *tests, size_t count,
                                 Basis *basis, Material *material) {
    Ranges ranges = ranges_unknown;
    for (size_t i = 0; i < basis->count; i++) {
        const EvaluationRow *row = basis->rows[i];
        ranges_extend(&ranges, row, tests);
        if (row->contact_time_counts && row->contact_time_by == (int)CONTACT_TIME_BY_PULSE)
            material->separation = evaluation->separation;
    }
    for (size_t test = 0; test < count; test++)
        for (size_t i = 0; i < basis->count; i++)
            if (basis->rows[i]->test == test) {
                basis->tests[basis->test_count++] = tests[test];
                break;
            }
    material->least_speed = ranges.least_speed;
    material->most_speed = ranges.most_speed;
    material->least_temperature = ranges.least_temperature;
    material->most_temperature = ranges.most_temperature;
    TRY(proposal_set_pair(basis, material, &evaluation->warnings));
    return proposal_set_source(basis, material);
}

static Status proposal_set_constant(Evaluation *evaluation, Basis *basis,
                                    MaterialProposal *proposal) {
    Material *material = &proposal->material;
    Warnings *warnings = &evaluation->warnings;
    const Statistic *e = &evaluation->restitution, *T = &evaluation->contact_time;
    if (e->count == 0)
        return text_format(&proposal->why,
                           "no reading that counts gives the restitution, which a "
                           "revision needs: add a measurement with heights or speeds")
                   ? STATUS_OK
                   : STATUS_NO_MEMORY;
    for (size_t i = 0; i < evaluation->rows.count; i++)
        if (reading_counts(&evaluation->rows.at[i]))
            basis->rows[basis->count++] = &evaluation->rows.at[i];
    material->restitution = e->mean;
    material->restitution_deviation = e->spread;
    material->contact_time = T->mean;
    material->contact_time_deviation = T->spread;
    if (e->trend.verdict == TREND_NOT_CONSTANT)
        TRY(warnings_add(warnings, "/revision/restitution", "%s", e->trend.detail));
    if (T->trend.verdict == TREND_NOT_CONSTANT)
        TRY(warnings_add(warnings, "/revision/contact_time", "%s", T->trend.detail));
    return T->count > 0 ? STATUS_OK
                        : warnings_add(warnings, "/revision/contact_time",
                                       "no contact time is known: the material can be used with "
                                       "impulsive contact only");
}

// The rows of the basis that make one row of the table.
typedef struct Bin {
    size_t first, count;
    bool has_restitution, has_time;
} Bin;

static int proposal_compare(const void *a, const void *b) {
    const double left = (*(const EvaluationRow *const *)a)->approach_speed;
    const double right = (*(const EvaluationRow *const *)b)->approach_speed;
    return left < right ? -1 : left > right ? 1 : 0;
}

// Collects the rows that count and have a speed, in bins. `bins` has room for all rows.
static size_t proposal_make_bins(const Evaluation *evaluation, Basis *basis, Bin *bins) {
    size_t count = 0;
    for (size_t i = 0; i < evaluation->rows.count; i++) {
        const EvaluationRow *row = &evaluation->rows.at[i];
        if (reading_counts(row) && !isnan(row->approach_speed))
            basis->rows[basis->count++] = row;
    }
    if (basis->count > 0)
        qsort(basis->rows, basis->count, sizeof(const EvaluationRow *), proposal_compare);
    for (size_t i = 0; i < basis->count; i++) {
        const EvaluationRow *row = basis->rows[i];
        if (count == 0 ||
            row->approach_speed > PROPOSAL_BIN * basis->rows[bins[count - 1].first]->approach_speed)
            bins[count++] = (Bin){.first = i};
        Bin *bin = &bins[count - 1];
        bin->count++;
        bin->has_restitution = bin->has_restitution || row->restitution_counts;
        bin->has_time = bin->has_time || row->contact_time_counts;
    }
    return count;
}

// Every row of a table needs e, and T_c if any has it: drops the other bins with their rows.
static size_t proposal_keep_bins(Basis *basis, Bin *bins, size_t count, bool *has_time) {
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
            basis->rows[rows++] = basis->rows[bins[i].first + k];
        kept++;
    }
    basis->count = rows;
    return kept;
}

// Mean and deviation of T_c or e in a bin, by the same rule as over all readings.
static Status proposal_fold(const Basis *basis, const Bin *bin, bool is_time, Reading *readings,
                            double *mean, double *deviation) {
    size_t count = 0;
    for (size_t i = 0; i < bin->count; i++)
        count += reading_get(basis->rows[bin->first + i], is_time, &readings[count]);
    Statistic statistic;
    const Status status = reading_statistics_run(readings, count, "reading", "", &statistic, NULL);
    *mean = statistic.mean;
    *deviation = statistic.spread;
    fields_clear(reading_statistic_fields, &statistic);
    return status;
}

static Status proposal_fill_table(const Basis *basis, const Bin *bins, size_t count,
                                  Reading *readings, MaterialRows *table) {
    table->at = calloc(count, sizeof *table->at);
    if (table->at == NULL)
        return STATUS_NO_MEMORY;
    table->count = count;
    for (size_t i = 0; i < count; i++) {
        MaterialRow *row = &table->at[i];
        double sum = 0;
        for (size_t k = 0; k < bins[i].count; k++)
            sum += basis->rows[bins[i].first + k]->approach_speed;
        row->approach_speed = sum / (double)bins[i].count;
        TRY(proposal_fold(basis, &bins[i], false, readings, &row->restitution,
                          &row->restitution_deviation));
        TRY(proposal_fold(basis, &bins[i], true, readings, &row->contact_time,
                          &row->contact_time_deviation));
    }
    return STATUS_OK;
}

// `bins` and `readings` have room for all rows and one more.
static Status proposal_set_table(Evaluation *evaluation, Basis *basis, Bin *bins, Reading *readings,
                                 MaterialProposal *proposal) {
    bool has_time;
    const size_t all = proposal_make_bins(evaluation, basis, bins);
    const size_t kept = proposal_keep_bins(basis, bins, all, &has_time);
    if (kept < 2 || kept > MATERIAL_ROWS)
        return text_format(
                   &proposal->why,
                   "a table needs e%s at two approach speeds at least (%g times one another), "
                   "%d at most; the readings have %zu",
                   has_time ? " and T_c" : "", PROPOSAL_BIN, MATERIAL_ROWS, kept)
                   ? STATUS_OK
                   : STATUS_NO_MEMORY;
    TRY(proposal_fill_table(basis, bins, kept, readings, &proposal->material.table));
    if (kept < all)
        TRY(warnings_add(&evaluation->warnings, "/revision/table",
                         "%zu of %zu speeds are left out: e%s is not known there", all - kept, all,
                         has_time ? " or T_c" : ""));
    return has_time ? STATUS_OK
                    : warnings_add(&evaluation->warnings, "/revision/table",
                                   "no contact time is known at any speed: the material can be "
                                   "used with impulsive contact only");
}

Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *proposal,
                             Problem *problem) {
    *proposal = (MaterialProposal){.why = NULL};
    const size_t room = evaluation->rows.count + 1;
    Basis basis = {.rows = calloc(room, sizeof(const EvaluationRow *)),
                   .tests = calloc(count + 1, sizeof(Measurement))};
    Bin *bins = calloc(room, sizeof *bins);
    Reading *readings = calloc(room, sizeof *readings);
    Status status = basis.rows != NULL && basis.tests != NULL && bins != NULL && readings != NULL
                        ? proposal_describe(before, &proposal->material)
                        : STATUS_NO_MEMORY;
    if (status == STATUS_OK)
        status = form == PROPOSAL_TABLE
                     ? proposal_set_table(evaluation, &basis, bins, readings, proposal)
                     : proposal_set_constant(evaluation, &basis, proposal);
    if (status == STATUS_OK && proposal->why == NULL)
        status = proposal_set_basis(evaluation, tests, count, &basis, &proposal->material);
    free(basis.rows);
    free(basis.tests);
    free(bins);
    free(readings);
    if (status != STATUS_OK || proposal->why != NULL)
        fields_clear(material_fields, &proposal->material);
    return status == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the proposal");
}
