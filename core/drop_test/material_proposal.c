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

// A proposal in progress. The lists have room for all rows of the evaluation, or all tests.
typedef struct Proposal {
    Evaluation *evaluation;
    const Measurement *tests;
    size_t test_count;
    const EvaluationRow **rows; // that the revision is based on; of a table by rising speed
    size_t row_count;
    const Measurement **sources; // the tests of these rows, in order
    size_t source_count;
    Reading *readings; // scratch
    MaterialProposal *result;
} Proposal;

static bool proposal_is_same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

// Impactor and base, if all tests have the same.
static Status proposal_set_pair(const Proposal *proposal) {
    Material *material = &proposal->result->material;
    const DropTest *first = proposal->sources[0]->test;
    for (size_t i = 1; i < proposal->source_count; i++) {
        const DropTest *test = proposal->sources[i]->test;
        if (!text_same(test->impactor, first->impactor) || test->base != first->base ||
            !proposal_is_same(test->impactor_mass, first->impactor_mass) ||
            !proposal_is_same(test->base_mass, first->base_mass))
            return warnings_add(&proposal->evaluation->warnings, "/revision/impactor_mass",
                                "impactor and base are left out: the measurements were made with "
                                "different ones");
    }
    material->impactor_mass = first->impactor_mass;
    material->base = first->base;
    material->base_mass = first->base_mass;
    return first->impactor == NULL || (material->impactor = strdup(first->impactor)) != NULL
               ? STATUS_OK
               : STATUS_NO_MEMORY;
}

// The different sources of the tests, else their numbers.
static Status proposal_set_source(const Proposal *proposal) {
    Material *material = &proposal->result->material;
    const Measurement *const *sources = proposal->sources;
    const size_t count = proposal->source_count;
    char text[SOURCE_MAX + 1] = "", number[32];
    for (size_t i = 0; i < count; i++) {
        size_t first = 0;
        while (!text_same(sources[first]->test->source, sources[i]->test->source))
            first++;
        if (sources[i]->test->source != NULL && first == i)
            text_list(text, sizeof text, sources[i]->test->source);
    }
    if (text[0] == '\0') {
        snprintf(text, sizeof text, "measurements of this material:");
        for (size_t i = 0; i < count && sources[i]->number != COUNT_ABSENT; i++) {
            snprintf(number, sizeof number, "%s%llu", i > 0 ? ", " : " ",
                     (unsigned long long)sources[i]->number);
            if (strlen(text) + strlen(number) < sizeof text)
                memcpy(text + strlen(text), number, strlen(number) + 1);
        }
    }
    material->source = strdup(text);
    TRY(status_made(material->source != NULL && reals_allocate(&material->measurements, count)));
    for (size_t i = 0; i < count; i++)
        material->measurements.at[i] = (double)sources[i]->number;
    return STATUS_OK;
}

// Ranges, separation rule, pair and source.
static Status proposal_set_basis(Proposal *proposal) {
    Material *material = &proposal->result->material;
    Ranges ranges = ranges_unknown;
    for (size_t i = 0; i < proposal->row_count; i++) {
        const EvaluationRow *row = proposal->rows[i];
        ranges_extend(&ranges, row, proposal->tests);
        if (row->contact_time_counts && row->contact_time_by == (int)CONTACT_TIME_BY_PULSE)
            material->separation = proposal->evaluation->separation;
    }
    for (size_t test = 0; test < proposal->test_count; test++) {
        size_t i = 0;
        while (i < proposal->row_count && proposal->rows[i]->test != test)
            i++;
        if (i < proposal->row_count)
            proposal->sources[proposal->source_count++] = &proposal->tests[test];
    }
    material->least_speed = ranges.least_speed;
    material->most_speed = ranges.most_speed;
    material->least_temperature = ranges.least_temperature;
    material->most_temperature = ranges.most_temperature;
    TRY(proposal_set_pair(proposal));
    return proposal_set_source(proposal);
}

static Status proposal_set_constant(Proposal *proposal) {
    Material *material = &proposal->result->material;
    const EvaluationRows *rows = &proposal->evaluation->rows;
    Warnings *warnings = &proposal->evaluation->warnings;
    const Statistic *e = &proposal->evaluation->restitution,
                    *T = &proposal->evaluation->contact_time;
    if (e->count == 0)
        return status_made(text_format(&proposal->result->why,
                                       "no reading that counts gives the restitution, which a "
                                       "revision needs: add a measurement with heights or "
                                       "speeds"));
    for (size_t i = 0; i < rows->count; i++)
        if (reading_counts(&rows->at[i]))
            proposal->rows[proposal->row_count++] = &rows->at[i];
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

static int proposal_compare(const void *a, const void *b) {
    const double left = (*(const EvaluationRow *const *)a)->approach_speed;
    const double right = (*(const EvaluationRow *const *)b)->approach_speed;
    return (left > right) - (left < right);
}

// Collects the rows that count and have a speed, in the order of their speeds.
static void proposal_sort_rows(Proposal *proposal) {
    const EvaluationRows *rows = &proposal->evaluation->rows;
    for (size_t i = 0; i < rows->count; i++)
        if (reading_counts(&rows->at[i]) && !isnan(rows->at[i].approach_speed))
            proposal->rows[proposal->row_count++] = &rows->at[i];
    if (proposal->row_count > 0)
        qsort(proposal->rows, proposal->row_count, sizeof *proposal->rows, proposal_compare);
}

// Number of rows from `first` on whose speeds make one row of the table.
static size_t proposal_bin(const Proposal *proposal, size_t first) {
    size_t end = first;
    while (end < proposal->row_count && !(proposal->rows[end]->approach_speed >
                                          PROPOSAL_BIN * proposal->rows[first]->approach_speed))
        end++;
    return end - first;
}

// Mean and deviation of T_c or e of rows, by the same rule as over all readings.
static Status proposal_mean(const Proposal *proposal, size_t first, size_t count, bool is_time,
                            double *mean, double *deviation) {
    size_t found = 0;
    for (size_t i = first; i < first + count; i++)
        found += reading_get(proposal->rows[i], is_time, &proposal->readings[found]);
    Statistic statistic;
    const Status status =
        reading_statistics_run(proposal->readings, found, "reading", "", &statistic);
    *mean = statistic.mean;
    *deviation = statistic.spread;
    fields_clear(reading_statistic_fields, &statistic);
    return status;
}

// A row of the table for each bin. Every row needs e, and T_c if any has it: the other bins are
// left out with their readings. `*all` is the number of bins.
static Status proposal_fill_table(Proposal *proposal, bool has_time, size_t *all) {
    MaterialRows *table = &proposal->result->material.table;
    size_t kept = 0;
    *all = 0;
    table->at = calloc(proposal->row_count + 1, sizeof *table->at);
    TRY(status_made(table->at != NULL));
    for (size_t first = 0, count; first < proposal->row_count; first += count, ++*all) {
        MaterialRow row = {0};
        count = proposal_bin(proposal, first);
        for (size_t i = first; i < first + count; i++)
            row.approach_speed += proposal->rows[i]->approach_speed;
        row.approach_speed /= (double)count;
        TRY(proposal_mean(proposal, first, count, false, &row.restitution,
                          &row.restitution_deviation));
        TRY(proposal_mean(proposal, first, count, true, &row.contact_time,
                          &row.contact_time_deviation));
        if (isnan(row.restitution) || (has_time && isnan(row.contact_time)))
            continue;
        memmove(&proposal->rows[kept], &proposal->rows[first], count * sizeof *proposal->rows);
        kept += count;
        table->at[table->count++] = row;
    }
    proposal->row_count = kept;
    return STATUS_OK;
}

static Status proposal_set_table(Proposal *proposal) {
    Warnings *warnings = &proposal->evaluation->warnings;
    const size_t *kept = &proposal->result->material.table.count;
    bool has_time = false;
    size_t all;
    proposal_sort_rows(proposal);
    for (size_t i = 0; i < proposal->row_count; i++)
        has_time = has_time || proposal->rows[i]->contact_time_counts;
    TRY(proposal_fill_table(proposal, has_time, &all));
    if (*kept < 2 || *kept > MATERIAL_ROWS)
        return status_made(text_format(
            &proposal->result->why,
            "a table needs e%s at two approach speeds at least (%g times one another), %d at most; "
            "the readings have %zu",
            has_time ? " and T_c" : "", PROPOSAL_BIN, MATERIAL_ROWS, *kept));
    if (*kept < all)
        TRY(warnings_add(warnings, "/revision/table",
                         "%zu of %zu speeds are left out: e%s is not known there", all - *kept, all,
                         has_time ? " or T_c" : ""));
    return has_time ? STATUS_OK
                    : warnings_add(warnings, "/revision/table",
                                   "no contact time is known at any speed: the material can be "
                                   "used with impulsive contact only");
}

Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *result,
                             Problem *problem) {
    *result = (MaterialProposal){.why = NULL};
    const size_t room = evaluation->rows.count + 1;
    Proposal proposal = {.evaluation = evaluation,
                         .tests = tests,
                         .test_count = count,
                         .rows = calloc(room, sizeof *proposal.rows),
                         .sources = calloc(count + 1, sizeof *proposal.sources),
                         .readings = calloc(room, sizeof *proposal.readings),
                         .result = result};
    Status status = proposal.rows != NULL && proposal.sources != NULL && proposal.readings != NULL
                        ? proposal_describe(before, &result->material)
                        : STATUS_NO_MEMORY;
    if (status == STATUS_OK)
        status = form == PROPOSAL_TABLE ? proposal_set_table(&proposal)
                                        : proposal_set_constant(&proposal);
    if (status == STATUS_OK && result->why == NULL)
        status = proposal_set_basis(&proposal);
    free(proposal.rows);
    free(proposal.sources);
    free(proposal.readings);
    if (status != STATUS_OK || result->why != NULL)
        fields_clear(material_fields, &result->material);
    return status == STATUS_OK
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the proposal");
}
