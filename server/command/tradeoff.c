// impactd tradeoff SCENE.json: the study of the same name, as the daemon makes it, as a table.
#include "server/command/command.h"

#include <stdio.h>
#include <string.h>

#include "core/study/tradeoff.h"
#include "server/command/scene_file.h"
#include "server/command/study.h"

typedef struct TradeoffSettings {
    Texts output;
    double error;
    int metric;
    uint64_t repeats;
    Texts solver;
    double point_steps;
    double max_cpu_seconds;
} TradeoffSettings;

enum { SOLVERS = 32 };

// Ranges and defaults are the study's own.
static const Field tradeoff_fields[] = {
    FIELD_TEXTS(TradeoffSettings, output, NULL, NULL, STUDY_OUTPUTS, PRESENCE_OPTIONAL, 0,
                "write to this file, .json the table or .svg the chart; may be given again"),
    FIELD_REAL(TradeoffSettings, error, NULL, ANY, OPTIONAL,
               "error wanted, in the metric's unit (1e-3)"),
    FIELD_CHOICE(TradeoffSettings, metric, metric_names, OPTIONAL,
                 "displacement, mean_acceleration, peak_force, impacts, psd or rms_displacement"),
    FIELD_COUNT(TradeoffSettings, repeats, NULL, AT_MIN(0), OPTIONAL, "timings of each point (5)"),
    FIELD_TEXTS(TradeoffSettings, solver, NULL, NULL, SOLVERS, PRESENCE_OPTIONAL, 0,
                "try this solver only; may be given again"),
    FIELD_REAL(TradeoffSettings, point_steps, NULL, ANY, OPTIONAL,
               "solver steps a point may be foretold to take (5e7)"),
    SCENE_FILE_CPU_ROW(TradeoffSettings),
    FIELD_END,
};

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
           study_number(cell[0], "%.2e", point->cpu_minimum),
           study_number(cell[1], "%.2e", point->cpu_median),
           study_number(cell[2], "%.2e", point->steps),
           study_number(cell[3], "%.1e", errors->displacement),
           study_number(cell[4], "%.1e", errors->mean_acceleration),
           study_number(cell[5], "%.1e", errors->peak_force),
           study_number(cell[6], "%.0f", errors->impacts),
           study_number(cell[7], "%.2g", errors->psd));
}

static void table_print(const Variant *answer) {
    const Tradeoff *tradeoff = (const Tradeoff *)(const void *)answer;
    const ReferenceSummary *reference = &tradeoff->reference.yardstick;
    char estimate[24], horizon[24];
    int width = 5;
    for (size_t i = 0; i < tradeoff->points.count; i++)
        width = (int)strlen(tradeoff->points.at[i].name) > width
                    ? (int)strlen(tradeoff->points.at[i].name)
                    : width;
    printf("Errors against %s, whose own is %s; ", tradeoff->reference.solver,
           study_number(estimate, "%.1e", reference->error_estimate));
    if (isnan(reference->trust_horizon))
        puts("samples and impacts compared over the whole run.");
    else
        printf("samples and impacts compared to t = %s s, beyond which rounding decides.\n",
               study_number(horizon, "%.4g", reference->trust_horizon));
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

static void study_choose(void *asked, void *of) {
    TradeoffSettings *settings = of;
    TradeoffStudy *study = (TradeoffStudy *)(void *)asked;
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
}

static const StudyCommand study = {&study_tradeoff, study_choose, table_print};

static int tradeoff(const Command *self, void *of, const Options *options, Problem *problem) {
    TradeoffSettings *settings = of;
    return study_command_run(self, &study, &settings->output, settings->max_cpu_seconds, settings,
                             options, problem);
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
        "with less: impulses for contacts, fewer modes or samples, shorter segments. Errors are "
        "the\n"
        "same each time; CPU times are measured and differ a little. Ctrl-C stops at once.\n"
        "Exit code 3 if the scene has faults, 1 if its exact run failed.\n",
    .options = tradeoff_fields,
    .size = sizeof(TradeoffSettings),
    .run = tradeoff,
};
