#include "server/jobs/slurm.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/util/bytes.h"
#include "server/util/subprocess.h"

enum { OUTPUT_BYTES = 64 << 20, ARGUMENTS = 64 };
static const double patience = 20;     // [s] for an answer
static const double least_minutes = 5; // asked for a task: nodes may be busy

// sbatch takes scripts alone; this one becomes the program.
static const char script[] = "/start",
                  script_text[] = "#!/bin/sh\nexec \"$@\" \"$SLURM_ARRAY_TASK_ID\"\n";

// Words of a command line.
typedef struct Words {
    const char *at[ARGUMENTS];
    size_t count;
} Words;

static void words_add(Words *words, const char *word) {
    if (words->count + 1 < ARGUMENTS)
        words->at[words->count++] = word;
}

// Runs a command and returns what it prints; cleared by the caller in any case.
static Status slurm_run(const Words *words, Bytes *output, Problem *problem) {
    *output = (Bytes){.most = OUTPUT_BYTES};
    const Status status = subprocess_run(words->at, patience, output, problem);
    if (status == STATUS_OK && output->at == NULL)
        bytes_text(output, "");
    return status;
}

Status slurm_make_start(const char *folder, Problem *problem) {
    char path[4096];
    snprintf(path, sizeof path, "%.3000s%s", folder, script);
    FILE *file = fopen(path, "we");
    const bool is_written = file != NULL && fputs(script_text, file) >= 0;
    const bool is_closed = file != NULL && fclose(file) == 0;
    return is_written && is_closed
               ? STATUS_OK
               : problem_set(problem, errno == ENOSPC ? STATUS_FULL : STATUS_IO,
                             "%.300s cannot be written: %s", path, strerror(errno));
}

Status slurm_submit(const SlurmSettings *settings, const SlurmArray *array, Problem *problem) {
    char name[160], tasks[8192], time[48], output[4096], start[4096], partition[160], first[24];
    Bytes answer;
    Words words = {.count = 0};
    snprintf(name, sizeof name, "--job-name=%s", array->name);
    snprintf(tasks, sizeof tasks, "--array=%s", array->tasks);
    snprintf(time, sizeof time, "--time=%.0f", fmax(least_minutes, ceil(array->seconds / 60)));
    snprintf(output, sizeof output, "--output=%s/log/%%A_%%a", array->folder);
    snprintf(start, sizeof start, "%s%s", array->folder, script);
    snprintf(partition, sizeof partition, "--partition=%s",
             settings->partition != NULL ? settings->partition : "");
    snprintf(first, sizeof first, "%llu", (unsigned long long)array->first);
    char comment[40];
    snprintf(comment, sizeof comment, "--comment=%s", first);
    const char *const fixed[] = {"sbatch",
                                 "--parsable",
                                 name,
                                 tasks,
                                 time,
                                 output,
                                 comment,
                                 "--requeue",
                                 "--export=NIL",
                                 "--open-mode=append",
                                 "--signal=B:TERM@30",
                                 "--ntasks=1",
                                 "--chdir=/"};
    for (size_t i = 0; i < COUNT(fixed); i++)
        words_add(&words, fixed[i]);
    if (settings->partition != NULL)
        words_add(&words, partition);
    for (size_t i = 0; settings->options != NULL && i < settings->options->count; i++)
        words_add(&words, settings->options->at[i]);
    const char *const command[] = {start, array->program, "chunk", "--first", first, array->folder};
    for (size_t i = 0; i < COUNT(command); i++)
        words_add(&words, command[i]);
    const Status status = slurm_run(&words, &answer, problem);
    bytes_clear(&answer);
    return status;
}

// The text up to the next `end`, which is taken off `*rest`; NULL: there is none.
static char *text_take(char **rest, char end) {
    char *taken = *rest;
    if (taken == NULL || *taken == '\0')
        return NULL;
    char *at = strchr(taken, end);
    *rest = at != NULL ? at + 1 : NULL;
    if (at != NULL)
        *at = '\0';
    return taken;
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
// ended as wait() tells it, the reason.
static bool task_read(char *line, SlurmTask *task) {
    enum { JOB, TASK, STATE, FIRST, END, REASON, FIELDS };
    char *fields[FIELDS];
    for (size_t i = 0; i < COUNT(fields); i++)
        if ((fields[i] = text_take(&line, '|')) == NULL)
            return false;
    char *end;
    const uint64_t index = strtoull(fields[TASK], &end, 10);
    if (*end != '\0' || end == fields[TASK])
        return false;
    task->state = state_of(fields[STATE], fields[REASON]);
    task->job = strtoull(fields[JOB], NULL, 10);
    task->chunk = strtoull(fields[FIRST], NULL, 10) + index;
    task->exit_code = (int)(strtoul(fields[END], NULL, 10) >> 8);
    snprintf(task->id, sizeof task->id, "%llu_%llu", (unsigned long long)task->job,
             (unsigned long long)index);
    const bool has_reason = task->state != SLURM_ENDED && strcmp(fields[REASON], "None") != 0;
    text_fit(task->reason, sizeof task->reason, has_reason ? fields[REASON] : fields[STATE]);
    return true;
}

Status slurm_tasks(const char *name, SlurmTasks *tasks, Problem *problem) {
    char wanted[160];
    Bytes answer;
    Words words = {.count = 0};
    snprintf(wanted, sizeof wanted, "--name=%s", name);
    const char *const all[] = {"squeue",
                               "--me",
                               "--noheader",
                               "--array",
                               "--states=all",
                               wanted,
                               "--Format=ArrayJobID:|,ArrayTaskID:|,State:|,Comment:|,"
                               "exit_code:|,Reason:|"};
    for (size_t i = 0; i < COUNT(all); i++)
        words_add(&words, all[i]);
    *tasks = (SlurmTasks){NULL, 0};
    Status status = slurm_run(&words, &answer, problem);
    char *rest = status == STATUS_OK ? answer.at : NULL;
    for (char *line; status == STATUS_OK && (line = text_take(&rest, '\n')) != NULL;) {
        SlurmTask task;
        if (!task_read(line, &task))
            continue;
        SlurmTask *added = list_grow(tasks, sizeof *added);
        if (added == NULL)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a list of tasks");
        else
            *added = task;
    }
    bytes_clear(&answer);
    return status;
}

Status slurm_cancel(const char *name, bool is_task, Problem *problem) {
    char wanted[160];
    Bytes answer;
    snprintf(wanted, sizeof wanted, "%s%s", is_task ? "" : "--name=", name);
    const Words words = {{"scancel", wanted}, 2};
    const Status status = slurm_run(&words, &answer, problem);
    bytes_clear(&answer);
    return status;
}

// Slots of "idle|2/4/0/6|Not responding" lines, one of each state, and the reason where no node
// takes jobs.
static void facts_read_nodes(char *text, SlurmFacts *facts) {
    bool is_up = false;
    for (char *line; (line = text_take(&text, '\n')) != NULL;) {
        const char *state = text_take(&line, '|'), *processors = text_take(&line, '|'),
                   *reason = line;
        if (reason == NULL || strchr(processors, '/') == NULL)
            continue;
        char *end;
        const size_t busy = strtoul(processors, &end, 10), idle = strtoul(end + 1, NULL, 10);
        facts->slots += busy + idle;
        if (busy + idle > 0)
            is_up = true;
        else if (facts->reason[0] == '\0')
            snprintf(facts->reason, sizeof facts->reason, "%.40s: %.100s", state, reason);
    }
    if (is_up)
        facts->reason[0] = '\0';
    else if (facts->reason[0] == '\0')
        text_fit(facts->reason, sizeof facts->reason,
                 "there is no such partition, or it has no nodes");
}

Status slurm_facts(const SlurmSettings *settings, SlurmFacts *facts, Problem *problem) {
    static const char setting[] = "MaxArraySize";
    char partition[160];
    Bytes answer;
    Words nodes = {{"sinfo", "--noheader", "--format=%T|%C|%E"}, 3};
    *facts = (SlurmFacts){.array_max = 1001};
    snprintf(partition, sizeof partition, "--partition=%s",
             settings->partition != NULL ? settings->partition : "");
    if (settings->partition != NULL)
        words_add(&nodes, partition);
    Status status = slurm_run(&nodes, &answer, problem);
    if (status == STATUS_OK)
        facts_read_nodes(answer.at, facts);
    bytes_clear(&answer);
    TRY(status);
    status = slurm_run(&(Words){{"scontrol", "show", "config"}, 3}, &answer, problem);
    const char *line = status == STATUS_OK ? strstr(answer.at, setting) : NULL;
    const char *value = line != NULL ? strchr(line, '=') : NULL;
    if (value != NULL && strtoul(value + 1, NULL, 10) > 1)
        facts->array_max = strtoul(value + 1, NULL, 10);
    bytes_clear(&answer);
    return status;
}
