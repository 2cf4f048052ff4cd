// The fuzzer's program: with clang's libFuzzer (preset fuzz) it runs the target that the variable
// IMPACTD_FUZZ names; otherwise it replays kept inputs, `fuzz TARGET FILE`. A file has one input a
// line: printable ASCII as it is, \n, \r, \t, \\ and \xNN. fuzz.py makes them.
#include "tests/fuzz/fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "server/json/encode.h"
#include "server/json/parse.h"

#include <jansson.h>

static const struct {
    const char *name;
    FuzzTarget *run;
} targets[] = {{"scene", fuzz_scene},   {"study", fuzz_scene}, {"materials", fuzz_materials},
               {"motion", fuzz_motion}, {"trace", fuzz_trace}, {"head", fuzz_head},
               {"http", fuzz_http},     {"rows", fuzz_rows},   {"replies", fuzz_replies}};

void fuzz_check(bool is_right, const char *sentence) {
    if (is_right)
        return;
    fprintf(stderr, "fuzz: not so: %s\n", sentence);
    abort();
}

void fuzz_check_problem(const Problem *problem) {
    Bytes document = {0};
    fuzz_check(problem->status != STATUS_OK, "a failure has its status in the problem");
    fuzz_check(problem->count > 0 || problem->detail[0] != '\0', "a failure has a reason");
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++)
        fuzz_check(problem->faults[i].detail[0] != '\0', "a fault says something");
    encode_problem(&document, problem, 400, NULL);
    json_t *tree = json_loadb(document.at, document.count, JSON_REJECT_DUPLICATES, NULL);
    fuzz_check(tree != NULL, "a problem document is JSON");
    json_decref(tree);
    bytes_clear(&document);
}

char *fuzz_copy(const char *text, size_t size) {
    char *copy = malloc(size + 1);
    fuzz_check(copy != NULL, "there is memory");
    memcpy(copy, text, size);
    copy[size] = '\0';
    return copy;
}

static FuzzTarget *target_find(const char *name) {
    for (size_t i = 0; i < COUNT(targets); i++)
        if (name != NULL && strcmp(targets[i].name, name) == 0)
            return targets[i].run;
    fprintf(stderr, "fuzz: no target \"%s\"\n", name != NULL ? name : "");
    exit(2);
}

#ifdef IMPACTD_FUZZ

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *data, size_t size) {
    static FuzzTarget *target;
    if (target == NULL)
        target = target_find(getenv("IMPACTD_FUZZ"));
    target(size > 0 ? (const char *)data : "", size);
    return 0;
}

#else

// Takes the escapes out, in place; the size of what is left.
static size_t line_decode(char *line) {
    static const char letters[] = "n\nr\rt\t";
    char *out = line;
    for (const char *in = line; *in != '\0'; in++) {
        if (*in != '\\') {
            *out++ = *in;
            continue;
        }
        const char *letter = strchr(letters, *++in);
        if (*in == 'x') {
            const char digits[] = {in[1], in[2], '\0'};
            *out++ = (char)strtol(digits, NULL, 16);
            in += 2;
        } else {
            *out++ = letter != NULL ? letter[1] : *in;
        }
    }
    return (size_t)(out - line);
}

int main(int argc, char **argv) {
    size_t count = 0, room = 0;
    char *line = NULL;
    FILE *file = argc == 3 ? fopen(argv[2], "r") : NULL;
    if (file == NULL) {
        fprintf(stderr, "usage: fuzz TARGET FILE\n");
        return 2;
    }
    FuzzTarget *target = target_find(argv[1]);
    for (ssize_t length; (length = getline(&line, &room, file)) > 0; count++) {
        line[length - 1] = '\0';
        const size_t size = line_decode(line);
        // A copy of the exact size, so that a sanitizer sees a byte read too far.
        char *copy = malloc(size > 0 ? size : 1);
        fuzz_check(copy != NULL, "there is memory");
        memcpy(copy, line, size);
        target(copy, size);
        free(copy);
    }
    free(line);
    fclose(file);
    printf("%s: %zu inputs\n", argv[1], count);
    return count > 0 ? 0 : 1;
}

#endif
