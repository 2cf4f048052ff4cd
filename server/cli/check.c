// impactd check SCENE.json: the dry run of the server, as text or (--json) as the server answers
// it.
#include "server/cli/command.h"

#include <stdio.h>
#include <stdlib.h>

#include "server/api/job_json.h"
#include "server/cli/scene_file.h"
#include "server/jobs/jobs.h"
#include "server/json/table.h"

typedef struct CheckSettings {
    bool json;
    double max_cpu_seconds;
} CheckSettings;

static const Field check_fields[] = {
    FIELD_FLAG(CheckSettings, json, false,
               "print the plan as JSON, as POST /v1/jobs?dry_run=1 answers"),
    SCENE_FILE_CPU_ROW(CheckSettings),
    FIELD_END,
};

// The plan as tables. The title, as all of it, is text of the file that must not control a
// terminal.
static Status plan_print(const char *path, DryRun *run, const Bytes *json, Problem *problem) {
    static const char *const skipped[] = {"scene", "dry_run", "cached", "links", NULL};
    static const Field *const fields[] = {plan_report_fields, NULL};
    static const PrintTableColumns lists[] = {
        {"decisions", {"about", "chose", "value", "unit", "why"}}, {NULL, {NULL}}};
    static const PrintTableView view = {skipped, lists, fields};
    size_t longest;
    char *title = run->inquiry.simulation.title;
    text_make_printable(title);
    printf("%s: OK\n", scene_file_name(path));
    if (title != NULL)
        printf("Title: %s\n", title);
    if (run->inquiry.study != NULL)
        printf("Study: %s\n", run->inquiry.study->kind->name);
    putchar('\n');
    return print_table_print_json(json->at, json->count, &view, stdout, &longest, problem);
}

static Status plan_show(const char *path, const Bytes *text, void *of, Problem *problem) {
    const CheckSettings *asked = of;
    const JobManagerSettings settings = {
        .workers = 1, .queue_most = 1, .limits = scene_file_limits(asked->max_cpu_seconds)};
    Db *db = NULL;
    JobManager *manager = NULL;
    DryRun run = {0};
    Bytes bytes = {0};
    TRY(db_open(NULL, &db, problem));
    Status status = jobs_open(db, &settings, &manager, problem);
    if (status == STATUS_OK)
        status = jobs_dry_run(manager, text->at, text->count, &run, problem);
    if (status == STATUS_OK)
        job_json_put_dry_run(&bytes, &run);
    if (bytes.is_failed)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    else if (status == STATUS_OK && asked->json)
        printf("%s\n", bytes.at);
    else if (status == STATUS_OK)
        status = plan_print(path, &run, &bytes, problem);
    bytes_clear(&bytes);
    dry_run_clear(&run);
    jobs_close(manager);
    db_close(db);
    return status;
}

static int check(const Command *self, void *settings, const Options *options, Problem *problem) {
    return scene_file_command(self, "scene", options, settings, plan_show, problem);
}

const Command command_check = {
    .name = "check",
    .operands = "SCENE.json",
    .summary = "report the faults of a scene, or show its plan",
    .help = "  impactd check scene.json          all faults, or the plan and its reasons\n"
            "  impactd check scene.json --json   the plan as JSON\n"
            "  impactd check - < scene.json      from standard input\n"
            "\n"
            "Runs nothing. Exit code 3 if the scene has faults.\n",
    .options = check_fields,
    .size = sizeof(CheckSettings),
    .run = check,
};
