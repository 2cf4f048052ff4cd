// impactd import FILE: the excitation as JSON on stdout or in a file, what a person should know of
// it on stderr.
#include "server/cli/command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "server/cli/output.h"
#include "server/cli/scene_file.h"
#include "server/json/encode.h"
#include "server/options.h"

#define G 9.80665 // [m/s^2]

typedef struct ImportSettings {
    double interval;
    int unit;
    double scale;
    char *output;
} ImportSettings;

// clang-format off
static const Field import_fields[] = {
    FIELD_REAL(ImportSettings, interval, "s", ABOVE(0), OPTIONAL, "time between samples, where the file does not tell it"),
    FIELD_CHOICE(ImportSettings, unit, acceleration_unit_names, OPTIONAL, "g, m/s^2 or cm/s^2, over what the file tells"),
    FIELD_REAL(ImportSettings, scale, NULL, ANY, 1, "factor on the samples"),
    FIELD_TEXT(ImportSettings, output, 4000, PRESENCE_OPTIONAL, 0, "write to this file"),
    FIELD_END,
};
// clang-format on

static void unit_tell(const char *path, const GroundMotionText *import, bool is_given) {
    const char *unit = acceleration_unit_names[import->unit];
    if (import->stated_unit == CHOICE_ABSENT && !is_given)
        fprintf(stderr, "%s: warning: the file tells no unit, %s is taken\n", path, unit);
    else if (import->stated_unit != CHOICE_ABSENT && import->stated_unit != import->unit)
        fprintf(stderr, "%s: warning: the file tells %s, %s is taken\n", path,
                acceleration_unit_names[import->stated_unit], unit);
}

static void summary_tell(const char *path, const GroundMotionText *import,
                         const ImportSettings *settings) {
    const RecordLook look = record_look(&import->samples, import->interval, settings->scale);
    const double peak = fmax(look.highest, -look.lowest);
    char interval[32];
    fprintf(stderr, "%s: %s, %zu samples, one every %s s, %.6g s; unit %s\n", path, import->layout,
            import->samples.count, text_real(interval, import->interval),
            (double)(import->samples.count - 1) * import->interval,
            acceleration_unit_names[import->unit]);
    fprintf(stderr,
            "%s: peak %.6g m/s^2 (%.6g g) at %.6g s; velocity: peak %.3g m/s, at the end %.3g "
            "m/s\n",
            path, peak, peak / G, (double)look.peak_at * import->interval, look.peak_velocity,
            look.end_velocity);
}

static void doubts_tell(const char *path, const Excitation *excitation, Problem *doubts) {
    const Span span = {0};
    excitation_record.doubt(excitation, &span, "", doubts);
    for (size_t i = 0; i < doubts->count; i++)
        fprintf(stderr, "%s: warning: %s %s\n", path, doubts->faults[i].pointer + 1,
                doubts->faults[i].detail);
}

static Status excitation_write(const ExcitationRecord *record, const char *output,
                               Problem *problem) {
    Bytes bytes = {0};
    bytes_text(&bytes, "{\"kind\": \"record\", ");
    (void)encode_members(&bytes, excitation_record.kind.fields, record, WRITE_SCENE);
    bytes_text(&bytes, "}\n");
    Status status =
        bytes.is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for it") : STATUS_OK;
    if (status == STATUS_OK && output == NULL && fwrite(bytes.at, 1, bytes.count, stdout) == 0)
        status = problem_set(problem, STATUS_IO, "standard output cannot be written");
    if (status == STATUS_OK && output != NULL) {
        status = output_open(output, problem);
        if (status == STATUS_OK)
            status = output_write(bytes.at, bytes.count, problem);
        if (status == STATUS_OK)
            status = output_close(problem);
        output_drop();
    }
    bytes_clear(&bytes);
    return status;
}

static Status import_show(const char *path, const Bytes *text, void *of, Problem *problem) {
    const ImportSettings *settings = of;
    const GroundMotionOptions request = {.interval = settings->interval, .unit = settings->unit};
    GroundMotionText import;
    TRY(ground_motion_text_read(text->at != NULL ? text->at : "", text->count, RECORD_SAMPLES,
                                &request, &import, problem));
    char source[1000];
    const char *name = scene_file_name(path), *slash = strrchr(path, '/');
    char named[2000];
    snprintf(named, sizeof named, "%.200s%s%s", slash != NULL ? slash + 1 : name,
             import.header[0] != '\0' ? ": " : "", import.header);
    text_fit(source, sizeof source, named);
    ExcitationRecord record = {.excitation.variant.kind = &excitation_record.kind,
                               .samples = import.samples,
                               .interval = import.interval,
                               .scale = settings->scale,
                               .source = source};
    // As a scene with it would be judged.
    const Span span = {.duration = 1, .sample_rate = 1};
    Status status = excitation_record.complete(&record.excitation, &span, "", problem);
    if (status == STATUS_OK)
        status = excitation_write(&record, settings->output, problem);
    if (status == STATUS_OK) {
        summary_tell(name, &import, settings);
        unit_tell(name, &import, settings->unit != CHOICE_ABSENT);
        problem_clear(problem);
        doubts_tell(name, &record.excitation, problem);
    }
    ground_motion_text_clear(&import);
    return status;
}

static int import(const Command *self, void *settings, const Options *options, Problem *problem) {
    return scene_file_command(self, "file", options, settings, import_show, problem);
}

const Command command_import = {
    .name = "import",
    .operands = "FILE",
    .summary = "make an excitation of a ground motion's file",
    .help =
        "  impactd import motion.AT2                        print an excitation to paste into a "
        "scene\n"
        "  impactd import motion.AT2 -o motion.json         write it to a file\n"
        "  impactd import column.txt --interval 0.02 --unit g   where the file tells neither\n"
        "  impactd import motion.AT2 --scale 2              twice as strong\n"
        "  impactd import - < motion.AT2                    from standard input\n"
        "\n"
        "Reads PEER's AT2 in its old and new forms, a count and interval before one column, times\n"
        "beside accelerations, and bare columns. What it found stands on stderr.\n"
        "Exit code 3 if the file has faults.\n",
    .options = import_fields,
    .size = sizeof(ImportSettings),
    .run = import,
};
