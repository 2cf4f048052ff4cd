#include "server/jobs/sweep_rows.h"

#include <stdlib.h>
#include <string.h>

#include "server/codec/read.h"
#include "server/jobs/job.h"
#include "server/jobs/sweep.h"

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep's table");
}

static Status read_scene(SweepShow *show, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return no_memory(problem);
    const Status status =
        read_json(show->row.scene, strlen(show->row.scene), inquiry_fields, &show->inquiry, fault);
    // A fault here is ours, not the client's.
    if (status != STATUS_OK)
        problem_set(problem, STATUS_INTERNAL, "the stored scene cannot be read: %s", fault->detail);
    free(fault);
    if (status != STATUS_OK)
        return STATUS_INTERNAL;
    const Variant *study = show->inquiry.study;
    return study != NULL && study_kind(study) == &study_sweep
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND,
                             "the scene asked for no sweep: submit it with a member study");
}

static const SweepStudy *study_of(const SweepShow *show) {
    return (const SweepStudy *)(const void *)show->inquiry.study;
}

static Status tell(SweepShow *show, Problem *problem) {
    show->sweep = (Sweep *)(void *)variant_new(study_sweep.answer);
    if (show->sweep == NULL)
        return no_memory(problem);
    return sweep_tell(study_of(show), &show->inquiry.simulation, show->sweep, problem);
}

static bool make_room(SweepTable *table, size_t rows, size_t metrics) {
    if (rows == 0)
        return true;
    table->points.at = calloc(rows, sizeof(double));
    table->statuses.at = calloc(rows, sizeof(double));
    table->values.at = calloc(rows * metrics, sizeof(double));
    if (table->points.at == NULL || table->statuses.at == NULL || table->values.at == NULL)
        return false;
    table->points.count = table->statuses.count = rows;
    table->values.count = rows * metrics;
    return true;
}

// Rows in the order of their points: place by place, in each the chunks that are there.
static Status fill(const SweepShow *show, const SweepChunkRows *chunks, Problem *problem) {
    const SweepRow *row = &show->row;
    SweepTable *table = &show->sweep->table;
    size_t rows = 0, at = 0;
    for (size_t i = 0; i < chunks->count; i++)
        rows += sweep_rows_of(row, chunks->at[i].chunk);
    table->failed = 0;
    if (!make_room(table, rows, row->metrics))
        return no_memory(problem);
    for (size_t place = 0; at < rows; place++)
        for (size_t i = 0; i < chunks->count && at < rows; i++) {
            const SweepChunkRow *chunk = &chunks->at[i];
            const size_t point = chunk->chunk + place * row->chunks;
            if (point >= row->points)
                continue;
            const SweepStatus status = sweep_row_status(row, chunk, place);
            table->points.at[at] = (double)point;
            table->statuses.at[at] = status;
            sweep_row_values(row, chunk, place, &table->values.at[at * row->metrics]);
            at++;
            if (status == SWEEP_MADE)
                continue;
            char why[200] = "";
            table->failed++;
            // Only the first of each kind is told in words.
            bool is_known = false;
            for (size_t k = 0; k < table->failures.count; k++)
                is_known = is_known || table->failures.at[k].status == (int)status;
            if (!is_known)
                sweep_row_reason(chunk, place, why, sizeof why);
            if (sweep_add_failure(&table->failures, status, point, why) != STATUS_OK)
                return no_memory(problem);
        }
    return STATUS_OK;
}

// A sweep that has not begun has no rows, but is one.
static Status find(Store *store, const char *id, bool is_job, SweepRow *row, Problem *problem) {
    JobRow job;
    if (!is_job)
        return store_sweep_load(store, id, row, problem);
    TRY(store_job_load(store, id, &job, problem));
    const bool has_scene = job.state != JOB_SUCCESSFUL; // that was its result's
    const Status status = store_sweep_load(store, job.result, row, has_scene ? NULL : problem);
    job_row_clear(&job);
    if (status == STATUS_NOT_FOUND && has_scene)
        return store_sweep_asked(store, id, row, problem);
    return status == STATUS_OK || status == STATUS_NOT_FOUND
               ? status
               : problem_set(problem, status, "the sweeps cannot be searched");
}

Status sweep_show_load(Store *store, const char *id, bool is_job, bool has_rows, SweepShow *show,
                       Problem *problem) {
    SweepChunkRows chunks = {NULL, 0};
    memset(show, 0, sizeof *show);
    TRY(find(store, id, is_job, &show->row, problem));
    TRY(read_scene(show, problem));
    TRY(tell(show, problem));
    TRY(store_sweep_chunks(store, show->row.number, has_rows, &chunks, problem));
    show->chunks_done = chunks.count;
    show->is_complete = show->row.chunks > 0 && chunks.count == show->row.chunks;
    for (size_t i = 0; i < chunks.count; i++)
        show->is_complete = show->is_complete && !chunks.at[i].is_open;
    const Status status = has_rows ? fill(show, &chunks, problem) : STATUS_OK;
    sweep_chunk_rows_clear(&chunks);
    return status;
}

void sweep_show_clear(SweepShow *show) {
    sweep_row_clear(&show->row);
    inquiry_clear(&show->inquiry);
    variant_free((Variant *)(void *)show->sweep);
    *show = (SweepShow){.sweep = NULL};
}

Status sweep_point_load(Store *store, const SweepShow *show, uint64_t point, SweepPointShow *target,
                        Problem *problem) {
    SweepPlan *plan;
    SweepChunkRow chunk = {0};
    const SweepRow *row = &show->row;
    *target = (SweepPointShow){.status = SWEEP_PENDING};
    if (point >= row->points)
        return problem_set(problem, STATUS_NOT_FOUND, "the sweep has points 0 to %llu",
                           (unsigned long long)(row->points - 1));
    target->values = calloc(row->metrics, sizeof *target->values);
    if (target->values == NULL)
        return no_memory(problem);
    const Status known = store_sweep_chunk(store, row->number, point % row->chunks, &chunk, NULL);
    if (known != STATUS_OK && known != STATUS_NOT_FOUND)
        return problem_set(problem, known, "the sweep's rows cannot be read");
    const size_t place = (size_t)(point / row->chunks);
    target->status = sweep_row_status(row, &chunk, place);
    sweep_row_values(row, &chunk, place, target->values);
    sweep_row_reason(&chunk, place, target->why, sizeof target->why);
    sweep_chunk_row_clear(&chunk);
    TRY(sweep_plan_new(study_of(show), &show->inquiry.simulation, NULL, &plan, problem));
    const Status made =
        sweep_scene(plan, (size_t)point, false, NULL, &target->scene.simulation, problem);
    sweep_plan_free(plan);
    return made;
}
