// A file given on the command line: its text, and messages about its faults.
#ifndef SERVER_CLI_SCENE_FILE_H
#define SERVER_CLI_SCENE_FILE_H

#include "core/simulation/simulation.h"
#include "server/cli/command.h"
#include "server/util/bytes.h"

enum {
    SCENE_FILE_BYTES = 16 << 20,
    SCENE_FILE_SAMPLES = 1 << 25,
    SCENE_FILE_IMPACTS = 10000000,
};

// Option of the commands that check or run a scene.
#define SCENE_FILE_CPU_ROW(struct_type)                                                            \
    FIELD_REAL(struct_type, max_cpu_seconds, "s", WITHIN(1e-6, 1e9), SIMULATION_CPU_SECONDS,       \
               "refuse a scene that is predicted to need more CPU time")

// Limits of a scene that is run from the command line.
SimulationLimits scene_file_limits(double cpu_seconds);

// The name of the source in messages: the path, or "standard input" for "-".
const char *scene_file_name(const char *path);

// Runs a command on its one operand, a file or standard input; `what` names it in a message.
// Reports faults under the file's name; returns the exit code. Ctrl-C ends the program from here
// on.
int scene_file_command(const Command *self, const char *what, const Options *options,
                       void *settings,
                       Status (*run)(const char *path, const Bytes *text, void *settings,
                                     Problem *problem),
                       Problem *problem);

// Reads the file, or standard input for "-". Cleared by bytes_clear in any case.
Status scene_file_read(const char *path, Bytes *text, Problem *problem);

// One line on stderr per fault: "scene.json: /structure/mass: must be above 0 kg, is -1". Control
// characters, which a fault may quote from the file, are replaced.
void scene_file_refuse(const char *path, const Problem *problem);
void scene_file_warn(const char *path, const Warnings *warnings);

#endif
