// impactd sweep SCENE.json: the study of the same name, as the daemon makes it, point by point.
#include "server/command/command.h"

#include <stdio.h>

#include "core/study/sweep.h"
#include "server/command/scene_file.h"
#include "server/command/study.h"

typedef struct SweepSettings {
    Texts output;
    double max_cpu_seconds;
} SweepSettings;

static const Field sweep_fields[] = {
    FIELD_TEXTS(SweepSettings, output, NULL, NULL, STUDY_OUTPUTS, PRESENCE_OPTIONAL, 0,
                "write to this file, .json, .csv, .npy, .npz or .mat the table or .svg the chart; "
                "may be given "
                "again"),
    SCENE_FILE_CPU_ROW(SweepSettings),
    FIELD_END,
};

static void study_choose(void *asked, void *of) {
    (void)asked; // axes stand in the scene's own study
    (void)of;
}

// The extremes of a metric, and where they are.
static void metric_print(const Sweep *sweep, size_t metric) {
    const SweepTable *table = &sweep->table;
    const size_t metrics = sweep->metrics.count;
    size_t least = table->points.count, most = least;
    for (size_t i = 0; i < table->points.count; i++) {
        const double value = table->values.at[i * metrics + metric];
        if (isnan(value))
            continue;
        if (least == table->points.count || value < table->values.at[least * metrics + metric])
            least = i;
        if (most == table->points.count || value > table->values.at[most * metrics + metric])
            most = i;
    }
    const char *unit = sweep_metric_unit(sweep->metrics.at[metric]);
    char name[64], cell[2][24];
    const bool is_known = least < table->points.count;
    snprintf(name, sizeof name, "%.40s%s%s%s", sweep->metrics.at[metric], unit != NULL ? " [" : "",
             unit != NULL ? unit : "", unit != NULL ? "]" : "");
    if (!is_known) {
        printf("  %-28s not known\n", name);
        return;
    }
    printf("  %-28s %12s %9zu %12s %9zu\n", name,
           study_number(cell[0], "%.6g", table->values.at[least * metrics + metric]), least,
           study_number(cell[1], "%.6g", table->values.at[most * metrics + metric]), most);
}

static void sweep_print(const Variant *answer) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    const SweepTable *table = &sweep->table;
    printf("%llu points", (unsigned long long)sweep->points);
    for (size_t i = 0; i < sweep->axes.count; i++)
        printf("%s %s (%zu)", i > 0 ? "," : ":", sweep->axes.at[i].pointer,
               sweep->axes.at[i].values.count);
    printf("\n\n  %-28s %12s %9s %12s %9s\n", "", "smallest", "at point", "largest", "at point");
    for (size_t i = 0; i < sweep->metrics.count; i++)
        metric_print(sweep, i);
    for (size_t i = 0; i < table->failures.count; i++)
        printf("\n%llu failed, %s; point %llu: %s\n",
               (unsigned long long)table->failures.at[i].count,
               sweep_status_names[table->failures.at[i].status],
               (unsigned long long)table->failures.at[i].first, table->failures.at[i].detail);
}

static const StudyCommand study = {&study_sweep, study_choose, sweep_print};

static int sweep(const Command *self, void *of, const Options *options, Problem *problem) {
    SweepSettings *settings = of;
    return study_command_run(self, &study, &settings->output, settings->max_cpu_seconds, settings,
                             options, problem);
}

const Command command_sweep = {
    .name = "sweep",
    .operands = "SCENE.json",
    .summary = "the scene at many points: a grid or a list of values of its members",
    .help =
        "  impactd sweep scene.json                             smallest and largest of each "
        "metric\n"
        "  impactd sweep scene.json -o out.csv -o out.svg       every point, and the chart\n"
        "  impactd sweep - < scene.json                         from standard input\n"
        "\n"
        "The scene says what varies, by JSON Pointers into itself:\n"
        "\n"
        "  \"study\": {\"kind\": \"sweep\", \"axes\": [\n"
        "    {\"pointer\": \"/dampers/0/clearance\", \"from\": 0.005, \"to\": 0.03, \"count\": "
        "26},\n"
        "    {\"pointer\": \"/dampers/0/buffer\", \"values\": [\"sponge\", \"aluminium\"]}]}\n"
        "\n"
        "Every point is judged before the first runs. The same sweep gives the same bytes, here\n"
        "and by the daemon, which uses all its workers. Exit code 3 if the scene has faults.\n",
    .options = sweep_fields,
    .size = sizeof(SweepSettings),
    .run = sweep,
};
