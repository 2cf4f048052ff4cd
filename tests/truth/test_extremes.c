// Scenes from the edges (extremes.h) through every solver: each run keeps the error it states,
// judged by something closer (extremes_judge.h), or is refused, failed or marked, with the reason;
// none crashes, hangs, leaves a NaN or takes much more than was predicted. `test_extremes COUNT
// SEED SECONDS ROWS` runs a longer campaign under another limit on CPU time and writes a line for
// each scene; `test_extremes show SEED NUMBER` prints one for `impactd run -`. A scene is run in a
// child, so that a crash or a hang ends that scene alone.
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/math/fft.h"
#include "tests/support/test.h"
#include "tests/truth/extremes.h"
#include "tests/truth/extremes_judge.h"

static size_t scenes = 100;
static uint64_t seed = 1;
static double most_seconds = 0.1;
static FILE *rows;

static const double PATIENCE = 30; // times the limit, of CPU, after which a scene hangs

enum { REASONS = 400 };
typedef struct Reason {
    char text[EXTREMES_REASON];
    size_t count;
    uint64_t first;
} Reason;

typedef struct Tally {
    size_t of[EXTREME_VERDICTS];
    Reason reasons[EXTREME_VERDICTS][REASONS];
    size_t reason_count[EXTREME_VERDICTS];
    size_t judged[EXTREMES_JUDGES];
    double seconds;
} Tally;
static Tally tally;

static void count_reason(const ExtremesRecord *record) {
    const int verdict = record->verdict;
    Reason *reasons = tally.reasons[verdict];
    size_t i = 0;
    while (i < tally.reason_count[verdict] && strcmp(reasons[i].text, record->reason) != 0)
        i++;
    if (i == REASONS)
        i--; // the rest
    if (i == tally.reason_count[verdict]) {
        tally.reason_count[verdict]++;
        reasons[i].first = record->number;
        memcpy(reasons[i].text, record->reason, sizeof record->reason);
    }
    reasons[i].count++;
}

static bool is_defect(int verdict) {
    return verdict >= EXTREME_FIRST_DEFECT;
}

static void take(const ExtremesRecord *record) {
    tally.of[record->verdict]++;
    tally.judged[record->judge]++;
    tally.seconds += record->cpu;
    if (record->reason[0] != '\0')
        count_reason(record);
    if (is_defect(record->verdict))
        printf("%s %llu: %s (told %.3g, found %.3g; %.3g s of CPU, predicted %.3g)\n",
               extremes_verdicts[record->verdict], (unsigned long long)record->number,
               record->reason, record->told, record->found, record->cpu, record->predicted);
    if (rows != NULL)
        fprintf(rows, "%llu\t%s\t%s\t%.4g\t%.4g\t%.4g\t%.4g\t%.4g\t%.4g\t%.4g\t%.4g\t%s\t%s\n",
                (unsigned long long)record->number, extremes_verdicts[record->verdict],
                record->solver, record->predicted, record->cpu, record->steps, record->samples,
                record->impacts, record->told, record->found, record->gap, record->what,
                record->reason);
}

// Runs scenes from `first` on until one ends the process; the pipe tells how far it came.
static void work(size_t first, int out) {
    const struct itimerval rest = {{0, 0}, {0, 0}};
    struct itimerval patience = {{0, 0}, {0, 0}};
    patience.it_value.tv_sec = (time_t)(5 + PATIENCE * most_seconds);
    static char text[EXTREMES_TEXT];
    for (size_t i = first; i < scenes; i++) {
        ExtremesRecord record;
        extremes_scene(seed, i, text);
        (void)setitimer(ITIMER_PROF, &patience, NULL);
        extremes_judge(text, i, most_seconds, &record);
        (void)setitimer(ITIMER_PROF, &rest, NULL);
        if (write(out, &record, sizeof record) != (ssize_t)sizeof record)
            _exit(2);
    }
}

static bool receive(int in, ExtremesRecord *record) {
    size_t got = 0;
    while (got < sizeof *record) {
        const ssize_t more = read(in, (char *)record + got, sizeof *record - got);
        if (more < 0 && errno == EINTR)
            continue;
        if (more <= 0)
            return false;
        got += (size_t)more;
    }
    return true;
}

// Scenes from `first` on in a child; returns the number after the last one that came to an end.
static size_t supervise(size_t first) {
    int ends[2], status = 0;
    fflush(stdout);
    if (rows != NULL)
        fflush(rows);
    assert_int_equal(pipe(ends), 0);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        close(ends[0]);
        work(first, ends[1]);
        _exit(0);
    }
    close(ends[1]);
    ExtremesRecord record;
    while (receive(ends[0], &record)) {
        take(&record);
        first = (size_t)record.number + 1;
    }
    close(ends[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    if (first >= scenes)
        return first;
    memset(&record, 0, sizeof record);
    record.number = first;
    record.verdict =
        WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF ? EXTREME_HANG : EXTREME_CRASH;
    snprintf(record.reason, sizeof record.reason, "the process ended by %s %d",
             WIFSIGNALED(status) ? "signal" : "code",
             WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
    take(&record);
    return first + 1;
}

static int by_count(const void *a, const void *b) {
    const Reason *first = a, *second = b;
    return (first->count < second->count) - (first->count > second->count);
}

static void print_tally(void) {
    printf("%zu scenes of seed %llu, at most %g s of CPU each: %.1f s in all\n", scenes,
           (unsigned long long)seed, most_seconds, tally.seconds);
    for (int v = 0; v < EXTREME_VERDICTS; v++) {
        printf("%6zu %s\n", tally.of[v], extremes_verdicts[v]);
        qsort(tally.reasons[v], tally.reason_count[v], sizeof *tally.reasons[v], by_count);
        for (size_t i = 0; i < tally.reason_count[v]; i++)
            printf("         %6zu %s (%llu)\n", tally.reasons[v][i].count, tally.reasons[v][i].text,
                   (unsigned long long)tally.reasons[v][i].first);
    }
    for (int j = 0; j < EXTREMES_JUDGES; j++)
        printf("%6zu judged by %s\n", tally.judged[j], extremes_judges[j]);
}

// Only a campaign judges times: the suite may run in a build, or beside others, that take longer.
static bool is_timed;

TEST(extremes_are_right_or_say_that_they_are_not) {
    for (size_t next = 0; next < scenes;)
        next = supervise(next);
    print_tally();
    for (int v = EXTREME_FIRST_DEFECT; v < EXTREME_VERDICTS; v++)
        if (is_timed || (v != EXTREME_SLOW && v != EXTREME_DEAF))
            assert_int_equal(tally.of[v], 0);
    assert_true(10 * tally.of[EXTREME_KEPT] > scenes);
}

static int show(const char *of_seed, const char *number) {
    static char text[EXTREMES_TEXT];
    extremes_scene(strtoull(of_seed, NULL, 10), strtoull(number, NULL, 10), text);
    puts(text);
    return 0;
}

int main(int count, char **arguments) {
    is_timed = count > 1;
    if (count == 4 && strcmp(arguments[1], "show") == 0)
        return show(arguments[2], arguments[3]);
    if (count > 1)
        scenes = strtoul(arguments[1], NULL, 10);
    if (count > 2)
        seed = strtoull(arguments[2], NULL, 10);
    if (count > 3)
        most_seconds = strtod(arguments[3], NULL);
    if (count > 4)
        rows = fopen(arguments[4], "w");
    setvbuf(stdout, NULL, _IOLBF, 0);
    fft_start();
    return test_run(0, NULL);
}
