// impactd chunk: makes one chunk of a study in a shared folder, as a task of a cluster's scheduler.
// The members are made in a child process, so that one that crashes is a failed run and not a
// failed chunk. The exit code is one of sysexits.h: 65 never succeeds, 74 and 75 may later.
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/cli/command.h"
#include "server/jobs/chunk_file.h"
#include "server/jobs/jobs_private.h"

typedef struct ChunkSettings {
    uint64_t first;
} ChunkSettings;

// clang-format off
static const Field chunk_fields[] = {
    FIELD_COUNT(ChunkSettings, first, NULL, WITHIN(0, 1e6), 0, "chunk of task 0"),
    FIELD_END,
};
// clang-format on

// A chunk on its way.
typedef struct ChunkMaking {
    const char *folder;
    ChunkPlan plan;
    ChunkKey key;
    StudyRequest request;
    SimulationLimits limits; // the study refers to them
    Variant *answer;
    StudyWork *work;
    size_t chunk, count, made; // members
    Bytes bytes;
} ChunkMaking;

static volatile sig_atomic_t chunk_child; // 0: none

// The scheduler wants the processor back: another task makes the chunk anew.
static void chunk_stop(int signal) {
    (void)signal;
    if (chunk_child > 0)
        (void)kill((pid_t)chunk_child, SIGKILL);
    _exit(CHUNK_AGAIN);
}

// The child: makes the members from `made` on and writes them to the pipe. Returns its exit code.
static int chunk_make_members(const ChunkMaking *making, FILE *pipe) {
    Workspace workspace = {0};
    const StudyTools tools = {.limits = &making->limits, .workspace = &workspace};
    Problem problem;
    for (size_t i = making->made; i < making->count; i++) {
        const size_t member = chunk_plan_member(&making->plan, making->chunk, i);
        StudyPart *part = NULL;
        Bytes bytes = {0};
        problem_clear(&problem);
        if (study_part_make(making->work, member, &tools, &part, &problem) != STATUS_OK) {
            fprintf(stderr, "impactd chunk: %s\n", problem.detail);
            return CHUNK_AGAIN;
        }
        part_blob_write(&bytes, part);
        const uint64_t size = bytes.count;
        if (bytes.is_failed || fwrite(&size, sizeof size, 1, pipe) != 1 ||
            fwrite(bytes.at, 1, bytes.count, pipe) != bytes.count || fflush(pipe) != 0)
            return CHUNK_AGAIN;
        bytes_clear(&bytes);
        study_part_free(making->work, part);
    }
    return CHUNK_MADE;
}

// Takes what the child writes, member by member; of one that it did not write whole, nothing.
static void chunk_take_members(ChunkMaking *making, FILE *pipe) {
    uint64_t size;
    while (making->made < making->count && fread(&size, sizeof size, 1, pipe) == 1) {
        char *part = malloc((size_t)size + 1);
        const bool is_whole = part != NULL && fread(part, 1, (size_t)size, pipe) == size;
        if (is_whole) {
            chunk_add(&making->bytes, part, (size_t)size);
            making->made++;
        }
        free(part);
        if (!is_whole)
            return;
    }
}

// The run in which the program crashed.
static void chunk_add_crash(ChunkMaking *making, int signal) {
    char why[160];
    StudyPart part = {.run = {.status = STATUS_INTERNAL, .why = why, .steps = (double)NAN}};
    Bytes bytes = {0};
    snprintf(why, sizeof why, "the program crashed in this run: %s", strsignal(signal));
    fprintf(stderr, "impactd chunk: member %zu: %s\n",
            chunk_plan_member(&making->plan, making->chunk, making->made), why);
    (void)fields_default(summary_fields, &part.run.summary);
    (void)fields_default(reduction_fields, &part.run.reduction);
    part_blob_write(&bytes, &part);
    chunk_add(&making->bytes, bytes.at, bytes.count);
    bytes_clear(&bytes);
    making->made++;
}

static bool signal_is_crash(int signal) {
    return signal == SIGSEGV || signal == SIGBUS || signal == SIGFPE || signal == SIGILL ||
           signal == SIGABRT;
}

// One child, to its end. Returns an exit code; CHUNK_MADE also after a crash, which is a member.
static int chunk_run_child(ChunkMaking *making) {
    int ends[2], state;
    if (pipe(ends) != 0)
        return CHUNK_AGAIN;
    FILE *in = fdopen(ends[0], "r"), *out = fdopen(ends[1], "w");
    const pid_t child = in != NULL && out != NULL ? fork() : -1;
    if (child < 0)
        fprintf(stderr, "impactd chunk: no run can be started: %s\n", strerror(errno));
    if (child == 0) {
        (void)signal(SIGTERM, SIG_DFL);
        (void)fclose(in);
        _exit(chunk_make_members(making, out));
    }
    chunk_child = (sig_atomic_t)child;
    if (out != NULL)
        (void)fclose(out);
    if (child > 0)
        chunk_take_members(making, in);
    if (in != NULL)
        (void)fclose(in);
    while (child > 0 && waitpid(child, &state, 0) < 0 && errno == EINTR)
        ;
    chunk_child = 0;
    if (making->bytes.is_failed)
        fprintf(stderr, "impactd chunk: no memory for a chunk\n");
    if (child < 0 || making->bytes.is_failed)
        return CHUNK_AGAIN;
    if (WIFEXITED(state))
        return WEXITSTATUS(state);
    if (!signal_is_crash(WTERMSIG(state)))
        return CHUNK_AGAIN;
    if (making->made < making->count)
        chunk_add_crash(making, WTERMSIG(state));
    return CHUNK_MADE;
}

// The study begun as everywhere; exit code.
static int chunk_open(ChunkMaking *making, Problem *problem) {
    Status status =
        chunk_folder_read(making->folder, &making->plan, &making->key, &making->request, problem);
    if (status != STATUS_OK)
        return status == STATUS_INVALID ? CHUNK_BAD : CHUNK_AGAIN;
    if (making->request.study == NULL || making->chunk >= making->plan.chunks) {
        (void)problem_set(problem, STATUS_INVALID, "there is no chunk %zu", making->chunk);
        return CHUNK_BAD;
    }
    making->limits = chunk_plan_limits(&making->plan);
    Workspace workspace = {0};
    const StudyTools tools = {
        .limits = &making->limits, .workspace = &workspace, .is_validated = true};
    status = study_begin(making->request.study, &making->request.simulation, &tools,
                         &making->answer, &making->work, problem);
    workspace_clear(&workspace);
    if (status != STATUS_OK)
        return status == STATUS_NO_MEMORY ? CHUNK_AGAIN : CHUNK_BAD;
    if (making->work->members != making->plan.members) {
        (void)problem_set(problem, STATUS_INVALID, "the study has %zu members here, not %llu",
                          making->work->members, (unsigned long long)making->plan.members);
        return CHUNK_BAD;
    }
    making->count = chunk_plan_count(&making->plan, making->chunk);
    return CHUNK_MADE;
}

static int chunk_make(ChunkMaking *making, Problem *problem) {
    ChunkFile made = {.at = 0};
    int code = chunk_open(making, problem);
    if (code != CHUNK_MADE)
        return code;
    const Status found =
        chunk_read(making->folder, &making->plan, &making->key, making->chunk, &made, problem);
    bytes_clear(&made.bytes);
    if (found == STATUS_OK) // by another copy of this task
        return CHUNK_MADE;
    problem_clear(problem);
    chunk_begin(&making->bytes, &making->key, making->chunk, making->count);
    while (code == CHUNK_MADE && making->made < making->count)
        code = chunk_run_child(making);
    if (code != CHUNK_MADE) {
        (void)problem_set(problem, STATUS_IO, "stopped after %zu of %zu runs", making->made,
                          making->count);
        return code;
    }
    const Status status = chunk_save(making->folder, making->chunk, &making->bytes, problem);
    return status == STATUS_OK ? CHUNK_MADE : status == STATUS_FULL ? CHUNK_FULL : CHUNK_AGAIN;
}

static int chunk_run(const Command *self, void *item, const Options *options, Problem *problem) {
    const ChunkSettings *settings = item;
    ChunkMaking making = {.chunk = (size_t)settings->first};
    char *end = NULL;
    const unsigned long task =
        options->operand_count == 2 ? strtoul(options->operands[1], &end, 10) : 0;
    if (options->operand_count != 2 || end == options->operands[1] || *end != '\0') {
        (void)problem_set(problem, STATUS_USAGE, "expects a folder and the number of a task");
        return command_error(self->name, problem);
    }
    making.folder = options->operands[0];
    making.chunk += task;
    (void)signal(SIGTERM, chunk_stop);
    (void)signal(SIGPIPE, SIG_IGN);
    const int code = chunk_make(&making, problem);
    if (code != CHUNK_MADE)
        fprintf(stderr, "impactd chunk %zu: %s\n", making.chunk, problem->detail);
    study_free(making.work);
    variant_free(making.answer);
    study_request_clear(&making.request);
    chunk_plan_clear(&making.plan);
    bytes_clear(&making.bytes);
    return code;
}

const Command command_chunk = {
    .name = "chunk",
    .operands = "FOLDER TASK",
    .summary = "make one chunk of a study in a folder that a cluster shares",
    .help = "impactd serve --executor slurm submits this; there is no need to call it by hand.\n"
            "\n"
            "The exit code is 65 where the chunk can never be made (another version of impactd),\n"
            "74 where the folder is full, 75 where another attempt may succeed.\n",
    .options = chunk_fields,
    .size = sizeof(ChunkSettings),
    .run = chunk_run,
};
