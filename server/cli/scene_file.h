// A scene given on the command line: its text, and what a person is told about its faults.
// Judges nothing itself.
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

// Of every command that judges or runs a scene, as a row of its options.
#define SCENE_FILE_CPU_ROW(struct_type)                                                            \
    FIELD_REAL(struct_type, max_cpu_seconds, "s", WITHIN(1e-6, 1e9), SIMULATION_CPU_SECONDS,       \
               "CPU time a scene may be predicted to take; it is refused beyond")

// What a scene may take that a person runs.
SimulationLimits scene_file_limits(double cpu_seconds);

// What people call the source of the text: the path, or standard input for "-".
const char *scene_file_name(const char *path);

// Runs a command on its one operand, a file or standard input, which is `what` in a message.
// Reports faults under the file's name; returns the exit code. Ctrl-C ends the program from here
// on.
int scene_file_command(const Command *self, const char *what, const Options *options,
                       void *settings,
                       Status (*run)(const char *path, const Bytes *text, void *settings,
                                     Problem *problem),
                       Problem *problem);

// Reads the file, or standard input for "-". Cleared by bytes_clear in any case.
Status scene_file_read(const char *path, Bytes *text, Problem *problem);

// One line on stderr per fault: "scene.json: /structure/mass: must be above 0 kg, is -1".
void scene_file_refuse(const char *path, const Problem *problem);
void scene_file_warn(const char *path, const Warnings *warnings);

#endif
