#include "tests/support/document.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/json/parse.h"

static Problem told;

Status document_complete(Simulation *simulation, const char *members, Problem *problem) {
    const size_t size = strlen(members) + 64;
    char *text = malloc(size);
    assert_non_null(text);
    snprintf(text, size, "{\"duration\": 1, \"sample_rate\": 100, %s}", members);
    problem_clear(problem);
    (void)json_parse(text, strlen(text), simulation_fields, simulation, problem);
    free(text);
    static const SimulationLimits limits = {.samples = 1 << 25, .impacts = 1000000, .steps = 1e10};
    return simulation_complete(simulation, &limits, NULL, problem);
}

static void tell(void) {
    for (size_t i = 0; i < told.count && i < PROBLEM_FAULTS; i++)
        print_error("%s: %s\n", told.faults[i].pointer, told.faults[i].detail);
}

void document_pass(Simulation *simulation, const char *members) {
    if (document_complete(simulation, members, &told) == STATUS_OK)
        return;
    tell();
    fail_msg("%.200s", members);
}

void document_refuse(const char *members, const char *pointer, const char *detail) {
    Simulation simulation;
    const Status status = document_complete(&simulation, members, &told);
    simulation_clear(&simulation);
    if (status == STATUS_INVALID && told.count == 1 &&
        strcmp(told.faults[0].pointer, pointer) == 0 && strcmp(told.faults[0].detail, detail) == 0)
        return;
    tell();
    fail_msg("%.200s: %zu faults, wanted %s: %s", members, told.count, pointer, detail);
}
