// impactd tradeoff SCENE.json: the study of the same name, as the daemon makes it, as a table.
#include "server/command/tradeoff.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/tradeoff.h"
#include "server/base/clock.h"
#include "server/command/bar.h"
#include "server/command/output.h"
#include "server/command/scene_file.h"
#include "server/encode/chart.h"
#include "server/jobs/documents.h"
#include "server/jobs/intake.h"
#include "server/options.h"

typedef struct TradeoffSettings {
    Texts output;
    double error;
    int metric;
    uint64_t repeats;
    Texts solver;
    double point_steps;
    double max_cpu_seconds;
} TradeoffSettings;

enum { OUTPUTS = 8, SOLVERS = 32 };

// Ranges and defaults are the study's own.
static const Field tradeoff_fields[] = {
    FIELD_TEXTS(TradeoffSettings, output, NULL, NULL, OUTPUTS, PRESENCE_OPTIONAL, 0,
                "write to this file, .json the table or .svg the chart; may be given again"),
    FIELD_REAL(TradeoffSettings, error, NULL, ANY, OPTIONAL,
               "error wanted, in the metric's unit (1e-3)"),
    FIELD_CHOICE(TradeoffSettings, metric, metric_names, OPTIONAL,
                 "displacement, mean_acceleration, peak_force, impacts, psd or rms_displacement"),
    FIELD_COUNT(TradeoffSettings, repeats, NULL, AT_LEAST(0), OPTIONAL,
                "timings of each point (5)"),
    FIELD_TEXTS(TradeoffSettings, solver, NULL, NULL, SOLVERS, PRESENCE_OPTIONAL, 0,
                "try this solver only; may be given again"),
    FIELD_REAL(TradeoffSettings, point_steps, NULL, ANY, OPTIONAL,
               "solver steps a point may be foretold to take (5e7)"),
    SCENE_FILE_CPU_ROW(TradeoffSettings),
    FIELD_END,
};

static bool is_chart(const char *path) {
    const size_t length = strlen(path);
    return length > 4 && strcmp(path + length - 4, ".svg") == 0;
}

static bool is_table(const char *path) {
    const size_t length = strlen(path);
    return length > 5 && strcmp(path + length - 5, ".json") == 0;
}

// "-" where it is not known.
static const char *number(char text[24], const char *format, double value) {
    if (isnan(value))
        snprintf(text, 24, "-");
    else
        snprintf(text, 24, format, value);
    return text;
}

static void point_print(const Tradeoff *tradeoff, size_t index, int width) {
    const TradeoffPoint *point = &tradeoff->points.at[index];
    const Errors *errors = &point->errors;
    const char mark = tradeoff->recommendation.point == index + 1 ? '>'
                      : point->is_best                            ? '*'
                                                                  : ' ';
    char cell[8][24];
    if (point->status != TRADEOFF_MEASURED) {
        printf("  %-*s %8s: %s\n", width, point->name, tradeoff_status_names[point->status],
               point->why != NULL ? point->why : "");
        return;
    }
    printf("%c %-*s %8s %8s %8s %8s %8s %8s %7s %7s\n", mark, width, point->name,
           number(cell[0], "%.2e", point->cpu_minimum), number(cell[1], "%.2e", point->cpu_median),
           number(cell[2], "%.2e", point->steps), number(cell[3], "%.1e", errors->displacement),
           number(cell[4], "%.1e", errors->mean_acceleration),
           number(cell[5], "%.1e", errors->peak_force), number(cell[6], "%.0f", errors->impacts),
           number(cell[7], "%.2g", errors->psd));
}

static void table_print(const Tradeoff *tradeoff) {
    const Yardstick *reference = &tradeoff->reference.yardstick;
    char estimate[24], horizon[24];
    int width = 5;
    for (size_t i = 0; i < tradeoff->points.count; i++)
        width = (int)strlen(tradeoff->points.at[i].name) > width
                    ? (int)strlen(tradeoff->points.at[i].name)
                    : width;
    printf("Errors against %s, whose own is %s; ", tradeoff->reference.solver,
           number(estimate, "%.1e", reference->error_estimate));
    if (isnan(reference->trust_horizon))
        puts("samples and impacts compared over the whole run.");
    else
        printf("samples and impacts compared to t = %s s, beyond which rounding decides.\n",
               number(horizon, "%.4g", reference->trust_horizon));
    if (!isnan(reference->psd_to))
        printf("Spectra compared from %.3g to %.4g Hz. ", reference->psd_from, reference->psd_to);
    printf("CPU times are the smallest and the median of %llu.\n\n",
           (unsigned long long)tradeoff->repeats);
    printf("  %-*s %8s %8s %8s %8s %8s %8s %7s %7s\n", width, "", "CPU [s]", "median", "steps",
           "displ.", "mean acc", "force", "impacts", "PSD dB");
    for (size_t i = 0; i < tradeoff->points.count; i++)
        point_print(tradeoff, i, width);
    printf("\n* no other is both cheaper and closer in %s; > the one to take:\n%s.\n",
           metric_names[tradeoff->metric], tradeoff->recommendation.why);
}

static Status file_write(const char *path, const Tradeoff *tradeoff, Problem *problem) {
    Bytes bytes = {0};
    if (is_chart(path)) {
        chart_tradeoff(tradeoff, &bytes);
    } else {
        document_answer(&bytes, &tradeoff->variant);
        bytes_text(&bytes, "\n");
    }
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

static Status study_make(const Inquiry *inquiry, const Texts *outputs,
                         const SimulationLimits *limits, Problem *problem) {
    Bar bar;
    Workspace workspace = {0};
    Variant *answer = NULL;
    bar_start(&bar);
    const Watch watch = bar_watch(&bar);
    const StudyTools tools = {
        .limits = limits, .watch = &watch, .workspace = &workspace, .cpu = thread_cpu};
    Status status = study_run(inquiry->study, &inquiry->simulation, &tools, &answer, problem);
    bar_stop(&bar);
    workspace_clear(&workspace);
    if (status == STATUS_OK)
        table_print((const Tradeoff *)(const void *)answer);
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++)
        status = file_write(outputs->at[i], (const Tradeoff *)(const void *)answer, problem);
    variant_free(answer);
    return status;
}

// The document's own study, or a new one, with what the flags say. Takes the solvers out of
// `settings`.
static Status study_choose(Inquiry *inquiry, TradeoffSettings *settings, Problem *problem) {
    if (inquiry->study != NULL && inquiry->study->kind != &study_tradeoff.kind) {
        variant_free(inquiry->study);
        inquiry->study = NULL;
    }
    if (inquiry->study == NULL)
        inquiry->study = variant_new(&study_tradeoff.kind);
    TradeoffStudy *study = (TradeoffStudy *)(void *)inquiry->study;
    if (study == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    if (settings->metric != CHOICE_ABSENT && settings->metric != study->metric) {
        study->metric = settings->metric;
        study->error = (double)NAN; // the usual one of another metric
    }
    if (!isnan(settings->error))
        study->error = settings->error;
    if (settings->repeats != COUNT_ABSENT)
        study->repeats = settings->repeats;
    if (!isnan(settings->point_steps))
        study->point_steps = settings->point_steps;
    if (settings->solver.count > 0) {
        const Texts own = study->solvers;
        study->solvers = settings->solver;
        settings->solver = own;
    }
    return STATUS_OK;
}

static Status scene_study(const char *path, const Bytes *text, TradeoffSettings *settings,
                          Problem *problem) {
    const SimulationLimits limits = scene_file_limits(settings->max_cpu_seconds);
    Store *store = NULL;
    Inquiry inquiry = {0};
    Warnings warnings = {0};
    TRY(store_open(NULL, &store, problem));
    Status status =
        intake_prepare(store, text->at, text->count, &limits, &inquiry, &warnings, problem);
    store_close(store);
    if (status == STATUS_OK)
        scene_file_warn(path, &warnings);
    if (status == STATUS_OK)
        status = study_choose(&inquiry, settings, problem);
    if (status == STATUS_OK)
        status = inquiry_complete(&inquiry, &limits, NULL, problem);
    // Before the runs, so that a wrong folder is told now and not after them.
    for (size_t i = 0; i < settings->output.count && status == STATUS_OK; i++) {
        status = output_open(settings->output.at[i], problem);
        output_drop();
    }
    if (status == STATUS_OK)
        status = study_make(&inquiry, &settings->output, &limits, problem);
    inquiry_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

static int tradeoff(void *of, const Options *options, Problem *problem) {
    TradeoffSettings *settings = of;
    Status status = STATUS_OK;
    for (size_t i = 0; i < settings->output.count; i++)
        if (!is_chart(settings->output.at[i]) && !is_table(settings->output.at[i]))
            status =
                problem_add(problem, STATUS_USAGE, "--output",
                            "must end in one of .json, .svg, is %.200s", settings->output.at[i]);
    if (status == STATUS_OK && options->operand_count != 1)
        status = problem_set(problem, STATUS_USAGE, "takes one scene, is given %zu",
                             options->operand_count);
    if (status != STATUS_OK)
        return command_refuse("tradeoff", problem);
    const char *path = options->operands[0];
    Bytes text;
    output_guard();
    status = scene_file_read(path, &text, problem);
    if (status == STATUS_OK)
        status = scene_study(path, &text, settings, problem);
    bytes_clear(&text);
    if (status != STATUS_OK)
        scene_file_refuse(path, problem);
    return command_exit(status);
}

static int tradeoff_run(int argc, char *const *argv) {
    TradeoffSettings settings;
    return command_with_options("tradeoff", tradeoff_fields, &settings, argc, argv, tradeoff);
}

const Command command_tradeoff = {
    .name = "tradeoff",
    .operands = "SCENE.json",
    .summary = "try solvers and steps on a scene: error against CPU time",
    .help =
        "  impactd tradeoff scene.json                          the table, and what to take\n"
        "  impactd tradeoff scene.json --error 1e-6             for a displacement right to 1e-6\n"
        "  impactd tradeoff scene.json --metric psd --error 0.5 for spectra right to half a dB\n"
        "  impactd tradeoff scene.json -o out.svg -o out.json   the chart, and the table whole\n"
        "  impactd tradeoff scene.json --solver exact --solver rk4\n"
        "  impactd tradeoff - < scene.json                      from standard input\n"
        "\n"
        "Every solver is run at steps or tolerances a decade or two apart, and the exact one also\n"
        "with less: impulses for contacts, fewer samples, shorter segments. Errors are the same "
        "at\n"
        "each time; CPU times are measured and differ a little. Ctrl-C stops at once.\n"
        "Exit code 3 if the scene has faults, 1 if its exact run failed.\n",
    .options = tradeoff_fields,
    .run = tradeoff_run,
};
