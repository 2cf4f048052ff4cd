#include "server/cli/scene_file.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "server/cli/output.h"
#include "server/json/table.h"

SimulationLimits scene_file_limits(double cpu_seconds) {
    return (SimulationLimits){.samples = SCENE_FILE_SAMPLES,
                              .impacts = SCENE_FILE_IMPACTS,
                              .steps = cpu_seconds / SOLVER_STEP,
                              .bytes = SIMULATION_BYTES};
}

const char *scene_file_name(const char *path) {
    return strcmp(path, "-") == 0 ? "standard input" : path;
}

Status scene_file_read(const char *path, Bytes *text, Problem *problem) {
    *text = (Bytes){.most = SCENE_FILE_BYTES};
    const bool is_input = strcmp(path, "-") == 0;
    FILE *file = is_input ? stdin : fopen(path, "rb");
    if (file == NULL)
        return problem_set(problem,
                           errno == ENOENT   ? STATUS_NOT_FOUND
                           : errno == EACCES ? STATUS_FORBIDDEN
                                             : STATUS_IO,
                           "cannot be read: %s", strerror(errno));
    char piece[65536];
    size_t count = 0;
    while (!text->is_failed && (count = fread(piece, 1, sizeof piece, file)) > 0)
        bytes_put(text, piece, count);
    const int error = ferror(file) ? errno : 0;
    if (!is_input)
        fclose(file);
    if (error != 0)
        return problem_set(problem, STATUS_IO, "cannot be read: %s", strerror(error));
    if (text->is_failed)
        return problem_set(problem, STATUS_TOO_LARGE, "is larger than %d bytes", SCENE_FILE_BYTES);
    return STATUS_OK;
}

int scene_file_command(const Command *self, const char *what, const Options *options,
                       void *settings,
                       Status (*run)(const char *path, const Bytes *text, void *settings,
                                     Problem *problem),
                       Problem *problem) {
    if (options->operand_count != 1) {
        (void)problem_set(problem, STATUS_USAGE, "takes one %s, is given %zu", what,
                          options->operand_count);
        return command_error(self->name, problem);
    }
    const char *path = options->operands[0];
    Bytes text;
    output_guard();
    Status status = scene_file_read(path, &text, problem);
    if (status == STATUS_OK)
        status = run(path, &text, settings, problem);
    bytes_clear(&text);
    if (status != STATUS_OK)
        scene_file_refuse(path, problem);
    return command_exit(status);
}

void scene_file_refuse(const char *path, const Problem *problem) {
    const char *name = scene_file_name(path);
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        Fault fault = problem->faults[i];
        text_make_printable(fault.pointer);
        text_make_printable(fault.detail);
        fprintf(stderr, "%s: %s%s%s", name, fault.pointer, fault.pointer[0] != '\0' ? ": " : "",
                fault.detail);
        if (fault.did_you_mean[0] != '\0')
            fprintf(stderr, " (did you mean \"%s\"?)", fault.did_you_mean);
        fputc('\n', stderr);
    }
    if (problem->count > PROBLEM_FAULTS)
        fprintf(stderr, "%s: and %zu more faults\n", name, problem->count - PROBLEM_FAULTS);
    if (problem->count == 0)
        fprintf(stderr, "%s: %s\n", name, problem->detail);
}

void scene_file_warn(const char *path, const Warnings *warnings) {
    for (size_t i = 0; i < warnings->count; i++)
        fprintf(stderr, "%s: warning: %s: %s\n", scene_file_name(path), warnings->at[i].pointer,
                warnings->at[i].detail);
}
