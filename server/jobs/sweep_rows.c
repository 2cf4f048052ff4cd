#include "server/jobs/sweep_rows.h"

#include <stdlib.h>
#include <string.h>

#include "server/jobs/job.h"
#include "server/jobs/resolve_record.h"
#include "server/jobs/sweep.h"
#include "server/json/parse.h"

// Bytes of rows that are read at once, more only where one of each chunk is.
enum { WINDOW = 4 << 20 };

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep's table");
}

static Status read_scene(SweepView *show, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return no_memory(problem);
    const Status status = json_parse(show->row.scene, strlen(show->row.scene), study_request_fields,
                                     &show->inquiry, fault);
    // A fault here is ours, not the client's.
    if (status != STATUS_OK)
        problem_set(problem, STATUS_INTERNAL, "the stored scene cannot be read: %s", fault->detail);
    // Points' scenes take their records from here. Where one is gone they say so.
    if (status == STATUS_OK) {
        (void)resolve_record_motion(show->db, &show->inquiry.simulation, fault);
        (void)resolve_sweep_records(show->db, &show->inquiry, fault);
    }
    free(fault);
    if (status != STATUS_OK)
        return STATUS_INTERNAL;
    const Variant *study = show->inquiry.study;
    return study != NULL && study_kind(study) == &study_sweep
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND,
                             "the scene asked for no sweep: submit it with a member study");
}

static const SweepStudy *study_of(const SweepView *show) {
    return (const SweepStudy *)(const void *)show->inquiry.study;
}

static Status tell(SweepView *show, Problem *problem) {
    show->sweep = (Sweep *)(void *)variant_new(study_sweep.answer);
    if (show->sweep == NULL)
        return no_memory(problem);
    return sweep_describe(study_of(show), &show->inquiry.simulation, show->sweep, problem);
}

// What became of the points that failed in one way.
typedef struct Failed {
    uint64_t count, first;
    char why[200];
} Failed;

static void take_failures(const SweepRow *row, const SweepChunkRow *chunk, Failed *failed) {
    for (size_t place = 0; place < sweep_rows_of(row, chunk->chunk); place++) {
        const uint64_t point = chunk->chunk + place * row->chunks;
        const SweepStatus status = sweep_row_status(row, chunk, place);
        Failed *one = &failed[status];
        if (status == SWEEP_MADE)
            continue;
        // Only the first of each kind is told in words.
        if (one->count == 0 || point < one->first) {
            one->first = point;
            sweep_row_reason(chunk, place, one->why, sizeof one->why);
        }
        one->count++;
    }
}

// Chunk by chunk, those alone that have any.
static Status find_failures(SweepView *show, Problem *problem) {
    Failed failed[SWEEP_STATUSES] = {{0}};
    SweepTable *table = &show->sweep->table;
    for (size_t i = 0; i < show->chunks.count; i++) {
        const SweepChunkRow *head = &show->chunks.at[i];
        SweepChunkRow chunk = {0};
        if (head->failed == 0)
            continue;
        TRY(db_sweep_chunk(show->db, show->row.number, head->chunk, &chunk, problem));
        take_failures(&show->row, &chunk, failed);
        sweep_chunk_row_clear(&chunk);
    }
    table->failed = 0;
    for (;;) {
        Failed *first = NULL;
        for (size_t i = 0; i < SWEEP_STATUSES; i++)
            if (failed[i].count > 0 && (first == NULL || failed[i].first < first->first))
                first = &failed[i];
        if (first == NULL)
            return STATUS_OK;
        TRY(study_result(study_failures_add(&table->failures, (int)(first - failed), NULL,
                                            first->first, first->why),
                         problem));
        table->failures.at[table->failures.count - 1].count = first->count;
        table->failed += first->count;
        first->count = 0;
    }
}

// A sweep that has not begun has no rows, but is one.
static Status find(Db *db, const char *id, bool is_job, SweepRow *row, Problem *problem) {
    JobRow job;
    if (!is_job)
        return db_sweep_load(db, id, row, problem);
    TRY(db_job_load(db, id, &job, problem));
    const bool has_scene = job.state != JOB_SUCCESSFUL; // that was its result's
    const Status status = db_sweep_load(db, job.result, row, has_scene ? NULL : problem);
    job_row_clear(&job);
    if (status == STATUS_NOT_FOUND && has_scene)
        return db_sweep_asked(db, id, row, problem);
    return status == STATUS_OK || status == STATUS_NOT_FOUND
               ? status
               : problem_set(problem, status, "the sweeps cannot be searched");
}

Status sweep_view_load(Db *db, const char *id, bool is_job, bool has_rows, SweepView *show,
                       Problem *problem) {
    memset(show, 0, sizeof *show);
    show->db = db;
    TRY(find(db, id, is_job, &show->row, problem));
    TRY(read_scene(show, problem));
    TRY(tell(show, problem));
    TRY(db_sweep_chunks(db, show->row.number, &show->chunks, problem));
    show->is_complete = show->row.chunks > 0 && show->chunks.count == show->row.chunks;
    for (size_t i = 0; i < show->chunks.count; i++) {
        show->is_complete = show->is_complete && !show->chunks.at[i].is_open;
        show->rows += sweep_rows_of(&show->row, show->chunks.at[i].chunk);
    }
    return has_rows ? find_failures(show, problem) : STATUS_OK;
}

void sweep_view_clear(SweepView *show) {
    sweep_row_clear(&show->row);
    study_request_clear(&show->inquiry);
    variant_free((Variant *)(void *)show->sweep);
    sweep_chunk_rows_clear(&show->chunks);
    free(show->window);
    *show = (SweepView){.sweep = NULL};
}

// Rows at these places of all chunks that are there: as many places as fit, the last perhaps not
// there.
static bool load_window(SweepView *show, size_t place) {
    const size_t size = sweep_row_size(&show->row) * show->chunks.count;
    if (show->window == NULL) {
        const size_t all = (size_t)((show->row.points + show->row.chunks - 1) / show->row.chunks);
        const size_t fit = WINDOW / size > 0 ? WINDOW / size : 1;
        show->places = fit < all ? fit : all;
        show->window = malloc(size * show->places);
        if (show->window == NULL)
            return false;
    }
    show->is_loaded =
        db_sweep_read(show->db, &show->row, &show->chunks, place * sweep_row_size(&show->row),
                      show->places * sweep_row_size(&show->row), show->window, NULL) == STATUS_OK;
    show->place = place;
    return show->is_loaded;
}

bool sweep_view_read(void *of, size_t cell, size_t first, size_t count, double *target) {
    SweepView *show = of;
    const size_t wide = show->chunks.count, size = sweep_row_size(&show->row);
    if (count == 0)
        return true;
    if (count > show->rows || first > show->rows - count)
        return false;
    // Chunks lie beside each other: row number wide of them is the first one's second.
    size_t place = first / wide, among = first % wide;
    for (size_t i = 0; i < count; i++) {
        if (!show->is_loaded || place < show->place || place >= show->place + show->places)
            if (!load_window(show, place))
                return false;
        const unsigned char *row =
            show->window + (among * show->places + place - show->place) * size;
        target[i] = cell == 0 ? (double)(show->chunks.at[among].chunk + place * show->row.chunks)
                              : sweep_row_cell(row, cell - 1);
        if (++among == wide) {
            among = 0;
            place++;
        }
    }
    return true;
}

Status sweep_point_load(Db *db, const SweepView *show, uint64_t point, SweepPointView *target,
                        Problem *problem) {
    SweepGrid *grid;
    SweepChunkRow chunk = {0};
    const SweepRow *row = &show->row;
    *target = (SweepPointView){.status = SWEEP_PENDING};
    if (point >= row->points)
        return problem_set(problem, STATUS_NOT_FOUND, "the sweep has points 0 to %llu",
                           (unsigned long long)(row->points - 1));
    target->values = calloc(row->metrics, sizeof *target->values);
    if (target->values == NULL)
        return no_memory(problem);
    const Status known = db_sweep_chunk(db, row->number, point % row->chunks, &chunk, NULL);
    if (known != STATUS_OK && known != STATUS_NOT_FOUND)
        return problem_set(problem, known, "the sweep's rows cannot be read");
    const size_t place = (size_t)(point / row->chunks);
    target->status = sweep_row_status(row, &chunk, place);
    sweep_row_values(row, &chunk, place, target->values);
    sweep_row_reason(&chunk, place, target->why, sizeof target->why);
    sweep_chunk_row_clear(&chunk);
    Status made = sweep_grid_new(study_of(show), &show->inquiry.simulation, NULL, &grid, problem);
    if (made == STATUS_OK)
        made =
            sweep_grid_scene(grid, (size_t)point, false, NULL, &target->scene.simulation, problem);
    sweep_grid_free(grid);
    return made;
}
