// The rows of one chunk: made one after the other, with a look now and then whether others wait.
// What was made stays in the part when it is put back.
#include <stdlib.h>

#include "server/base/clock.h"
#include "server/jobs/sweep.h"

enum { REASONS = 1000, REASON = 160 };     // kept of a chunk's failed rows, and bytes of one
static const double before = 0.05 + 0.095; // of the whole job's progress, until chunks run
static const int64_t look_ns = 1000000;    // how often a chunk looks whether others wait

void sweep_part_free(SweepPart *part) {
    if (part == NULL)
        return;
    sweep_chunk_row_clear(&part->row);
    bytes_clear(&part->reasons);
    free(part);
}

bool sweep_goes_on(void *context, double fraction) {
    (void)fraction;
    const SweepRun *run = context;
    return !atomic_load(&run->computation->is_stopped);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep");
}

// Room for the rows; those that are there already where only failed ones are made again.
static Status begin_part(SweepRun *run, SweepPart *part, Problem *problem) {
    const size_t rows = sweep_rows_of(&run->row, part->chunk);
    const size_t size = rows * sweep_row_size(&run->row);
    if (run->row.retries > 0) {
        const Status known = store_sweep_chunk(run->intake->store, run->row.number, part->chunk,
                                               &part->row, problem);
        part->is_again = known == STATUS_OK && part->row.rows.size == size;
        if (known != STATUS_OK && known != STATUS_NOT_FOUND)
            return known;
        problem_clear(problem);
    }
    if (!part->is_again) {
        sweep_chunk_row_clear(&part->row);
        part->row.rows = (StoredBytes){calloc(rows, sweep_row_size(&run->row)), size};
    }
    free(part->row.reasons);
    part->row.reasons = NULL;
    part->row.sweep = run->row.number;
    part->row.chunk = part->chunk;
    part->row.failed = 0;
    part->row.is_open = false;
    if (part->row.rows.at == NULL)
        part->row.rows.size = 0;
    return part->row.rows.at == NULL ? no_memory(problem) : STATUS_OK;
}

static void keep_reason(SweepPart *part, const char *detail) {
    char line[REASON];
    if (part->row.failed++ >= REASONS)
        return;
    text_fit(line, sizeof line, detail);
    for (char *c = line; *c != '\0'; c++)
        if (*c == '\n')
            *c = ' ';
    bytes_format(&part->reasons, "%zu %s\n", part->place, line);
}

static void tell_progress(const SweepRun *run) {
    const double share = (double)atomic_load(&run->done) / (double)run->row.points;
    atomic_store(&run->computation->progress, (unsigned)(1e4 * (before + (1 - before) * share)));
}

static Status make_row(Worker *worker, SweepRun *run, SweepPart *part, double *values,
                       Problem *problem) {
    const Watch watch = {run, sweep_goes_on};
    SweepStatus status;
    const size_t point = part->chunk + part->place * run->row.chunks;
    if (part->is_again && sweep_row_status(&run->row, &part->row, part->place) == SWEEP_MADE)
        return STATUS_OK;
    TRY(sweep_run_point(run->plan, point, &worker->intake->settings.limits, &watch,
                        &worker->workspace, values, &status, problem));
    sweep_row_put(&run->row, &part->row, part->place, status, values);
    if (status != SWEEP_MADE) {
        keep_reason(part, problem->detail);
        atomic_fetch_add(&run->failed, 1);
    }
    atomic_fetch_add(&run->done, 1);
    return STATUS_OK;
}

static bool others_wait(Intake *intake, const SweepRun *run) {
    pthread_mutex_lock(&intake->lock);
    const size_t own = run->computation->queued.number != 0;
    const bool is_wanted = queue_count(intake->queue) > own || intake->is_closing;
    pthread_mutex_unlock(&intake->lock);
    return is_wanted;
}

Status sweep_part_make(Worker *worker, SweepRun *run, SweepPart *part, Problem *problem) {
    const int64_t turn_ns = (int64_t)SWEEP_TURN_MS * 1000000;
    const size_t rows = sweep_rows_of(&run->row, part->chunk);
    const int64_t began_ns = clock_monotonic_ns();
    int64_t looked_ns = began_ns;
    if (part->row.rows.at == NULL)
        TRY(begin_part(run, part, problem));
    double *values = calloc(run->row.metrics, sizeof *values);
    Status status = values == NULL ? no_memory(problem) : STATUS_OK;
    for (; status == STATUS_OK && part->place < rows; part->place++) {
        const int64_t now_ns = clock_monotonic_ns();
        if (now_ns - looked_ns >= look_ns) {
            looked_ns = now_ns;
            tell_progress(run);
            if (now_ns - began_ns >= turn_ns && others_wait(worker->intake, run)) {
                status = STATUS_BUSY;
                break;
            }
        }
        if (!sweep_goes_on(run, 0))
            status = STATUS_CANCELLED;
        else
            status = make_row(worker, run, part, values, problem);
        if (status != STATUS_OK)
            break;
    }
    free(values);
    if (status == STATUS_OK && part->reasons.count > 0 &&
        (part->row.reasons = bytes_take(&part->reasons, NULL)) == NULL)
        return no_memory(problem);
    part->is_computed = status == STATUS_OK;
    tell_progress(run);
    return status;
}
