#include "server/client/token.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char allowed[] =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~+/=";

// Into `text`, whatever the file is; the file that is judged is the one that is read.
static Status file_read(const char *path, char *text, size_t size, Problem *problem) {
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return problem_add(problem, STATUS_USAGE, "--token-file", "%.200s cannot be read: %s", path,
                           strerror(errno));
    struct stat what;
    Status status = STATUS_OK;
    if (fstat(file, &what) != 0 || !S_ISREG(what.st_mode))
        status = problem_add(problem, STATUS_USAGE, "--token-file", "%.200s must be a regular file",
                             path);
    else if ((what.st_mode & 077) != 0)
        status = problem_add(problem, STATUS_USAGE, "--token-file",
                             "%.160s may be read or written by others (mode %03o); mend it by: "
                             "chmod 600 FILE",
                             path, (unsigned)(what.st_mode & 0777));
    ssize_t count = status == STATUS_OK ? read(file, text, size - 1) : 0;
    (void)close(file);
    text[count > 0 ? count : 0] = '\0';
    return status;
}

Status token_read(const char *path, char token[TOKEN_MAX + 1], Problem *problem) {
    char text[TOKEN_MAX + 64] = "";
    const char *source = path != NULL ? "--token-file" : "IMPACTD_TOKEN";
    const char *given = getenv("IMPACTD_TOKEN");
    if (path != NULL)
        TRY(file_read(path, text, sizeof text, problem));
    else if (given != NULL)
        text_fit(text, sizeof text, given);
    text[strcspn(text, "\r\n")] = '\0';
    token[0] = '\0';
    const size_t length = strlen(text);
    // The token itself is not told.
    if (length > TOKEN_MAX || text[strspn(text, allowed)] != '\0' || (path != NULL && length == 0))
        return problem_add(problem, STATUS_USAGE, source,
                           "must hold a token: 1 to %d letters, digits and -._~+/= on its first "
                           "line",
                           TOKEN_MAX);
    memcpy(token, text, length + 1);
    return STATUS_OK;
}
