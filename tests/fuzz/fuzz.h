// Targets of the fuzzer: each gives one parser of the program bytes that may be anything. A target
// ends the program where an answer is wrong; the sanitizers end it where it is undefined.
#ifndef TESTS_FUZZ_FUZZ_H
#define TESTS_FUZZ_FUZZ_H

#include "core/base/status.h"
#include "server/util/bytes.h"

// `text` is not terminated.
typedef void FuzzTarget(const char *text, size_t size);

// texts.c
FuzzTarget fuzz_scene, fuzz_materials, fuzz_motion, fuzz_trace, fuzz_head;
// service.c
FuzzTarget fuzz_http, fuzz_rows;
// replies.c
FuzzTarget fuzz_replies;

// Prints the sentence and aborts unless it is true.
void fuzz_check(bool is_right, const char *sentence);
// What a failure says: some reason, faults that each say something, and JSON as its document.
void fuzz_check_problem(const Problem *problem);
// A terminated copy, to be freed.
char *fuzz_copy(const char *text, size_t size);

#endif
