#include "server/util/log.h"

#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void log_put(Bytes *bytes, const char *name, const char *text, size_t most) {
    if (text == NULL)
        return;
    bytes_format(bytes, " %s=\"", name);
    for (size_t i = 0; text[i] != '\0' && i < most; i++) {
        const unsigned char c = (unsigned char)text[i];
        if (c < 0x20 || c >= 0x7f || c == '"' || c == '\\')
            bytes_format(bytes, "\\x%02x", c);
        else
            bytes_put(bytes, &text[i], 1);
    }
    bytes_text(bytes, strnlen(text, most + 1) > most ? "...\"" : "\"");
}

// A full pipe must not block the writer: where there is no room the line is dropped.
// The lock keeps the room that was found for the line that it was found for.
void log_write(const Bytes *line) {
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    static unsigned long lost;
    if (line->at == NULL)
        return;
    struct pollfd end = {.fd = STDERR_FILENO, .events = POLLOUT};
    pthread_mutex_lock(&lock);
    if (poll(&end, 1, 0) == 0) {
        lost++;
    } else if (lost > 0) {
        fprintf(stderr, "impactd: %lu log lines dropped (stderr blocked)\nimpactd: %s\n", lost,
                line->at);
        lost = 0;
    } else {
        fprintf(stderr, "impactd: %s\n", line->at);
    }
    pthread_mutex_unlock(&lock);
}
