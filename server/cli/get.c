// impactd get RESULT-or-JOB [WHAT]: WHAT is the path below the result, its format the output's
// extension; bytes go to the file as they come.
#include "server/cli/command.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "server/cli/client.h"
#include "server/cli/output.h"

typedef struct GetSettings {
    char *server, *token_file, *ca_file, *output, *channels;
    double from, to;
    uint64_t points, max_bytes;
    double wait;
} GetSettings;

// clang-format off
static const Field get_fields[] = {
    DAEMON_ROWS(GetSettings),
    FIELD_TEXT(GetSettings, output, 4000, PRESENCE_OPTIONAL, 0, "write to this file; its extension is the format (standard output)"),
    FIELD_TEXT(GetSettings, channels, 4000, PRESENCE_OPTIONAL, 0, "of the series: these, with commas between (all)"),
    FIELD_REAL(GetSettings, from, "s", AT_MIN(0), OPTIONAL, "of the series: from here on"),
    FIELD_REAL(GetSettings, to, "s", AT_MIN(0), OPTIONAL, "of the series: to here, this sample too"),
    FIELD_COUNT(GetSettings, points, NULL, AT_MIN(1), OPTIONAL, "of the series: so many buckets, each with its least and largest value"),
    FIELD_REAL(GetSettings, wait, "s", AT_MIN(0), 0, "wait so long for an unfinished job and a busy daemon (0)"),
    FIELD_COUNT(GetSettings, max_bytes, "B", AT_MIN(1), 17179869184.0, "more is refused"),
    FIELD_END,
};
// clang-format on

static const char *const formats[] = {"json", "csv", "npy", "npz", "mat", "zip", "svg", NULL};
static const char *const binary[] = {"npy", "npz", "mat", "zip", NULL};
// These have one form, and no extension in their path.
static const char *const plain[] = {"result", "job", "manifest", NULL};

enum { WHAT_MAX = 100 };

static bool is_among(const char *const *texts, const char *text) {
    for (size_t i = 0; texts[i] != NULL; i++)
        if (strcmp(texts[i], text) == 0)
            return true;
    return false;
}

// What stands behind the last point of the last part; NULL if there is none.
static const char *extension_of(const char *path) {
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    const char *point = strrchr(name, '.');
    return point != NULL && point > name ? point + 1 : NULL;
}

static bool is_what(const char *what) {
    const size_t length = strlen(what);
    return length > 0 && length < WHAT_MAX && what[0] != '/' && strstr(what, "..") == NULL &&
           strstr(what, "//") == NULL &&
           strspn(what, "abcdefghijklmnopqrstuvwxyz0123456789_-./") == length;
}

// "series.csv" of what was typed and of the output's name. Nothing typed is the result itself, or
// what a file of that kind can only mean.
static Status choose(const GetSettings *settings, const Options *options, char what[WHAT_MAX + 8],
                     Problem *problem) {
    const char *extension = settings->output != NULL ? extension_of(settings->output) : NULL;
    if (settings->output != NULL && (extension == NULL || !is_among(formats, extension)))
        return problem_add(
            problem, STATUS_USAGE, "--output",
            "must end in one of .json, .csv, .npy, .npz, .mat, .zip, .svg, is %.200s",
            settings->output);
    const bool is_table = extension != NULL && strcmp(extension, "json") != 0;
    const char *typed = options->operand_count > 1      ? options->operands[1]
                        : !is_table                     ? "result"
                        : strcmp(extension, "zip") == 0 ? "bundle"
                                                        : "series";
    if (!is_what(typed))
        return problem_set(problem, STATUS_USAGE,
                           "%.100s is nothing a result has; it has series, psd, impacts, energy, "
                           "manifest, bundle and others",
                           typed);
    if (is_among(plain, typed) && is_table)
        return problem_add(problem, STATUS_USAGE, "--output", "must end in .json for the %s",
                           typed);
    const bool is_bare = is_among(plain, typed) || extension_of(typed) != NULL;
    snprintf(what, WHAT_MAX + 8, "%s%s%s", typed, is_bare ? "" : ".",
             is_bare                        ? ""
             : strcmp(typed, "bundle") == 0 ? "zip"
             : extension != NULL            ? extension
                                            : "json");
    return STATUS_OK;
}

static Status file_take(void *context, const void *bytes, size_t size, Problem *problem) {
    (void)context;
    return output_write(bytes, size, problem);
}

static Status screen_take(void *context, const void *bytes, size_t size, Problem *problem) {
    (void)context;
    return fwrite(bytes, 1, size, stdout) == size
               ? STATUS_OK
               : problem_set(problem, STATUS_IO, "standard output cannot be written");
}

static Status fetch(ApiClient *daemon, const GetSettings *settings, const char *id,
                    const char *what, Problem *problem) {
    char result[96];
    const bool is_job = strcmp(what, "job") == 0;
    if (is_job)
        snprintf(result, sizeof result, "%s", id);
    else
        TRY(api_client_result(daemon, id, result, problem));
    Bytes path = {.most = 16000};
    bytes_format(&path, "/v1/%s/%s", is_job ? "jobs" : "results", result);
    if (!is_job && strcmp(what, "result") != 0)
        bytes_format(&path, "/%s", what);
    http_query(&path, "channels", settings->channels);
    http_query_real(&path, "from", settings->from);
    http_query_real(&path, "to", settings->to);
    if (settings->points != COUNT_ABSENT)
        http_query_real(&path, "points", (double)settings->points);
    HttpAnswer answer = {0};
    Status status = settings->output != NULL ? output_open(settings->output, problem) : STATUS_OK;
    const HttpAsk ask = {.method = "GET",
                         .take = settings->output != NULL ? file_take : screen_take,
                         .most = settings->max_bytes};
    if (status == STATUS_OK)
        status = api_client_request(daemon, ask, &path, &answer, problem);
    if (status == STATUS_OK && settings->output != NULL)
        status = output_close(problem);
    output_drop();
    http_answer_clear(&answer);
    bytes_clear(&path);
    return status;
}

static int get(const Command *self, void *of, const Options *options, Problem *problem) {
    const GetSettings *settings = of;
    char what[WHAT_MAX + 8] = "";
    Status status = STATUS_OK;
    if (options->operand_count < 1 || options->operand_count > 2 ||
        !api_client_is_id(options->operands[0]))
        status = problem_set(problem, STATUS_USAGE,
                             "takes the id of a result or a job, like r-91c0, and what to get");
    if (status == STATUS_OK)
        status = choose(settings, options, what, problem);
    const char *extension = status == STATUS_OK ? extension_of(what) : NULL;
    if (extension != NULL && is_among(binary, extension) && settings->output == NULL &&
        isatty(STDOUT_FILENO))
        status = problem_set(problem, STATUS_USAGE,
                             "would print binary data on the terminal; use -o FILE.%s", extension);
    if (status != STATUS_OK)
        return command_error(self->name, problem);
    const char *id = options->operands[0];
    ApiClient daemon;
    status = api_client_open(settings->server, settings->token_file, settings->ca_file,
                             settings->wait, &daemon, problem);
    if (status == STATUS_OK)
        status = fetch(&daemon, settings, id, what, problem);
    api_client_close(&daemon);
    return status == STATUS_OK ? COMMAND_OK : api_client_refuse(self->name, id, status, problem);
}

const Command command_get = {
    .name = "get",
    .operands = "RESULT-or-JOB [WHAT]",
    .summary = "get a result, its series, spectra or impacts from a daemon",
    .help =
        "  impactd get r-91c0                              summary, plan and units\n"
        "  impactd get r-91c0 series -o motion.npy         the time series, for numpy.load\n"
        "  impactd get r-91c0 psd -o psd.svg               the spectra as a chart\n"
        "  impactd get r-91c0 series -o motion.csv --channels displacement --from 1 --to 2\n"
        "  impactd get r-91c0 series --points 500          buckets of least and largest values\n"
        "  impactd get r-91c0 psd -o psd.csv               spectra\n"
        "  impactd get r-91c0 impacts.csv                  every impact, on standard output\n"
        "  impactd get r-91c0 impacts/3/force -o one.csv   one of them at full detail\n"
        "  impactd get j-7f3a --wait 60 -o motion.mat      of a job, when it is finished\n"
        "  impactd get r-91c0 bundle -o all.zip            everything in one archive\n"
        "\n"
        "WHAT: result (the default), series, psd, impacts, energy, manifest, bundle, job, and "
        "what\n"
        "studies have: tradeoff, ensemble, table. Formats: json, csv, npy, npz, mat, zip, svg, as\n"
        "the daemon has them. A file appears whole or not at all. Exit code 4 if there is no such\n"
        "thing, 8 if the job goes on after --wait.\n",
    .options = get_fields,
    .size = sizeof(GetSettings),
    .run = get,
};
