// Slurm by its commands: sbatch, squeue, scancel, sinfo and scontrol, run without a shell.
#ifndef SERVER_JOBS_SLURM_H
#define SERVER_JOBS_SLURM_H

#include <stdint.h>

#include "core/base/field.h"
#include "core/base/status.h"

typedef struct SlurmSettings {
    const char *partition; // NULL: the cluster's default
    Texts options;         // further ones for sbatch, as "--account=lab"; borrowed
} SlurmSettings;

// What the file `start` in the folder of a study has: sbatch takes scripts alone, this one becomes
// the program.
extern const char slurm_start[];

// Tasks of one array job: task i of them makes chunk first + i.
typedef struct SlurmArray {
    const char *name;    // of the job
    const char *folder;  // of the study
    const char *program; // impactd's path on the nodes
    const char *tasks;   // "0,1,105"
    uint64_t first;
    double seconds; // asked for each task
} SlurmArray;
// STATUS_IO: Slurm refused, with its reason; STATUS_TIMEOUT: it may have taken the job.
Status slurm_submit(const SlurmSettings *settings, const SlurmArray *array, Problem *problem);

typedef enum SlurmState {
    SLURM_QUEUED,
    SLURM_RUNNING,
    SLURM_HELD, // behind a failure: it will not start by itself
    SLURM_ENDED,
} SlurmState;
typedef struct SlurmTask {
    uint64_t job, chunk;
    char id[44]; // "123_4"; what the worker printed is in FOLDER/log/ID
    SlurmState state;
    int exit_code;   // of one that ended
    char reason[80]; // why it waits, or how it ended: "OUT_OF_MEMORY"
} SlurmTask;
typedef struct SlurmTasks {
    SlurmTask *at;
    size_t count;
} SlurmTasks;
// All tasks of jobs of this name, also those that ended not long ago. A failure says nothing about
// any task. The list is freed by the caller.
Status slurm_tasks(const char *name, SlurmTasks *tasks, Problem *problem);

// Cancels all jobs of this name, or (`is_task`) one task by its id.
Status slurm_cancel(const char *name, bool is_task, Problem *problem);

// What the partition has.
typedef struct SlurmFacts {
    size_t slots;     // processors that are up or allocated
    size_t array_max; // largest index of a task, plus 1
    char reason[160]; // why none of its nodes takes jobs, as Slurm says; "" if one does
} SlurmFacts;
Status slurm_facts(const SlurmSettings *settings, SlurmFacts *facts, Problem *problem);

#endif
