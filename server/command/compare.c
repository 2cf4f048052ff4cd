#include "server/command/command.h"

#include <string.h>

#include "server/codec/pairs.h"
#include "server/command/daemon.h"

typedef struct CompareSettings {
    char *server, *token_file, *ca_file;
    double wait;
    bool json;
} CompareSettings;

// clang-format off
static const Field compare_fields[] = {
    DAEMON_ROWS(CompareSettings),
    FIELD_REAL(CompareSettings, wait, "s", AT_MIN(0), 60, "wait so long for a busy daemon"),
    FIELD_FLAG(CompareSettings, json, false, "print what the daemon answers, as JSON"),
    FIELD_END,
};
// clang-format on

static int wider(int width, const char *text) {
    const int length = text != NULL ? (int)strlen(text) : 0;
    return length > width ? length : width;
}

// Lists of things that are alike, as tables with their own heads.
static const struct {
    const char *list;
    const char *members[8], *heads[8];
} listings[] = {
    {"channels",
     {"channel", "unit", "rms", "other_rms", "difference_rms", "relative", "correlation"},
     {"channel", "unit", "rms A", "rms B", "rms A - B", "relative", "correlation"}},
    {"psd",
     {"channel", "unit", "from", "to", "level", "difference", "power"},
     {"spectrum", "unit", "from Hz", "to Hz", "level dB", "difference", "power"}},
};

// "psd/0" is, "psd/distance" is not.
static bool is_listed(const char *name) {
    for (size_t i = 0; i < COUNT(listings); i++) {
        const size_t length = strlen(listings[i].list);
        if (strncmp(name, listings[i].list, length) == 0 && name[length] == '/' &&
            strspn(name + length + 1, "0123456789") == strlen(name + length + 1))
            return true;
    }
    return false;
}

// What names is to the left, what counts to the right.
static void listing_print(const Listing *listing, const char *const *heads) {
    enum { NAMES = 2 };
    for (size_t row = 0; row <= listing->rows; row++)
        for (size_t column = 0; column < listing->columns; column++) {
            int width = wider(0, heads[column]);
            for (size_t i = 0; i < listing->rows; i++)
                width = wider(width, listing->cells[i * listing->columns + column]);
            printf("%*s%s", column < NAMES ? -width : width,
                   row == 0 ? heads[column] : listing->cells[(row - 1) * listing->columns + column],
                   column + 1 < listing->columns ? "  " : "\n");
        }
}

static Status listings_print(const HttpAnswer *answer, Problem *problem) {
    for (size_t i = 0; i < COUNT(listings); i++) {
        Listing listing;
        const Status status = listing_read(answer->body.at, answer->body.count, listings[i].list,
                                           listings[i].members, &listing, problem);
        for (size_t cell = 0; cell < listing.rows * listing.columns; cell++)
            told_tame(listing.cells[cell]);
        if (listing.rows > 0) {
            puts("");
            listing_print(&listing, listings[i].heads);
        }
        listing_clear(&listing);
        TRY(status);
    }
    return STATUS_OK;
}

static void table_print(const Pairs *pairs, const char *a, const char *b) {
    enum { WIDEST = 48 };
    int names = 4, firsts = 12, seconds = 12;
    for (size_t i = 0; i < pairs->count; i++) {
        told_tame(pairs->at[i].name);
        told_tame(pairs->at[i].a);
        told_tame(pairs->at[i].rest);
        if (pairs->at[i].b != NULL) {
            told_tame(pairs->at[i].b);
            names = wider(names, pairs->at[i].name);
            firsts = wider(firsts, pairs->at[i].a);
            seconds = wider(seconds, pairs->at[i].b);
        }
    }
    names = names < WIDEST ? names : WIDEST;
    firsts = firsts < WIDEST ? firsts : WIDEST;
    seconds = seconds < WIDEST ? seconds : WIDEST;
    printf("%-*s  %*.*s  %*.*s\n", names, "", firsts, firsts, a, seconds, seconds, b);
    for (size_t i = 0; i < pairs->count; i++)
        if (pairs->at[i].b != NULL)
            printf("%-*s  %*s  %*s%s%s\n", names, pairs->at[i].name, firsts, pairs->at[i].a,
                   seconds, pairs->at[i].b, pairs->at[i].rest[0] != '\0' ? "  " : "",
                   pairs->at[i].rest);
    puts("");
    for (size_t i = 0; i < pairs->count; i++)
        if (pairs->at[i].b == NULL && !is_listed(pairs->at[i].name))
            printf("%s: %s\n", pairs->at[i].name, pairs->at[i].a);
}

static Status ask_compare(const CompareSettings *settings, Daemon *daemon, const char *a,
                          const char *b, Problem *problem) {
    char path[256];
    HttpAnswer answer = {0};
    Pairs pairs = {0};
    snprintf(path, sizeof path, "/v1/compare?a=%s&b=%s", a, b);
    const HttpAsk ask = {.method = "GET", .path = path};
    Status status = daemon_ask(daemon, &ask, &answer, problem);
    if (status == STATUS_OK && settings->json) {
        daemon_print(&answer);
    } else if (status == STATUS_OK) {
        status = pairs_read(answer.body.at, answer.body.count, &pairs, NULL) == STATUS_OK
                     ? STATUS_OK
                     : problem_set(problem, STATUS_UNREACHABLE,
                                   "the answer is no comparison: what answers there is no impactd");
        if (status == STATUS_OK) {
            table_print(&pairs, a, b);
            status = listings_print(&answer, problem);
        }
    }
    pairs_clear(&pairs);
    http_answer_clear(&answer);
    return status;
}

static int compare(const Command *self, void *of, const Options *options, Problem *problem) {
    const CompareSettings *settings = of;
    if (options->operand_count != 2 || !daemon_is_id(options->operands[0]) ||
        !daemon_is_id(options->operands[1])) {
        (void)problem_set(problem, STATUS_USAGE,
                          "takes the ids of two results or jobs, like r-91c0");
        return command_refuse(self->name, problem);
    }
    const char *ids[2] = {options->operands[0], options->operands[1]};
    char results[2][96];
    const char *about = ids[0];
    Daemon daemon;
    Status status = daemon_open(settings->server, settings->token_file, settings->ca_file,
                                settings->wait, &daemon, problem);
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        about = ids[i];
        status = daemon_result(&daemon, ids[i], results[i], problem);
    }
    if (status == STATUS_OK)
        status = ask_compare(settings, &daemon, results[0], results[1], problem);
    daemon_close(&daemon);
    return status == STATUS_OK ? COMMAND_OK : daemon_refuse(self->name, about, status, problem);
}

const Command command_compare = {
    .name = "compare",
    .operands = "A B",
    .summary = "set two results of a daemon side by side",
    .help =
        "  impactd compare r-91c0 r-02ab           metrics of both, and the inputs that differ\n"
        "  impactd compare j-7f3a j-81dd --json    by their jobs; as the daemon answers\n"
        "\n"
        "Exit code 4 if one of them is not there.\n",
    .options = compare_fields,
    .size = sizeof(CompareSettings),
    .run = compare,
};
