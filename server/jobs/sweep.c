#include "server/jobs/sweep.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_private.h"
#include "server/json/parse.h"

enum { WINDOW_BYTES = 4 << 20 }; // of rows read at once, more only if one row of each chunk is

size_t sweep_rows_of(const SweepRow *row, size_t chunk) {
    return chunk >= row->points ? 0 : (row->points - chunk + row->chunks - 1) / row->chunks;
}

size_t sweep_row_size(const SweepRow *row) {
    return 1 + sizeof(double) * row->metrics;
}

// An unknown byte counts as a failure.
static SweepStatus sweep_bytes_status(const unsigned char *row) {
    return *row < SWEEP_PENDING ? (SweepStatus)*row : SWEEP_FAILED;
}

static double sweep_bytes_metric(const unsigned char *row, size_t metric) {
    double value;
    memcpy(&value, row + 1 + sizeof value * metric, sizeof value);
    return value;
}

SweepStatus sweep_row_get(const SweepRow *row, const SweepChunkRow *chunk, size_t place,
                          double *values) {
    const size_t size = sweep_row_size(row);
    const bool is_there = chunk->rows.at != NULL && (place + 1) * size <= chunk->rows.size;
    const unsigned char *at =
        is_there ? (const unsigned char *)chunk->rows.at + place * size : NULL;
    for (size_t i = 0; i < row->metrics; i++)
        values[i] = is_there ? sweep_bytes_metric(at, i) : (double)NAN;
    return is_there ? sweep_bytes_status(at) : SWEEP_PENDING;
}

void sweep_row_put(const SweepRow *row, SweepChunkRow *chunk, size_t place, SweepStatus status,
                   const double *values) {
    unsigned char *at = (unsigned char *)chunk->rows.at + place * sweep_row_size(row);
    *at++ = (unsigned char)status;
    for (size_t i = 0; i < row->metrics; i++) {
        // One bit pattern for every NAN.
        const double value = isnan(values[i]) ? (double)NAN : values[i];
        memcpy(at + i * sizeof value, &value, sizeof value);
    }
}

// Why the row at `place` failed; "" if that was not kept.
static void sweep_row_reason(const SweepChunkRow *chunk, size_t place, char *why, size_t size) {
    why[0] = '\0';
    for (const char *line = chunk->reasons; line != NULL && *line != '\0';) {
        char *text;
        const size_t number = strtoul(line, &text, 10);
        const size_t length = strcspn(text, "\n");
        if (number == place && *text == ' ') {
            const size_t kept = length - 1 < size ? length - 1 : size - 1;
            memcpy(why, text + 1, kept);
            why[kept] = '\0';
            return;
        }
        line = text + length + (text[length] == '\n');
    }
}

static Status sweep_view_read_scene(SweepView *view, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    Status status = json_parse(view->row.scene, strlen(view->row.scene), study_request_fields,
                               &view->inquiry, fault);
    // A fault here is ours, not the client's.
    if (status != STATUS_OK)
        status = problem_set(problem, status == STATUS_NO_MEMORY ? status : STATUS_INTERNAL,
                             "the stored scene cannot be read: %s", fault->detail);
    // The scenes of points take their records from here; they report a record that is gone.
    if (status == STATUS_OK)
        (void)request_load_records(view->db, &view->inquiry, fault);
    free(fault);
    TRY(status);
    const Variant *study = view->inquiry.study;
    return study != NULL && study_kind(study) == &study_sweep
               ? STATUS_OK
               : problem_set(problem, STATUS_NOT_FOUND,
                             "the scene asked for no sweep: submit it with a member study");
}

static const SweepStudy *sweep_view_study(const SweepView *view) {
    return (const SweepStudy *)(const void *)view->inquiry.study;
}

// The points that failed in one way; only the first has its reason.
typedef struct SweepFailed {
    uint64_t count, first;
    char why[200];
} SweepFailed;

static void sweep_failed_add(const SweepRow *row, const SweepChunkRow *chunk, SweepFailed *failed) {
    for (size_t place = 0; place < sweep_rows_of(row, chunk->chunk); place++) {
        double values[SWEEP_METRICS];
        const uint64_t point = chunk->chunk + place * row->chunks;
        const SweepStatus status = sweep_row_get(row, chunk, place, values);
        SweepFailed *one = &failed[status];
        if (status == SWEEP_MADE)
            continue;
        if (one->count == 0 || point < one->first) {
            one->first = point;
            sweep_row_reason(chunk, place, one->why, sizeof one->why);
        }
        one->count++;
    }
}

const char sweep_rows_changed[] =
    "the table's rows were deleted or computed again while they were read; ask again";

static Status sweep_view_find_failures(SweepView *view, Problem *problem) {
    SweepFailed failed[SWEEP_STATUSES] = {{0}};
    SweepTable *table = &view->sweep->table;
    for (size_t i = 0; i < view->chunks.count; i++) {
        const SweepChunkRow *head = &view->chunks.at[i];
        SweepChunkRow chunk = {0};
        if (head->failed == 0)
            continue;
        TRY(db_sweep_chunk(view->db, view->row.number, head->chunk, &chunk, problem));
        sweep_failed_add(&view->row, &chunk, failed);
        sweep_chunk_row_clear(&chunk);
    }
    table->failed = 0;
    for (;;) {
        SweepFailed *first = NULL;
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

// A sweep that has not begun has no rows, but its job has the scene.
static Status sweep_view_find(Db *db, const char *id, bool is_job, SweepRow *row,
                              Problem *problem) {
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

// Whether its sweep is that of its result still. Both may have been deleted, and made again.
static bool sweep_view_is_current(const SweepView *view) {
    const SweepRow *row = &view->row;
    SweepRow now;
    if (db_sweep_load(view->db, row->result, &now, NULL) != STATUS_OK)
        return false;
    const bool is_same = now.number == row->number && now.created_unix_ms == row->created_unix_ms;
    sweep_row_clear(&now);
    return is_same && db_result_exists(view->db, row->result);
}

Status sweep_view_load(Db *db, const char *id, bool is_job, bool has_failures, SweepView *view,
                       Problem *problem) {
    memset(view, 0, sizeof *view);
    view->db = db;
    TRY(sweep_view_find(db, id, is_job, &view->row, problem));
    TRY(sweep_view_read_scene(view, problem));
    view->sweep = (Sweep *)(void *)variant_new(study_sweep.answer);
    if (view->sweep == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    TRY(sweep_describe(sweep_view_study(view), &view->inquiry.simulation, view->sweep, problem));
    if (view->row.chunks > 0 && view->row.metrics != sweep_view_study(view)->metrics.count)
        return problem_set(problem, STATUS_INTERNAL,
                           "the stored rows no longer belong to this scene");
    // In this order: a result is saved after its chunks.
    const bool is_finished = db_result_exists(db, view->row.result);
    TRY(db_sweep_chunks(db, view->row.number, &view->chunks, problem));
    if (is_finished && view->chunks.count < view->row.chunks && !sweep_view_is_current(view))
        return problem_set(problem, STATUS_BUSY, "%s", sweep_rows_changed);
    if (is_finished && view->chunks.count < view->row.chunks)
        return problem_set(problem, STATUS_INTERNAL,
                           "the database is damaged: %llu of %llu parts of the table of %.72s are "
                           "missing; put a backup in its place (impactd restore)",
                           (unsigned long long)(view->row.chunks - view->chunks.count),
                           (unsigned long long)view->row.chunks, view->row.result);
    if (has_failures) // the whole table
        TRY(db_sweep_compare(db, view->row.number, problem));
    view->is_complete = view->row.chunks > 0 && view->chunks.count == view->row.chunks;
    for (size_t i = 0; i < view->chunks.count; i++) {
        view->is_complete = view->is_complete && !view->chunks.at[i].is_open;
        view->rows += sweep_rows_of(&view->row, view->chunks.at[i].chunk);
    }
    return has_failures ? sweep_view_find_failures(view, problem) : STATUS_OK;
}

void sweep_view_clear(SweepView *view) {
    sweep_row_clear(&view->row);
    study_request_clear(&view->inquiry);
    variant_free((Variant *)(void *)view->sweep);
    sweep_chunk_rows_clear(&view->chunks);
    free(view->window);
    *view = (SweepView){.sweep = NULL};
}

// Loads the rows at these places of all chunks that are there: as many places as fit, the last
// perhaps not there.
static bool sweep_view_load_window(SweepView *view, size_t place) {
    const size_t row_size = sweep_row_size(&view->row), size = row_size * view->chunks.count;
    if (view->window == NULL) {
        const size_t all = (size_t)((view->row.points + view->row.chunks - 1) / view->row.chunks);
        const size_t fit = WINDOW_BYTES / size > 0 ? WINDOW_BYTES / size : 1;
        view->places = fit < all ? fit : all;
        view->window = malloc(size * view->places);
        if (view->window == NULL)
            return false;
    }
    view->is_loaded = db_sweep_read(view->db, &view->row, &view->chunks, place * row_size,
                                    view->places * row_size, view->window, NULL) == STATUS_OK;
    view->place = place;
    return view->is_loaded;
}

bool sweep_view_read(void *of, size_t cell, size_t first, size_t count, double *target) {
    SweepView *view = of;
    const size_t wide = view->chunks.count, size = sweep_row_size(&view->row);
    if (count == 0)
        return true;
    if (count > view->rows || first > view->rows - count)
        return false;
    for (size_t i = 0; i < count; i++) {
        // The rows at one place of all chunks follow each other.
        const size_t place = (first + i) / wide, among = (first + i) % wide;
        if (!view->is_loaded || place < view->place || place >= view->place + view->places)
            if (!sweep_view_load_window(view, place))
                return false;
        const unsigned char *row =
            view->window + (among * view->places + place - view->place) * size;
        target[i] = cell == 0   ? (double)(view->chunks.at[among].chunk + place * view->row.chunks)
                    : cell == 1 ? (double)sweep_bytes_status(row)
                                : sweep_bytes_metric(row, cell - 2);
    }
    return true;
}

Status sweep_point_load(const SweepView *view, uint64_t index, SweepPoint *point,
                        Problem *problem) {
    SweepGrid *grid;
    SweepChunkRow chunk = {0};
    const SweepRow *row = &view->row;
    *point = (SweepPoint){.status = SWEEP_PENDING};
    if (index >= row->points)
        return problem_set(problem, STATUS_NOT_FOUND, "the sweep has points 0 to %llu",
                           (unsigned long long)(row->points - 1));
    const Status found = db_sweep_chunk(view->db, row->number, index % row->chunks, &chunk, NULL);
    if (found != STATUS_OK && found != STATUS_NOT_FOUND)
        return problem_set(problem, found, "the sweep's rows cannot be read");
    const size_t place = (size_t)(index / row->chunks);
    point->status = sweep_row_get(row, &chunk, place, point->values);
    sweep_row_reason(&chunk, place, point->why, sizeof point->why);
    sweep_chunk_row_clear(&chunk);
    Status status =
        sweep_grid_new(sweep_view_study(view), &view->inquiry.simulation, NULL, &grid, problem);
    if (status == STATUS_OK)
        status =
            sweep_grid_scene(grid, (size_t)index, false, NULL, &point->scene.simulation, problem);
    sweep_grid_free(grid);
    return status;
}
