#define _GNU_SOURCE // pipe2, posix_spawn_file_actions_addclosefrom_np
#include "server/util/subprocess.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdint.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/util/clock.h"

// The child has nothing of this process but the pipe, and no signal blocked.
static int subprocess_start(const char *const *arguments, int pipe, pid_t *child) {
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
            posix_spawn_file_actions_adddup2(&actions, pipe, STDOUT_FILENO),
            posix_spawn_file_actions_adddup2(&actions, pipe, STDERR_FILENO),
            posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1)};
        for (size_t i = 0; error == 0 && i < COUNT(all); i++)
            error = all[i];
        if (error == 0)
            error = posix_spawnp(child, arguments[0], &actions, &attributes,
                                 (char *const *)(uintptr_t)arguments, environ);
        (void)posix_spawnattr_destroy(&attributes);
    }
    (void)posix_spawn_file_actions_destroy(&actions);
    return error;
}

// Reads the pipe to its end. False at the deadline.
static bool subprocess_read(int pipe, int64_t end_ns, Bytes *output) {
    char block[4096];
    for (int64_t left_ms; (left_ms = (end_ns - clock_monotonic_ns()) / 1000000) > 0;) {
        struct pollfd wait = {pipe, POLLIN, 0};
        if (poll(&wait, 1, (int)(left_ms < 60000 ? left_ms : 60000)) <= 0)
            continue;
        const ssize_t count = read(pipe, block, sizeof block);
        if (count > 0)
            bytes_put(output, block, (size_t)count);
        else if (count == 0 || errno != EINTR)
            return true;
    }
    return false;
}

static Status subprocess_judge(const char *name, int state, const Bytes *output, Problem *problem) {
    const char *text = output->at != NULL ? output->at : "";
    const size_t length = strcspn(text, "\n");
    if (output->is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for what %s says", name);
    if (WIFEXITED(state) && WEXITSTATUS(state) == 0)
        return STATUS_OK;
    return length > 0
               ? problem_set(problem, STATUS_IO, "%.*s", (int)(length < 300 ? length : 300), text)
               : problem_set(problem, STATUS_IO, "%s failed and does not say why", name);
}

Status subprocess_run(const char *const *arguments, double seconds, Bytes *output,
                      Problem *problem) {
    const int64_t end_ns = clock_monotonic_ns() + (int64_t)(1e9 * seconds);
    int ends[2], state = 0;
    pid_t child;
    if (pipe2(ends, O_CLOEXEC) != 0)
        return problem_set(problem, STATUS_IO, "%s: no pipe: %s", arguments[0], strerror(errno));
    const int error = subprocess_start(arguments, ends[1], &child);
    (void)close(ends[1]);
    const bool is_late = error == 0 && !subprocess_read(ends[0], end_ns, output);
    (void)close(ends[0]);
    if (is_late)
        (void)kill(child, SIGKILL);
    while (error == 0 && waitpid(child, &state, 0) < 0 && errno == EINTR)
        ;
    if (error == ENOENT)
        return problem_set(problem, STATUS_NOT_FOUND, "there is no program %s", arguments[0]);
    if (error != 0)
        return problem_set(problem, STATUS_IO, "%s cannot be started: %s", arguments[0],
                           strerror(error));
    if (is_late)
        return problem_set(problem, STATUS_TIMEOUT, "%s did not answer within %g s", arguments[0],
                           seconds);
    return subprocess_judge(arguments[0], state, output, problem);
}
