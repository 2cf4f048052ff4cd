// The list of subcommands, --help and version.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "core/simulation/simulation.h"
#include "server/api/app.h"
#include "server/cli/command.h"
#include "server/options.h"

static int help_run(const Command *self, void *settings, const Options *options, Problem *problem);
static int version_run(const Command *self, void *settings, const Options *options,
                       Problem *problem);

static const Command command_help = {
    .name = "help",
    .operands = "[COMMAND]",
    .summary = "show the help of a command",
    .help = "  impactd help run\n",
    .run = help_run,
};
static const Command command_version = {
    .name = "version",
    .summary = "print the versions of program and engine",
    .help = "  impactd version\n",
    .run = version_run,
};

const Command *const commands[] = {
    &command_run,       &command_check,
    &command_sweep,     &command_ensemble,
    &command_tradeoff,  &command_optimize,
    &command_calibrate, &command_response,
    &command_fragility, &command_study,
    &command_import,    &command_serve,
    &command_token,     &command_backup,
    &command_restore,   &command_check_db,
    &command_submit,    &command_watch,
    &command_get,       &command_compare,
    &command_cancel,    &command_materials,
    &command_records,   &command_help,
    &command_version,   NULL,
};

const OptionGroup command_groups[] = {
    {"run", "Run here, without a server"},
    {"serve", "Run a server"},
    {"submit", "Jobs of a server"},
    {"materials", "Data of a server"},
    {"help", "Help"},
    {NULL, NULL},
};

static const char overview[] =
    "impactd simulates structures with impact dampers.\n"
    "\n"
    "  impactd serve                        start a server on http://127.0.0.1:8080\n"
    "  impactd run scene.json               run a scene without a server\n"
    "  impactd submit scene.json --wait 60  run a scene on a server\n"
    "  impactd get JOB series -o out.npy    download a part of its result\n"
    "\n"
    "A scene: a structure released from 15 mm, with a ball between two sponges in it.\n"
    "\n"
    "  {\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},\n"
    "   \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],\n"
    "   \"excitation\": {\"kind\": \"free\", \"displacement\": 0.015},\n"
    "   \"duration\": 10, \"sample_rate\": 1000}\n";

static const char exits[] =
    "\n"
    "\"impactd help COMMAND\" shows examples and options of a command. Exit codes: 0 ok,\n"
    "1 failed, 2 usage, 3 faulty scene or file, 4 not found, 5 permission denied,\n"
    "7 server unreachable, 8 job not finished after --wait, 130 interrupted.\n";

const Command *command_find(const char *name) {
    for (size_t i = 0; commands[i] != NULL; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return NULL;
}

static void overview_print(FILE *file) {
    const OptionGroup *group = command_groups;
    fputs(overview, file);
    for (size_t i = 0; commands[i] != NULL; i++) {
        if (group->first != NULL && strcmp(group->first, commands[i]->name) == 0)
            fprintf(file, "\n%s\n", group++->title);
        fprintf(file, "  %-9s  %s\n", commands[i]->name, commands[i]->summary);
    }
    fputs(exits, file);
}

static void command_print(const Command *command) {
    printf("impactd %s%s%s: %s\n\n", command->name, command->operands != NULL ? " " : "",
           command->operands != NULL ? command->operands : "", command->summary);
    fputs(command->help, stdout);
    if (command->options != NULL) {
        putchar('\n');
        options_help(command->options, command->groups, stdout);
    }
}

static int unknown_refuse(const char *name) {
    const char *names[COUNT(commands)];
    for (size_t i = 0; i < COUNT(commands); i++)
        names[i] = commands[i] == NULL ? NULL : commands[i]->name;
    const char *near = spelling_nearest(names, name);
    fprintf(stderr, "impactd: %s is not a command", name);
    if (near != NULL)
        fprintf(stderr, " (did you mean %s?)", near);
    fputs("; impactd --help lists them\n", stderr);
    return COMMAND_USAGE;
}

static int help_run(const Command *self, void *settings, const Options *options, Problem *problem) {
    (void)self, (void)settings, (void)problem;
    if (options->operand_count == 0) {
        overview_print(stdout);
        return COMMAND_OK;
    }
    const Command *command = command_find(options->operands[0]);
    if (command == NULL)
        return unknown_refuse(options->operands[0]);
    command_print(command);
    return COMMAND_OK;
}

static int version_run(const Command *self, void *settings, const Options *options,
                       Problem *problem) {
    (void)self, (void)settings, (void)options, (void)problem;
    printf("impactd %s (engine %s)\n", program_version, engine_version);
    return COMMAND_OK;
}

// Reads the arguments behind the command's name and runs it.
static int command_run_with(const Command *command, int argc, char *const *argv) {
    static const Field no_options[] = {FIELD_END};
    const Field *fields = command->options != NULL ? command->options : no_options;
    Options options = {0};
    Problem *problem = calloc(1, sizeof *problem);
    void *settings = calloc(1, command->size + 1);
    int code = command_exit(STATUS_NO_MEMORY);
    if (problem != NULL && settings != NULL && fields_default(fields, settings) == STATUS_OK) {
        Status status =
            options_read(fields, settings, argc, argv, command->environment, &options, problem);
        if (status == STATUS_OK && command->operands == NULL && options.operand_count > 0)
            status = problem_set(problem, STATUS_USAGE, "takes no operands, is given \"%.60s\"",
                                 options.operands[0]);
        code = status == STATUS_OK ? command->run(command, settings, &options, problem)
                                   : command_error(command->name, problem);
        fields_clear(fields, settings);
    }
    free(settings);
    free(problem);
    return code;
}

// `run` with --vary is a sweep, which has all options of `run`.
static const Command *command_vary(const Command *command, int argc, char *const *argv) {
    for (int i = 2; i < argc && command == &command_run && strcmp(argv[i], "--") != 0; i++)
        if (strncmp(argv[i], "--vary", 6) == 0)
            return &command_sweep;
    return command;
}

int command_main(int argc, char *const *argv) {
    if (argc < 2) {
        overview_print(stderr);
        return COMMAND_USAGE;
    }
    const char *name = strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 ? "help"
                       : strcmp(argv[1], "--version") == 0                          ? "version"
                                                                                    : argv[1];
    const Command *command = command_find(name);
    if (command == NULL)
        return unknown_refuse(name);
    const bool is_flag = name != argv[1]; // further arguments are ignored
    for (int i = 2; i < argc && !is_flag && strcmp(argv[i], "--") != 0; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            command_print(command);
            return COMMAND_OK;
        }
    const int code =
        command_run_with(command_vary(command, argc, argv), is_flag ? 0 : argc - 2, argv + 2);
    // A full disk or a closed pipe is a failure.
    if (fflush(stdout) != 0 && code == COMMAND_OK) {
        fputs("impactd: standard output cannot be written\n", stderr);
        return COMMAND_FAILED;
    }
    return code;
}
