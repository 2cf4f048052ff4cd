#include "tests/support/verdict.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

Status verdict_more(Verdict *verdict, Simulation *simulation) {
    static const SimulationLimits limits = {.samples = 1 << 25};
    return simulation_complete(simulation, &limits, &verdict->warnings, &verdict->problem);
}

Status verdict_complete(Verdict *verdict, Simulation *simulation) {
    verdict_clear(verdict);
    return verdict_more(verdict, simulation);
}

void verdict_clear(Verdict *verdict) {
    problem_clear(&verdict->problem);
    warnings_clear(&verdict->warnings);
}

const char *verdict_warning(const Verdict *verdict, const char *pointer) {
    const Warnings *warnings = &verdict->warnings;
    for (size_t i = 0; i < warnings->count; i++)
        if (strcmp(warnings->at[i].pointer, pointer) == 0)
            return warnings->at[i].detail;
    return "(no warning there)";
}

void verdict_begins(const char *text, const char *beginning) {
    if (strncmp(text, beginning, strlen(beginning)) != 0)
        fail_msg("\"%s\" should begin with \"%s\"", text, beginning);
}
