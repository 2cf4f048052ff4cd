// impactd study SCENE.json: what its member "study" asks, as the daemon makes it, as JSON.
#include "server/command/command.h"

#include <stdio.h>

#include "server/command/scene_file.h"
#include "server/command/study.h"
#include "server/encode/answer.h"

typedef struct AnySettings {
    Texts output;
    double max_cpu_seconds;
} AnySettings;

static const Field any_fields[] = {
    FIELD_TEXTS(AnySettings, output, NULL, NULL, STUDY_OUTPUTS, PRESENCE_OPTIONAL, 0,
                "write to this file, .json the whole or .csv the table or .svg the chart, where "
                "the study has them; may be given again"),
    SCENE_FILE_CPU_ROW(AnySettings),
    FIELD_END,
};

static void document_print(const Variant *answer) {
    Bytes bytes = {0};
    answer_formats(answer->kind)->write(answer, &bytes);
    if (bytes.at != NULL)
        (void)fwrite(bytes.at, 1, bytes.count, stdout);
    bytes_clear(&bytes);
}

static const StudyCommand study = {.print = document_print};

static int any_study(const Command *self, void *of, const Options *options, Problem *problem) {
    AnySettings *settings = of;
    return study_command_run(self, &study, &settings->output, settings->max_cpu_seconds, settings,
                             options, problem);
}

const Command command_study = {
    .name = "study",
    .operands = "SCENE.json",
    .summary = "make the study that a scene asks for: compare, sensitivity and the others",
    .help =
        "  impactd study scene.json                       the answer as JSON\n"
        "  impactd study scene.json -o out.svg -o out.csv the chart, and the table\n"
        "  impactd study - < scene.json                   from standard input\n"
        "\n"
        "The scene's member \"study\" says what is wanted, like {\"kind\": \"compare\"} for all "
        "contact\n"
        "models side by side. Ctrl-C stops at once. Exit code 3 if the scene has faults or no "
        "study,\n"
        "1 if its run failed.\n",
    .options = any_fields,
    .size = sizeof(AnySettings),
    .run = any_study,
};
