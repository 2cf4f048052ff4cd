// impactd chunk: makes one chunk of a study in a shared folder, as a task of a cluster's scheduler.
// The members are made in a child process, so that one that crashes is a failed run and not a
// failed chunk. The exit code is one of sysexits.h: 65 never succeeds, 74 and 75 may later.
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/cli/command.h"
#include "server/jobs/chunk_file.h"
#include "server/jobs/jobs_private.h"

// A chunk on its way.
typedef struct ChunkMaking {
    const char *folder;
    ChunkPlan plan;
    ChunkKey key;
    StudyRequest request;
    Variant *answer;
    StudyWork *work;
    size_t chunk, count, made; // members
    Bytes bytes;
} ChunkMaking;

// The scheduler wants the processor back: another task makes the chunk anew.
static void chunk_stop(int signal) {
    (void)signal;
    _exit(CHUNK_AGAIN);
}

// The child: makes the members from `made` on and writes them to the pipe. False: not all.
static bool chunk_make_members(const ChunkMaking *making, FILE *pipe) {
    Workspace workspace = {0};
    const StudyTools tools = {.limits = &making->plan.limits, .workspace = &workspace};
    Problem problem;
    for (size_t i = making->made; i < making->count; i++) {
        const size_t member = chunk_plan_member(&making->plan, making->chunk, i);
        StudyPart *part = NULL;
        Bytes bytes = {0};
        problem_clear(&problem);
        if (study_part_make(making->work, member, &tools, &part, &problem) != STATUS_OK) {
            fprintf(stderr, "impactd chunk: %s\n", problem.detail);
            return false;
        }
        chunk_add(&bytes, part);
        if (bytes.is_failed || fwrite(bytes.at, 1, bytes.count, pipe) != bytes.count ||
            fflush(pipe) != 0) {
            fprintf(stderr, "impactd chunk: a run cannot be handed over: %s\n",
                    bytes.is_failed ? "no memory" : strerror(errno));
            return false;
        }
        bytes_clear(&bytes);
        study_part_free(making->work, part);
    }
    return true;
}

// Takes what the child writes, to its end; of a member that it did not write whole, nothing.
static void chunk_take_members(ChunkMaking *making, FILE *pipe) {
    char block[1 << 16];
    const char *part;
    size_t size, at = making->bytes.count;
    for (size_t count; (count = fread(block, 1, sizeof block, pipe)) > 0;)
        bytes_put(&making->bytes, block, count);
    ChunkFile written = {.bytes = making->bytes, .at = at};
    while (!making->bytes.is_failed && chunk_next(&written, &part, &size))
        making->made++;
    making->bytes.count = making->bytes.is_failed ? 0 : written.at;
}

// The run in which the program crashed.
static void chunk_add_crash(ChunkMaking *making, int signal) {
    char why[160];
    snprintf(why, sizeof why, "the program crashed in this run: %s", strsignal(signal));
    fprintf(stderr, "impactd chunk: member %zu: %s\n",
            chunk_plan_member(&making->plan, making->chunk, making->made), why);
    chunk_add_failure(&making->bytes, STATUS_INTERNAL, why);
    making->made++;
}

static bool signal_is_crash(int signal) {
    return signal == SIGSEGV || signal == SIGBUS || signal == SIGFPE || signal == SIGILL ||
           signal == SIGABRT;
}

// One child, to its end. A crash is a member. False: another attempt may succeed.
static bool chunk_run_child(ChunkMaking *making) {
    int ends[2], state = 0;
    if (pipe(ends) != 0)
        return false;
    FILE *in = fdopen(ends[0], "r"), *out = fdopen(ends[1], "w");
    const pid_t child = in != NULL && out != NULL ? fork() : -1;
    if (child < 0) {
        fprintf(stderr, "impactd chunk: no run can be started: %s\n", strerror(errno));
        return false;
    }
    if (child == 0) {
        (void)signal(SIGTERM, SIG_DFL);
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL); // it ends with its parent
        (void)fclose(in);
        _exit(chunk_make_members(making, out) ? 0 : 1);
    }
    (void)fclose(out);
    chunk_take_members(making, in);
    (void)fclose(in);
    while (waitpid(child, &state, 0) < 0 && errno == EINTR)
        ;
    if (making->bytes.is_failed)
        fprintf(stderr, "impactd chunk: no memory for a chunk\n");
    const bool is_crash = WIFSIGNALED(state) && signal_is_crash(WTERMSIG(state));
    if (is_crash && making->made < making->count)
        chunk_add_crash(making, WTERMSIG(state));
    return (is_crash || (WIFEXITED(state) && WEXITSTATUS(state) == 0)) && !making->bytes.is_failed;
}

// The study begun as everywhere.
static Status chunk_open(ChunkMaking *making, Problem *problem) {
    ChunkPlan *plan = &making->plan;
    Workspace workspace = {0};
    const StudyTools tools = {
        .limits = &plan->limits, .workspace = &workspace, .is_validated = true};
    TRY(chunk_folder_read(making->folder, plan, &making->key, &making->request, problem));
    if (making->request.study == NULL || making->chunk >= plan->chunks)
        return problem_set(problem, STATUS_INVALID, "there is no chunk %zu", making->chunk);
    const Status status = study_begin(making->request.study, &making->request.simulation, &tools,
                                      &making->answer, &making->work, problem);
    workspace_clear(&workspace);
    TRY(status);
    making->count = chunk_plan_count(plan, making->chunk);
    return making->work->members == plan->members
               ? STATUS_OK
               : problem_set(problem, STATUS_INVALID, "the study has %zu members here, not %llu",
                             making->work->members, (unsigned long long)plan->members);
}

static Status chunk_make(ChunkMaking *making, Problem *problem) {
    ChunkFile made = {.at = 0};
    TRY(chunk_open(making, problem));
    const Status found =
        chunk_read(making->folder, &making->plan, &making->key, making->chunk, &made, NULL);
    bytes_clear(&made.bytes);
    if (found == STATUS_OK) // by another copy of this task
        return STATUS_OK;
    chunk_begin(&making->bytes, &making->key, making->chunk, making->count);
    while (making->made < making->count)
        if (!chunk_run_child(making))
            return problem_set(problem, STATUS_IO, "stopped after %zu of %zu runs", making->made,
                               making->count);
    return chunk_save(making->folder, making->chunk, &making->bytes, problem);
}

static int chunk_exit(Status status) {
    return status == STATUS_OK                                         ? CHUNK_MADE
           : status == STATUS_FULL                                     ? CHUNK_FULL
           : status == STATUS_NOT_FOUND || status_is_transient(status) ? CHUNK_AGAIN
                                                                       : CHUNK_BAD;
}

static int chunk_run(const Command *self, void *item, const Options *options, Problem *problem) {
    ChunkMaking making = {.count = 0};
    char *end = NULL;
    (void)item;
    if (options->operand_count == 2) {
        making.folder = options->operands[0];
        making.chunk = strtoul(options->operands[1], &end, 10);
    }
    if (end == NULL || end == options->operands[1] || *end != '\0') {
        (void)problem_set(problem, STATUS_USAGE, "expects a folder and the number of a chunk");
        return command_error(self->name, problem);
    }
    (void)signal(SIGTERM, chunk_stop);
    (void)signal(SIGPIPE, SIG_IGN);
    const int code = chunk_exit(chunk_make(&making, problem));
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
    .operands = "FOLDER CHUNK",
    .summary = "make one chunk of a study in a folder that a cluster shares",
    .help = "impactd serve --executor slurm submits this; there is no need to call it by hand.\n"
            "\n"
            "The exit code is 65 where the chunk can never be made (another version of impactd),\n"
            "74 where the folder is full, 75 where another attempt may succeed.\n",
    .run = chunk_run,
};
