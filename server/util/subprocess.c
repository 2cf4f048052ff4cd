#define _GNU_SOURCE // pipe2, posix_spawn_file_actions_addclosefrom_np
#include "server/util/subprocess.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "server/util/clock.h"

enum { OUTPUT, COMPLAINT, PIPES, COMPLAINT_BYTES = 4096 };

// The child has nothing of this process but the two pipes, and no signal blocked.
static int subprocess_start(const char *const *arguments, const int pipes[PIPES], pid_t *child) {
    extern char **environ;
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none;
    int error = posix_spawn_file_actions_init(&actions);
    if (error != 0)
        return error;
    if ((error = posix_spawnattr_init(&attributes)) == 0) {
        (void)sigemptyset(&none);
        (void)posix_spawnattr_setsigmask(&attributes, &none);
        (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
        const int all[] = {
            posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0),
            posix_spawn_file_actions_adddup2(&actions, pipes[OUTPUT], STDOUT_FILENO),
            posix_spawn_file_actions_adddup2(&actions, pipes[COMPLAINT], STDERR_FILENO),
            posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1)};
        for (size_t i = 0; error == 0 && i < sizeof all / sizeof *all; i++)
            error = all[i];
        if (error == 0)
            error = posix_spawnp(child, arguments[0], &actions, &attributes,
                                 (char *const *)(uintptr_t)arguments, environ);
        (void)posix_spawnattr_destroy(&attributes);
    }
    (void)posix_spawn_file_actions_destroy(&actions);
    return error;
}

// Reads both pipes to their ends. False at the deadline.
static bool subprocess_read(int pipes[PIPES], int64_t end_ns, Bytes *texts[PIPES]) {
    char block[4096];
    for (;;) {
        struct pollfd wait[PIPES] = {{pipes[OUTPUT], POLLIN, 0}, {pipes[COMPLAINT], POLLIN, 0}};
        const int64_t left_ms = (end_ns - clock_monotonic_ns()) / 1000000;
        if (pipes[OUTPUT] < 0 && pipes[COMPLAINT] < 0)
            return true;
        if (left_ms <= 0)
            return false;
        if (poll(wait, PIPES, (int)(left_ms < 60000 ? left_ms : 60000)) <= 0)
            continue;
        for (int i = 0; i < PIPES; i++) {
            if (wait[i].revents == 0)
                continue;
            const ssize_t count = read(pipes[i], block, sizeof block);
            if (count > 0) {
                bytes_put(texts[i], block, (size_t)count);
            } else if (count == 0 || errno != EINTR) {
                close(pipes[i]);
                pipes[i] = -1;
            }
        }
    }
}

// The end of a child whose pipes are closed; one that goes on beyond the deadline is killed.
static int subprocess_wait(pid_t child, int64_t end_ns, bool *is_late) {
    const struct timespec pause = {0, 2000000};
    int state = 0;
    for (;;) {
        *is_late = *is_late || clock_monotonic_ns() >= end_ns;
        if (*is_late)
            (void)kill(child, SIGKILL);
        const pid_t ended = waitpid(child, &state, *is_late ? 0 : WNOHANG);
        if (ended == child || (ended < 0 && errno != EINTR))
            return state;
        (void)nanosleep(&pause, NULL);
    }
}

static Status subprocess_judge(const char *name, int state, const Bytes *complaint,
                               Problem *problem) {
    const char *text = complaint->at != NULL ? complaint->at : "";
    const size_t length = strcspn(text, "\n");
    if (WIFEXITED(state) && WEXITSTATUS(state) == 0)
        return STATUS_OK;
    if (length > 0)
        return problem_set(problem, STATUS_IO, "%.*s", (int)(length < 300 ? length : 300), text);
    return WIFEXITED(state) ? problem_set(problem, STATUS_IO, "%s ended with exit code %d", name,
                                          WEXITSTATUS(state))
                            : problem_set(problem, STATUS_IO, "%s was killed by signal %d", name,
                                          WTERMSIG(state));
}

Status subprocess_run(const char *const *arguments, double seconds, Bytes *output,
                      Problem *problem) {
    const int64_t end_ns = clock_monotonic_ns() + (int64_t)(1e9 * seconds);
    Bytes complaint = {.most = COMPLAINT_BYTES};
    int out[2], err[2];
    pid_t child;
    if (pipe2(out, O_CLOEXEC) != 0)
        return problem_set(problem, STATUS_IO, "%s: no pipe: %s", arguments[0], strerror(errno));
    if (pipe2(err, O_CLOEXEC) != 0) {
        (void)close(out[0]);
        (void)close(out[1]);
        return problem_set(problem, STATUS_IO, "%s: no pipe: %s", arguments[0], strerror(errno));
    }
    const int error = subprocess_start(arguments, (const int[PIPES]){out[1], err[1]}, &child);
    (void)close(out[1]);
    (void)close(err[1]);
    int pipes[PIPES] = {out[0], err[0]};
    bool is_late =
        error == 0 && !subprocess_read(pipes, end_ns, (Bytes *[PIPES]){output, &complaint});
    const int state = error == 0 ? subprocess_wait(child, end_ns, &is_late) : 0;
    for (int i = 0; i < PIPES; i++)
        if (pipes[i] >= 0)
            (void)close(pipes[i]);
    Status status;
    if (error == ENOENT)
        status = problem_set(problem, STATUS_NOT_FOUND, "there is no program %s", arguments[0]);
    else if (error != 0)
        status = problem_set(problem, STATUS_IO, "%s cannot be started: %s", arguments[0],
                             strerror(error));
    else if (is_late)
        status = problem_set(problem, STATUS_TIMEOUT, "%s did not answer within %g s", arguments[0],
                             seconds);
    else
        status = subprocess_judge(arguments[0], state, &complaint, problem);
    bytes_clear(&complaint);
    return status == STATUS_OK && output->is_failed
               ? problem_set(problem, STATUS_NO_MEMORY, "no memory for what %s says", arguments[0])
               : status;
}
