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

static void real_print(const char *name, double value, const char *unit) {
    char text[32];
    if (!isnan(value))
        printf("  %s = %s%s%s", name, text_real(text, value), unit != NULL ? " " : "",
               unit != NULL ? unit : "");
}

// "  right of damper 1, sponge@1:  e = 0.61  T_c = 0.025 s ..."
static void derived_print(const Derived *derived) {
    printf("  %s stop of damper %llu", side_names[derived->side],
           (unsigned long long)derived->damper);
    if (derived->material != NULL)
        printf(", %s", derived->material);
    putchar(':');
    real_print("e", derived->restitution, NULL);
    real_print("T_c", derived->contact_time, "s");
    real_print("m_e", derived->effective_mass, "kg");
    real_print("k_b", derived->stiffness, "N/m");
    real_print("c_b", derived->damping, "N s/m");
    real_print("Z", derived->damping_ratio, NULL);
    real_print("n", derived->exponent, NULL);
    real_print("reached e", derived->reached_restitution, NULL);
    real_print("reached T_c", derived->reached_contact_time, "s");
    putchar('\n');
}

static void decision_print(const Decision *decision) {
    char text[32];
    printf("  %s: %s, because %s", decision->about, decision->chose, decision->why);
    if (!isnan(decision->value))
        printf(" (%s%s%s)", text_real(text, decision->value), decision->unit != NULL ? " " : "",
               decision->unit != NULL ? decision->unit : "");
    putchar('\n');
}

enum { MODES_SHOWN = 12 };

static void modes_print(const PlanModes *modes) {
    puts("\nModes");
    for (size_t i = 0; i < modes->count && i < MODES_SHOWN; i++) {
        printf("  %zu: %.6g Hz", i + 1, modes->at[i].frequency);
        if (!isnan(modes->at[i].damping_ratio))
            printf(", damping ratio %.4g", modes->at[i].damping_ratio);
        putchar('\n');
    }
    if (modes->count > MODES_SHOWN)
        printf("  and %zu more, to %.6g Hz\n", modes->count - MODES_SHOWN,
               modes->at[modes->count - 1].frequency);
}

static void plan_print(const char *path, DryRun *run) {
    // The title is arbitrary text of the file, which must not control the terminal.
    text_make_printable(run->inquiry.simulation.title);
    const Scene *scene = &run->inquiry.simulation.scene;
    char duration[32], rate[32];
    printf("%s: OK\n\n", scene_file_name(path));
    if (run->inquiry.simulation.title != NULL)
        printf("Title: %s\n", run->inquiry.simulation.title);
    printf("Result: %s\n", run->result);
    printf("Samples: %zu per channel, %s s at %s Hz, %zu channels\n", scene_sample_count(scene),
           text_real(duration, scene->duration), text_real(rate, scene->sample_rate),
           run->inquiry.simulation.output.channels.count);
    if (run->inquiry.study != NULL)
        printf("Study: %s\n", run->inquiry.study->kind->name);
    printf("Cost: about %.2g s of CPU, %.3g MB\n", run->cost.cpu_seconds, run->cost.bytes * 1e-6);
    printf("Contact model: %s\nSolver: %s\n", run->plan.contact_model, run->plan.solver);
    if (run->plan.decisions.count > 0)
        puts("\nDecisions");
    for (size_t i = 0; i < run->plan.decisions.count; i++)
        decision_print(&run->plan.decisions.at[i]);
    if (run->plan.modes.count > 0)
        modes_print(&run->plan.modes);
    if (run->plan.derived.count > 0)
        puts("\nStops");
    for (size_t i = 0; i < run->plan.derived.count; i++)
        derived_print(&run->plan.derived.at[i]);
    if (run->warnings.count > 0)
        puts("\nWarnings");
    for (size_t i = 0; i < run->warnings.count; i++)
        printf("  %s: %s\n", run->warnings.at[i].pointer, run->warnings.at[i].detail);
}

static Status plan_show(const char *path, const Bytes *text, void *of, Problem *problem) {
    const CheckSettings *asked = of;
    const JobManagerSettings settings = {
        .workers = 1, .queue_most = 1, .limits = scene_file_limits(asked->max_cpu_seconds)};
    Db *db = NULL;
    JobManager *manager = NULL;
    DryRun run = {0};
    TRY(db_open(NULL, &db, problem));
    Status status = jobs_open(db, &settings, &manager, problem);
    if (status == STATUS_OK)
        status = jobs_dry_run(manager, text->at, text->count, &run, problem);
    if (status == STATUS_OK && asked->json) {
        Bytes bytes = {0};
        job_json_put_dry_run(&bytes, &run);
        bytes_text(&bytes, "\n");
        if (bytes.is_failed)
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
        else
            (void)fwrite(bytes.at, 1, bytes.count, stdout);
        bytes_clear(&bytes);
    } else if (status == STATUS_OK) {
        plan_print(path, &run);
    }
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
