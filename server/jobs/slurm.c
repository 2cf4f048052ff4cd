#define _DEFAULT_SOURCE // strsep
#include "server/jobs/slurm.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/util/bytes.h"
#include "server/util/process.h"

enum { OUTPUT_BYTES = 64 << 20, ARGUMENTS = 64, ARRAY_MAX = 1001 };
static const double patience = 20;     // [s] for an answer
static const double least_minutes = 5; // asked for a task: nodes may be busy

const char slurm_start[] = "#!/bin/sh\nexec \"$1\" chunk \"$2\" $(($3 + SLURM_ARRAY_TASK_ID))\n";

// Runs the command in `text`, one word a line, and replaces it by what it prints. Cleared by the
// caller in any case.
static Status slurm_run(Bytes *text, Problem *problem) {
    const char *words[ARGUMENTS + 1] = {NULL};
    Bytes command = *text;
    char *rest = command.at;
    *text = (Bytes){.most = OUTPUT_BYTES};
    for (size_t i = 0; i < ARGUMENTS && (words[i] = strsep(&rest, "\n")) != NULL; i++)
        ;
    const bool has_memory = !command.is_failed && bytes_reserve(text, 0); // also for an empty text
    const Status status = has_memory
                              ? process_run(words, patience, text, problem)
                              : problem_set(problem, STATUS_NO_MEMORY, "no memory for Slurm");
    bytes_clear(&command);
    return status;
}

Status slurm_submit(const SlurmSettings *settings, const SlurmArray *array, Problem *problem) {
    Bytes text = {0};
    bytes_format(&text, "sbatch\n--time=%.0f\n--requeue\n--export=NIL\n--signal=B:TERM@30\n",
                 fmax(least_minutes, ceil(array->seconds / 60)));
    if (settings->partition != NULL)
        bytes_format(&text, "--partition=%s\n", settings->partition);
    for (size_t i = 0; i < settings->options.count; i++)
        bytes_format(&text, "%s\n", settings->options.at[i]);
    // By these the tasks are found and make the right chunks: no option may change them.
    bytes_format(&text,
                 "--parsable\n--job-name=%s\n--array=%s\n--comment=%" PRIu64 "\n--ntasks=1\n"
                 "--output=%s/log/%%A_%%a\n--open-mode=append\n--chdir=/\n"
                 "%s/start\n%s\n%s\n%" PRIu64,
                 array->name, array->tasks, array->first, array->folder, array->folder,
                 array->program, array->folder, array->first);
    const Status status = slurm_run(&text, problem);
    bytes_clear(&text);
    return status;
}

static SlurmState state_of(const char *name, const char *reason) {
    static const char *const ended[] = {"COMPLETED", "FAILED",       "TIMEOUT",   "NODE_FAIL",
                                        "CANCELLED", "PREEMPTED",    "BOOT_FAIL", "DEADLINE",
                                        "REVOKED",   "OUT_OF_MEMORY"};
    for (size_t i = 0; i < COUNT(ended); i++)
        if (strcmp(name, ended[i]) == 0)
            return SLURM_ENDED;
    // "JobHeldAdmin" is somebody's wish.
    if (strstr(reason, "held") != NULL || strcmp(reason, "JobHoldMaxRequeue") == 0 ||
        strcmp(reason, "BadConstraints") == 0 || strcmp(name, "SPECIAL_EXIT") == 0)
        return SLURM_HELD;
    return strcmp(name, "PENDING") == 0 ? SLURM_QUEUED : SLURM_RUNNING;
}

// "123|4|FAILED|0|256|NonZeroExitCode|": the job, the task, its state, the first chunk, how it
// ended as wait() reports it, the reason.
static bool task_read(char *line, SlurmTask *task) {
    enum { JOB, TASK, STATE, FIRST, END, REASON, FIELDS };
    char *fields[FIELDS], *end;
    for (size_t i = 0; i < COUNT(fields); i++)
        if ((fields[i] = strsep(&line, "|")) == NULL)
            return false;
    const uint64_t index = strtoull(fields[TASK], &end, 10);
    if (*end != '\0' || end == fields[TASK])
        return false;
    task->state = state_of(fields[STATE], fields[REASON]);
    task->job = strtoull(fields[JOB], NULL, 10);
    task->chunk = strtoull(fields[FIRST], NULL, 10) + index;
    task->exit_code = (int)(strtoul(fields[END], NULL, 10) >> 8);
    snprintf(task->id, sizeof task->id, "%" PRIu64 "_%" PRIu64, task->job, index);
    const bool has_reason = task->state != SLURM_ENDED && strcmp(fields[REASON], "None") != 0;
    text_fit(task->reason, sizeof task->reason, has_reason ? fields[REASON] : fields[STATE]);
    return true;
}

Status slurm_tasks(const char *name, SlurmTasks *tasks, Problem *problem) {
    Bytes text = {0};
    *tasks = (SlurmTasks){NULL, 0};
    bytes_format(&text,
                 "squeue\n--me\n--noheader\n--array\n--states=all\n--name=%s\n"
                 "--Format=ArrayJobID:|,ArrayTaskID:|,State:|,Comment:|,exit_code:|,Reason:|",
                 name);
    Status status = slurm_run(&text, problem);
    char *rest = status == STATUS_OK ? text.at : NULL;
    for (char *line; status == STATUS_OK && (line = strsep(&rest, "\n")) != NULL;) {
        SlurmTask task = {.job = 0};
        if (!task_read(line, &task))
            continue;
        SlurmTask *added = list_grow(tasks, sizeof *added);
        if (added == NULL)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a list of tasks");
        else
            *added = task;
    }
    bytes_clear(&text);
    return status;
}

Status slurm_cancel(const char *name, bool is_task, Problem *problem) {
    Bytes text = {0};
    bytes_format(&text, "scancel\n%s%s", is_task ? "" : "--name=", name);
    const Status status = slurm_run(&text, problem);
    bytes_clear(&text);
    return status;
}

// Slots of "idle|2/4/0/6|Not responding" lines, one of each state, and the reason where no node
// takes jobs.
static void facts_read_nodes(char *text, SlurmFacts *facts) {
    for (char *line; (line = strsep(&text, "\n")) != NULL;) {
        const char *state = strsep(&line, "|"), *processors = strsep(&line, "|");
        char *end;
        if (line == NULL || strchr(processors, '/') == NULL)
            continue;
        const size_t busy = strtoul(processors, &end, 10), idle = strtoul(end + 1, NULL, 10);
        facts->slots += busy + idle;
        if (busy + idle == 0 && facts->reason[0] == '\0')
            snprintf(facts->reason, sizeof facts->reason, "%.40s: %.100s", state, line);
    }
    if (facts->slots > 0)
        facts->reason[0] = '\0';
    else if (facts->reason[0] == '\0')
        text_fit(facts->reason, sizeof facts->reason,
                 "there is no such partition, or it has no nodes");
}

Status slurm_facts(const SlurmSettings *settings, SlurmFacts *facts, Problem *problem) {
    Bytes text = {0};
    *facts = (SlurmFacts){.array_max = ARRAY_MAX};
    bytes_text(&text, "sinfo\n--noheader\n--noconvert\n--format=%T|%C|%E");
    if (settings->partition != NULL)
        bytes_format(&text, "\n--partition=%s", settings->partition);
    Status status = slurm_run(&text, problem);
    if (status == STATUS_OK)
        facts_read_nodes(text.at, facts);
    bytes_clear(&text);
    TRY(status);
    bytes_text(&text, "scontrol\nshow\nconfig");
    status = slurm_run(&text, problem);
    const char *line = status == STATUS_OK ? strstr(text.at, "MaxArraySize") : NULL;
    const char *value = line != NULL ? strchr(line, '=') : NULL;
    if (value != NULL && strtoul(value + 1, NULL, 10) > 1)
        facts->array_max = strtoul(value + 1, NULL, 10);
    bytes_clear(&text);
    return status;
}
