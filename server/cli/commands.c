// The list of subcommands, and those on the program itself: help, examples, cite, version.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "core/study/study.h"
#include "server/api/app.h"
#include "server/cli/client.h"
#include "server/cli/files.h"
#include "server/cli/report.h"
#include "server/json/parse.h"
#include "server/json/table.h"
#include "server/options.h"
#include "server/util/embedded.h"

enum { EXAMPLE_NAME = 64, EXAMPLES_MAX = 200 };

// "paper_free_sponge" of "schema/examples/paper_free_sponge.json".
static const char *example_name(const EmbeddedFile *file, char name[EXAMPLE_NAME]) {
    const char *slash = strrchr(file->path, '/');
    const char *from = slash != NULL ? slash + 1 : file->path;
    snprintf(name, EXAMPLE_NAME, "%.*s", (int)strcspn(from, "."), from);
    return name;
}

typedef struct ExamplesSettings {
    char *output;
} ExamplesSettings;

static const Field examples_fields[] = {
    FIELD_TEXT(ExamplesSettings, output, 4000, PRESENCE_OPTIONAL, 0,
               "write the example to this file (standard output)"),
    FIELD_END,
};

static int examples_run(const Command *self, void *of, const Options *options, Problem *problem) {
    const char *wanted = options->operand_count > 0 ? options->operands[0] : NULL;
    const char *names[EXAMPLES_MAX + 1] = {NULL};
    char known[EXAMPLES_MAX][EXAMPLE_NAME];
    PrintTable table = {.columns = 2, .has_heads = true};
    const PrintTableForm form = terminal_table_form();
    print_table_add(&table, "name");
    print_table_add(&table, "title");
    for (size_t i = 0; i < EXAMPLES_MAX && embedded_examples[i].path != NULL; i++) {
        const EmbeddedFile *file = &embedded_examples[i];
        StudyRequest scene;
        names[i] = example_name(file, known[i]);
        if (wanted != NULL && strcmp(names[i], wanted) == 0) {
            const Bytes text = {.at = (char *)(uintptr_t)file->bytes, .count = file->size};
            print_table_clear(&table);
            return command_end(self, output_put(*(char **)of, &text, problem), problem);
        }
        (void)json_parse(file->bytes, file->size, study_request_fields, &scene, NULL);
        print_table_add(&table, "%s", names[i]);
        print_table_add(&table, "%s", scene.simulation.title);
        study_request_clear(&scene);
    }
    if (wanted == NULL)
        print_table_print(&table, &form, stdout);
    print_table_clear(&table);
    const char *near = wanted != NULL ? spelling_nearest(names, wanted) : NULL;
    if (wanted != NULL)
        (void)problem_set(problem, STATUS_NOT_FOUND, "there is no example \"%.60s\"%s%s%s", wanted,
                          near != NULL ? " (did you mean " : "", near != NULL ? near : "",
                          near != NULL ? "?)" : "");
    return command_end(self, problem->status, problem);
}

static const Command command_examples = {
    .name = "examples",
    .operands = "[NAME]",
    .summary = "list example scenes, or print one",
    .help = "  impactd examples                                    # names and titles\n"
            "  impactd examples paper_free_sponge                  # print this scene\n"
            "  impactd examples paper_free_sponge -o scene.json    # write it to a file\n"
            "  impactd examples paper_free_sponge | impactd run -\n",
    .options = examples_fields,
    .size = sizeof(ExamplesSettings),
    .run = examples_run,
};

static int cite_run(const Command *self, void *settings, const Options *options, Problem *problem) {
    (void)self, (void)options, (void)problem;
    if (!*(const bool *)settings)
        printf("impactd %s (engine %s), simulation of structures with impact dampers.\n"
               "\n"
               "Its model: K. Li and A. P. Darby, Modelling a buffered impact damper system\n"
               "using a spring-damper model of impact, Structural Control and Health\n"
               "Monitoring 16 (2009) 287-302, doi:10.1002/stc.238.\n",
               program_version, engine_version);
    else
        printf("@software{impactd,\n"
               "  author  = {{The impactd authors}},\n"
               "  title   = {{impactd}: simulation of structures with impact dampers},\n"
               "  year    = {2026},\n"
               "  version = {%s},\n"
               "  note    = {engine %s}\n"
               "}\n"
               "@article{LiDarby2009,\n"
               "  author  = {Li, Kuinian and Darby, Antony P.},\n"
               "  title   = {Modelling a buffered impact damper system using a spring-damper\n"
               "             model of impact},\n"
               "  journal = {Structural Control and Health Monitoring},\n"
               "  volume  = {16},\n"
               "  pages   = {287--302},\n"
               "  year    = {2009},\n"
               "  doi     = {10.1002/stc.238}\n"
               "}\n",
               program_version, engine_version);
    return COMMAND_OK;
}

static const Field cite_fields[] = {
    {.name = "bibtex", .kind = FIELD_KIND_FLAG, .doc = "print entries for BibTeX"},
    FIELD_END,
};

static const Command command_cite = {
    .name = "cite",
    .summary = "show how to cite impactd and its model",
    .help = "  impactd cite\n"
            "  impactd cite --bibtex >> references.bib\n",
    .options = cite_fields,
    .size = sizeof(bool),
    .run = cite_run,
};

static int complete_run(const Command *self, void *settings, const Options *options,
                        Problem *problem) {
    static const struct {
        const char *kind, *path, *list, *names[3];
    } rows[] = {{"ids", "/v1/jobs?limit=100", "jobs", {"id", "result", NULL}},
                {"materials", "/v1/materials?limit=1000", "materials", {"slug", NULL}},
                {"records", "/v1/records?limit=500", "records", {"name", NULL}}};
    const char *kind = options->operand_count > 0 ? options->operands[0] : "";
    char name[EXAMPLE_NAME];
    for (size_t i = 0; i < COUNT(rows); i++)
        if (strcmp(kind, rows[i].kind) == 0)
            api_print_names(self, settings, rows[i].path, rows[i].list, rows[i].names, problem);
    for (const EmbeddedFile *file = embedded_examples; file->path != NULL; file++)
        if (strcmp(kind, "examples") == 0)
            puts(example_name(file, name));
    return COMMAND_OK;
}

// For the completion of shells; in no list.
static const Command command_complete = {
    .name = "complete",
    .operands = "ids|materials|records|examples",
    .summary = "print names for the completion of a shell",
    .help = "  impactd complete ids\n",
    .size = sizeof(ClientSettings),
    .run = complete_run,
};

static int version_run(const Command *self, void *settings, const Options *options,
                       Problem *problem) {
    (void)self, (void)settings, (void)options, (void)problem;
    printf("impactd %s (engine %s)\n", program_version, engine_version);
    return COMMAND_OK;
}

static const Command command_version = {
    .name = "version",
    .summary = "print the versions of program and engine",
    .help = "  impactd version\n",
    .run = version_run,
};

static int help_run(const Command *self, void *settings, const Options *options, Problem *problem);

static const Command command_help = {
    .name = "help",
    .operands = "[COMMAND]",
    .summary = "show the help of a command",
    .help = "  impactd help run\n",
    .run = help_run,
};

const Command *const commands[] = {
    &command_run,       &command_check,    &command_sweep,
    &command_ensemble,  &command_tradeoff, &command_optimize,
    &command_calibrate, &command_response, &command_fragility,
    &command_study,     &command_import,   &command_examples,
    &command_serve,     &command_token,    &command_backup,
    &command_restore,   &command_check_db, &command_submit,
    &command_jobs,      &command_watch,    &command_get,
    &command_compare,   &command_cancel,   &command_open,
    &command_materials, &command_records,  &command_help,
    &command_cite,      &command_version,  NULL,
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
    "  impactd serve                        # start a server on 127.0.0.1:8080\n"
    "  impactd run scene.json               # run a scene without a server\n"
    "  impactd submit scene.json --wait 60  # run a scene on a server\n"
    "  impactd get JOB series -o out.npy    # download a part of its result\n"
    "\n"
    "A scene: a structure is released from 15 mm; in it a free mass moves between two\n"
    "stops of sponge.\n"
    "\n"
    "  {\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092},\n"
    "   \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\"}],\n"
    "   \"excitation\": {\"kind\": \"free\", \"displacement\": 0.015},\n"
    "   \"duration\": 10, \"sample_rate\": 1000}\n";

static const char exits[] =
    "\n"
    "\"impactd help COMMAND\" shows the examples and options of a command.\n"
    "\n"
    "Exit codes: 0 ok, 1 failed, 2 usage, 3 faulty scene or file, 4 not found,\n"
    "5 permission denied, 7 server unreachable, 8 job not finished after --wait,\n"
    "130 interrupted.\n";

const Command *command_find(const char *name) {
    for (size_t i = 0; commands[i] != NULL; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return strcmp(name, command_complete.name) == 0 ? &command_complete
           : strcmp(name, command_chunk.name) == 0  ? &command_chunk
                                                    : NULL;
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
    printf("impactd %s: %s\n\nUsage: impactd %s%s%s%s\n\n%s", command->name, command->summary,
           command->name, command->options != NULL ? " [OPTION]..." : "",
           command->operands != NULL ? " " : "", command->operands != NULL ? command->operands : "",
           command->help);
    if (command->options != NULL) {
        fputs(command->groups == NULL ? "\nOptions:\n" : "\n", stdout);
        options_help(command->options, command->groups, stdout);
    }
}

static int unknown_refuse(const char *name) {
    const char *names[COUNT(commands)];
    for (size_t i = 0; i < COUNT(commands); i++)
        names[i] = commands[i] == NULL ? NULL : commands[i]->name;
    const char *near = spelling_nearest(names, name);
    command_print_line(stderr, "impactd: %.200s is not a command%s%s%s; impactd --help lists them",
                       name, near != NULL ? " (did you mean " : "", near != NULL ? near : "",
                       near != NULL ? "?)" : "");
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

// Reads the arguments behind the command's name and runs it.
static int command_run_with(const Command *command, int argc, char *const *argv) {
    static const Field no_options[] = {FIELD_END};
    const Field *fields = command->options != NULL ? command->options : no_options;
    Options options = {0};
    Problem *problem = calloc(1, sizeof *problem);
    void *settings = calloc(1, command->size + 1);
    int code = COMMAND_FAILED;
    if (problem != NULL && settings != NULL && fields_default(fields, settings) == STATUS_OK) {
        Status status =
            options_read(fields, settings, argc, argv, command->environment, &options, problem);
        if (status == STATUS_OK && command->operands == NULL && options.operand_count > 0)
            status = problem_set(problem, STATUS_USAGE, "takes no operands, is given \"%.60s\"",
                                 options.operands[0]);
        code = status == STATUS_OK ? command->run(command, settings, &options, problem)
                                   : command_end(command, status, problem);
        fields_clear(fields, settings);
    } else {
        command_print_line(stderr, "impactd %s: %s", command->name, status_title(STATUS_NO_MEMORY));
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
