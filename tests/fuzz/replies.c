// What a client of the program is answered by a server that may be anything: a thread sends the
// answers, the command is run as its user runs it.
#include <netinet/in.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/field.h"
#include "server/cli/command.h"
#include "tests/fuzz/fuzz.h"

// Chosen by the first byte: 'A' is the first one.
static const char *const calls[] = {
    "jobs",
    "jobs --json",
    "watch j-7f3a --wait 0.02",
    "get j-7f3a --wait 0.02",
    "get r-91c0 summary",
    "get r-91c0 series.csv -o /dev/null --force",
    "cancel j-7f3a",
    "submit " IMPACTD_SOURCE_DIR "/schema/examples/no_damper.json --wait 0.02",
    "compare r-91c0 r-91c1",
    "materials list",
    "materials show felt",
    "materials show felt --editable",
    "materials history felt",
    "materials diff felt 1 2",
    "materials used-by felt",
    "materials measurements felt",
    "materials propose felt",
    "materials derived felt --damper-mass 0.1 --structure-mass 1",
    "materials approve felt@1 --reason ok",
    "materials revert felt 1 --comment c",
    "records list",
    "records show quake",
    "records delete quake",
    "complete ids",
    "complete materials",
};

typedef struct Script {
    int listener;
    const char *text;
    size_t size;
    bool is_over;
    pthread_mutex_t lock;
    char address[48];
} Script;

// The next answer, up to a line "%%"; false behind the last one.
static bool script_next(Script *script, const char **answer, size_t *size) {
    static const char mark[] = "%%\n";
    if (script->is_over)
        return false;
    *answer = script->text;
    for (*size = 0; *size + 3 <= script->size; ++*size)
        if (memcmp(script->text + *size, mark, 3) == 0) {
            script->text += *size + 3;
            script->size -= *size + 3;
            return true;
        }
    *size = script->size;
    script->is_over = true;
    return true;
}

// Reads a request to its end, which is that of its head, for bodies are short.
static void request_read(int descriptor) {
    char head[8192];
    size_t size = 0;
    ssize_t count = 1;
    while (size < sizeof head - 1 && count > 0) {
        count = recv(descriptor, head + size, sizeof head - 1 - size, 0);
        size += count > 0 ? (size_t)count : 0;
        head[size] = '\0';
        if (strstr(head, "\r\n\r\n") != NULL)
            return;
    }
}

static void *script_run(void *context) {
    Script *script = context;
    for (int descriptor; (descriptor = accept(script->listener, NULL, NULL)) >= 0;) {
        const char *answer;
        size_t size;
        request_read(descriptor);
        pthread_mutex_lock(&script->lock);
        if (script_next(script, &answer, &size))
            (void)send(descriptor, answer, size, MSG_NOSIGNAL);
        pthread_mutex_unlock(&script->lock);
        (void)shutdown(descriptor, SHUT_WR);
        char rest[4096];
        while (recv(descriptor, rest, sizeof rest, 0) > 0) {
        }
        close(descriptor);
    }
    return NULL;
}

static void script_start(Script *script) {
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof address;
    pthread_t thread;
    script->listener = socket(AF_INET, SOCK_STREAM, 0);
    fuzz_check(bind(script->listener, (struct sockaddr *)&address, size) == 0 &&
                   listen(script->listener, 64) == 0 &&
                   getsockname(script->listener, (struct sockaddr *)&address, &size) == 0,
               "a server listens");
    fuzz_check(pthread_create(&thread, NULL, script_run, script) == 0, "a server starts");
    pthread_detach(thread);
    snprintf(script->address, sizeof script->address, "http://127.0.0.1:%u",
             (unsigned)ntohs(address.sin_port));
}

// The letter of a command, then the answers to its requests, with a line "%%" between them. Behind
// the last one connections are closed without one.
void fuzz_replies(const char *text, size_t size) {
    enum { ARGUMENTS_MAX = 16 };
    static Script script = {.listener = -1, .lock = PTHREAD_MUTEX_INITIALIZER};
    if (script.listener < 0)
        script_start(&script);
    if (size == 0 || text[0] < 'A' || (size_t)(text[0] - 'A') >= COUNT(calls))
        return;
    char *line = fuzz_copy(calls[text[0] - 'A'], strlen(calls[text[0] - 'A']));
    char *arguments[ARGUMENTS_MAX] = {"impactd"}, *rest = NULL;
    int count = 1;
    for (char *word = strtok_r(line, " ", &rest); word != NULL; word = strtok_r(NULL, " ", &rest))
        arguments[count++] = word;
    if (strcmp(arguments[1], "complete") == 0) {
        setenv("IMPACTD_SERVER", script.address, 1);
    } else {
        arguments[count++] = "--server";
        arguments[count++] = script.address;
    }
    pthread_mutex_lock(&script.lock);
    script.text = text + 1;
    script.size = size - 1;
    script.is_over = false;
    pthread_mutex_unlock(&script.lock);
    (void)command_main(count, arguments);
    pthread_mutex_lock(&script.lock);
    script.is_over = true;
    script.size = 0;
    pthread_mutex_unlock(&script.lock);
    free(line);
}
