// A subcommand of impactd, and the list of all. A command reads its arguments, calls one module and
// prints the result.
#ifndef SERVER_CLI_COMMAND_H
#define SERVER_CLI_COMMAND_H

#include <stdio.h>

#include "core/base/field.h"
#include "server/options.h"

// Exit codes of the program.
typedef enum CommandExit {
    COMMAND_OK = 0,
    COMMAND_FAILED = 1, // a job or an operation
    COMMAND_USAGE = 2,
    COMMAND_BAD_SCENE = 3,
    COMMAND_NOT_FOUND = 4,
    COMMAND_NOT_ALLOWED = 5,
    COMMAND_UNREACHABLE = 7,
    COMMAND_TIMED_OUT = 8, // the job continues
    COMMAND_INTERRUPTED = 130,
} CommandExit;

typedef struct Command Command;
struct Command {
    const char *name;
    const char *operands;      // as in the help: "SCENE.json"; NULL: none
    const char *summary;       // one line
    const char *help;          // examples, an empty line, remarks; whole lines
    const Field *options;      // rows for help; NULL: none
    const OptionGroup *groups; // headings of the options; NULL: none
    size_t size;               // of the struct that the options describe
    const char *environment;   // prefix of the variables that set options; NULL: none
    // `settings` holds the options; it is cleared by the caller. Returns the exit code.
    int (*run)(const Command *self, void *settings, const Options *options, Problem *problem);
    const struct ApiAction *actions;   // of a command that asks a server; ends with a NULL name
    const struct StudyCommand *study;  // of a command that makes a study
    const struct PrintTableView *view; // of answers as tables; NULL: they are printed as JSON
};

// Each is in the file of its name or of its resource: jobs.c, records.c, study.c.
extern const Command command_serve, command_run, command_check, command_tradeoff, command_ensemble,
    command_study, command_sweep, command_optimize, command_calibrate, command_response,
    command_fragility, command_import, command_materials, command_records, command_token,
    command_backup, command_restore, command_check_db, command_submit, command_watch, command_get,
    command_cancel, command_compare, command_jobs, command_open, command_chunk;

extern const Command *const commands[];        // NULL-terminated
extern const OptionGroup command_groups[];     // headings, each above the command `first`
const Command *command_find(const char *name); // NULL if there is none

// The whole program: finds the command, answers --help, runs it. Returns the exit code.
int command_main(int argc, char *const *argv);

// Prints a line for people. Control characters, which operands, files and servers may have, become
// '?'; on a terminal, lines break between words.
void command_print_line(FILE *file, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Prints all faults on stderr, one a line: NAME: POINTER, separator, detail (did you mean ...?).
void command_print_faults(const char *name, const char *separator, const char *quote,
                          const Problem *problem);

// Usage faults on stderr, "impactd run: --outpt is not an option (did you mean --output?)"; returns
// COMMAND_USAGE.
int command_error(const char *name, const Problem *problem);

// The end of a command: prints the reason of a failure on stderr; returns the exit code.
int command_end(const Command *self, Status status, const Problem *problem);

// The index of the action that the first operand names. `names` points to the name of the first
// action; those of the others follow at `stride` bytes, NULL after the last. STATUS_USAGE lists
// them.
Status command_action(const Options *options, const char *const *names, size_t stride,
                      size_t *index, Problem *problem);

// Sets *folder, where it is NULL, to $IMPACTD_DATA, else to impactd under $XDG_STATE_HOME, else
// under ~/.local/state; the caller frees it. STATUS_USAGE if none of them is set.
Status command_data_folder(char **folder, Problem *problem);

// The rows of settings with Texts of these names, which scene_edit applies.
#define SET_ROW(Type)                                                                              \
    FIELD_TEXTS(Type, set, NULL, NULL, 1000, PRESENCE_OPTIONAL, 0,                                 \
                "value for a member of the scene, as dampers.0.clearance=10mm; repeatable")
#define VARY_ROW(Type)                                                                             \
    FIELD_TEXTS(Type, vary, NULL, NULL, 64, PRESENCE_OPTIONAL, 0,                                  \
                "sweep a member of the scene, as dampers.0.clearance=5mm:30mm:26 (a range of 26 "  \
                "values; add :log for equal ratios) or dampers.0.buffer=sponge,aluminium; "        \
                "repeatable: a grid")
// Applies --set and --vary, if the command has them, to the scene's text. STATUS_USAGE.
Status scene_edit(const Command *self, const void *settings, Bytes *text, Problem *problem);
// Names the faults of axes that came from --vary by that option.
void scene_edit_name_axes(const Command *self, const void *settings, Problem *problem);

// The rows of settings with these members, of the commands serve and check.
enum { EXECUTOR_THREADS, EXECUTOR_SLURM };
extern const char *const executor_names[];
// clang-format off
#define CLUSTER_ROWS(Type, what_) \
    FIELD_CHOICE(Type, executor, executor_names, EXECUTOR_THREADS, what_), \
    FIELD_TEXT(Type, shared, 2000, PRESENCE_OPTIONAL, 0, "folder that this machine and all nodes see under the same path, for the chunks of studies"), \
    FIELD_TEXT(Type, partition, 100, PRESENCE_OPTIONAL, 0, "Slurm's partition (its default)"), \
    FIELD_TEXTS(Type, sbatch_option, NULL, NULL, 32, PRESENCE_OPTIONAL, 0, "further option for sbatch, as --sbatch-option=--account=lab; repeatable")
// clang-format on
// STATUS_USAGE unless the folder is there and only this user may write to it.
Status cluster_check_folder(const char *shared, Problem *problem);
// Prints each step and what it found; the last one makes a chunk on a node.
struct ClusterSettings;
Status cluster_check(const struct ClusterSettings *cluster, Problem *problem);

// The exit code of a Status.
int command_exit(Status status);

#endif
