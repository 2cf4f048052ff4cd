// Every run and study looks often enough whether it is to stop: between two looks there are never
// 100 ms of CPU, also where an example lasts long.
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs.h"
#include "server/util/clock.h"
#include "tests/support/test.h"

// Instrumented code takes many times the CPU: its times say little, so it runs for a shorter time.
enum {
    LONGER = 40,
    MAX_MS = IMPACTD_SANITIZED ? 2000 : 100,
    RUN_MS = IMPACTD_SANITIZED ? 150 : 400
};

typedef struct Gaps {
    int64_t began_ns, last_ns, longest_ns;
    int looks;
} Gaps;

static bool look(void *context, double fraction) {
    (void)fraction;
    Gaps *gaps = context;
    const int64_t now = clock_thread_cpu_ns();
    if (now - gaps->last_ns > gaps->longest_ns)
        gaps->longest_ns = now - gaps->last_ns;
    gaps->last_ns = now;
    gaps->looks++;
    return now - gaps->began_ns < (int64_t)RUN_MS * 1000000; // long enough seen
}

static double cpu(void *context) {
    (void)context;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

// The longest time without a look [ms], of which the last counts too: stopping takes as long.
static double longest(Db *db, const char *path, double longer) {
    static const SimulationLimits limits = {
        .samples = 1 << 25, .impacts = 500000, .steps = 1e15, .bytes = 4e9};
    Problem *problem = calloc(1, sizeof *problem);
    char *text = calloc(1, 1 << 20);
    FILE *file = fopen(path, "r");
    assert_true(problem != NULL && text != NULL && file != NULL);
    const size_t size = fread(text, 1, (1 << 20) - 1, file);
    fclose(file);
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    double ms = 0;
    // The first look is for defaults alone; the duration is then stretched as a client would.
    Status status = jobs_prepare(db, text, size, &limits, &inquiry, &warnings, problem);
    assert_int_equal(status, STATUS_OK);
    inquiry.simulation.scene.duration *= longer;
    Outcome *outcome = NULL;
    Gaps gaps = {.began_ns = clock_thread_cpu_ns()};
    gaps.last_ns = gaps.began_ns;
    const Progress watch = {&gaps, look};
    status = simulation_run(&inquiry.simulation, &limits, &watch, NULL, &outcome, problem);
    if (status == STATUS_OK && inquiry.study != NULL) {
        const StudyTools tools = {.limits = &limits, .progress = &watch, .cpu = cpu};
        Variant *answer = NULL;
        gaps.began_ns = gaps.last_ns = clock_thread_cpu_ns();
        status = study_run(inquiry.study, &inquiry.simulation, &tools, &answer, problem);
        variant_free(answer);
    }
    const int64_t last = clock_thread_cpu_ns() - gaps.last_ns;
    ms = 1e-6 * (double)(last > gaps.longest_ns ? last : gaps.longest_ns);
    outcome_unref(outcome);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    free(problem);
    free(text);
    return ms;
}

TEST(no_run_goes_long_without_looking_whether_it_is_to_stop) {
    Db *db;
    assert_int_equal(db_open(NULL, &db, NULL), STATUS_OK);
    DIR *folder = opendir(IMPACTD_SOURCE_DIR "/schema/examples");
    assert_non_null(folder);
    size_t count = 0;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        char path[512];
        if (strstr(entry->d_name, ".json") == NULL)
            continue;
        snprintf(path, sizeof path, "%s/schema/examples/%s", IMPACTD_SOURCE_DIR, entry->d_name);
        const double ms = longest(db, path, LONGER);
        if (ms > 20)
            print_message("%s: %.0f ms\n", entry->d_name, ms);
        if (ms > MAX_MS)
            fail_msg("%s goes %.0f ms of CPU without looking", entry->d_name, ms);
        count++;
    }
    closedir(folder);
    db_close(db);
    assert_true(count > 20);
}
