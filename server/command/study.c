#include "server/command/study.h"

#include <stdio.h>
#include <string.h>

#include "core/study/study.h"
#include "server/base/clock.h"
#include "server/command/bar.h"
#include "server/command/command.h"
#include "server/command/crew.h"
#include "server/command/output.h"
#include "server/command/scene_file.h"
#include "server/encode/answer.h"
#include "server/jobs/intake.h"

const char *study_number(char text[24], const char *format, double value) {
    if (isnan(value))
        snprintf(text, 24, "-");
    else
        snprintf(text, 24, format, value);
    return text;
}

// The format that a path ends in, NULL if there is none.
static const AnswerFormat *format_of(const StudyCommand *command, const char *path) {
    const char *extension = strrchr(path, '.');
    if (extension == NULL || extension == path || extension[-1] == '/')
        return NULL;
    return answer_format_find(answer_formats(command->kind->answer), extension + 1);
}

static Status check_outputs(const StudyCommand *command, const Texts *outputs, Problem *problem) {
    Status status = STATUS_OK;
    char names[64];
    answer_formats_name(answer_formats(command->kind->answer), ".", names, sizeof names);
    for (size_t i = 0; i < outputs->count; i++)
        if (format_of(command, outputs->at[i]) == NULL)
            status = problem_add(problem, STATUS_USAGE, "--output",
                                 "must end in one of %s, is %.200s", names, outputs->at[i]);
    return status;
}

static Status file_write(const StudyCommand *command, const char *path, const Variant *answer,
                         Problem *problem) {
    Bytes bytes = {0};
    format_of(command, path)->write(answer, &bytes);
    Status status = bytes.is_failed
                        ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer")
                        : output_open(path, problem);
    if (status == STATUS_OK)
        status = output_write(bytes.at, bytes.count, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    bytes_clear(&bytes);
    return status;
}

static double thread_cpu(void *context) {
    (void)context;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

// CPU times are measured on one thread, by itself.
static Status measure(const StudyRequest *inquiry, const SimulationLimits *limits,
                      const Progress *watch, Variant **answer, Problem *problem) {
    Workspace workspace = {0};
    const StudyTools tools = {
        .limits = limits, .progress = watch, .workspace = &workspace, .cpu = thread_cpu};
    const Status status = study_run(inquiry->study, &inquiry->simulation, &tools, answer, problem);
    workspace_clear(&workspace);
    return status;
}

static Status study_make(const StudyCommand *command, const StudyRequest *inquiry,
                         const Texts *outputs, const SimulationLimits *limits, Problem *problem) {
    Bar bar;
    Variant *answer = NULL;
    bar_start(&bar);
    const Progress watch = bar_watch(&bar);
    Status status =
        study_has_members(inquiry->study)
            ? crew_run(inquiry->study, &inquiry->simulation, limits, &watch, &answer, problem)
            : measure(inquiry, limits, &watch, &answer, problem);
    bar_stop(&bar);
    if (status == STATUS_OK && (command->choose != NULL || outputs->count == 0))
        command->print(answer);
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++)
        status = file_write(command, outputs->at[i], answer, problem);
    variant_free(answer);
    return status;
}

// The document's own study, or a new one, with what the flags say.
static Status study_choose(const StudyCommand *command, StudyRequest *inquiry, void *settings,
                           Problem *problem) {
    if (inquiry->study == NULL && command->kind == NULL)
        return problem_add(problem, STATUS_INVALID, "/study",
                           "is required: what is to be found out, like {\"kind\": \"%s\"}",
                           studies[0]->kind.name);
    if (command->kind == NULL)
        return STATUS_OK;
    if (inquiry->study != NULL && inquiry->study->kind != &command->kind->kind) {
        variant_free(inquiry->study);
        inquiry->study = NULL;
    }
    if (inquiry->study == NULL)
        inquiry->study = variant_new(&command->kind->kind);
    if (inquiry->study == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    if (command->choose != NULL)
        command->choose(inquiry->study, settings);
    return STATUS_OK;
}

static Status scene_study(const StudyCommand *command, const char *path, const Bytes *text,
                          const Texts *outputs, double cpu_seconds, void *settings,
                          Problem *problem) {
    const SimulationLimits limits = scene_file_limits(cpu_seconds);
    Store *store = NULL;
    StudyRequest inquiry = {0};
    Warnings warnings = {0};
    TRY(store_open(NULL, &store, problem));
    Status status =
        intake_prepare(store, text->at, text->count, &limits, &inquiry, &warnings, problem);
    store_close(store);
    if (status == STATUS_OK)
        scene_file_warn(path, &warnings);
    if (status == STATUS_OK)
        status = study_choose(command, &inquiry, settings, problem);
    if (status == STATUS_OK)
        status = study_request_complete(&inquiry, &limits, NULL, problem);
    StudyCommand own = *command;
    if (status == STATUS_OK && own.kind == NULL) {
        own.kind = study_kind(inquiry.study);
        status = check_outputs(&own, outputs, problem);
    }
    // Before the runs, so that a wrong folder is told now and not after them.
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++) {
        status = output_open(outputs->at[i], problem);
        output_drop();
    }
    if (status == STATUS_OK)
        status = study_make(&own, &inquiry, outputs, &limits, problem);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

int study_command_run(const Command *self, const StudyCommand *command, const Texts *outputs,
                      double cpu_seconds, void *settings, const Options *options,
                      Problem *problem) {
    Status status = command->kind != NULL ? check_outputs(command, outputs, problem) : STATUS_OK;
    if (status == STATUS_OK && options->operand_count != 1)
        status = problem_set(problem, STATUS_USAGE, "takes one scene, is given %zu",
                             options->operand_count);
    if (status != STATUS_OK)
        return command_refuse(self->name, problem);
    const char *path = options->operands[0];
    Bytes text;
    output_guard();
    status = scene_file_read(path, &text, problem);
    if (status == STATUS_OK)
        status = scene_study(command, path, &text, outputs, cpu_seconds, settings, problem);
    bytes_clear(&text);
    if (status != STATUS_OK)
        scene_file_refuse(path, problem);
    return command_exit(status);
}
