// Gravity is a base that accelerates with what stands on it: a structure of a million tonnes on a
// spring that does not give, at rest from the start.
#include "tests/support/drops.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/philox.h"
#include "server/json/parse.h"
#include "tests/support/document.h"

DropMade drops_simulate(double restitution, double contact_time, Separation separation,
                        double speed, double gravity) {
    char members[800];
    snprintf(members, sizeof members,
             "\"structure\": {\"mass\": 1e9, \"stiffness\": %s, \"damping\": 0}, "
             "\"dampers\": [{\"mass\": 0.11, \"clearance\": 0.002, \"velocity\": %.17g, "
             "\"buffer\": {\"restitution\": %.17g, \"contact_time\": %.17g}}], "
             "\"contact\": {\"separation\": \"%s\"}, \"excitation\": {\"kind\": \"record\", "
             "\"samples\": [%.17g, %.17g], \"interval\": 1, \"displacement\": %.17g}, \"output\": "
             "{\"psd\": null}",
             gravity > 0 ? "1e18" : "1e-3", speed, restitution, contact_time,
             separation_names[separation], -gravity, -gravity, gravity * 1e-9);
    Simulation simulation;
    document_pass(&simulation, members);
    static const SimulationLimits limits = {.samples = 1 << 25, .impacts = 1000000, .steps = 1e10};
    static Problem problem;
    problem_clear(&problem);
    Outcome *outcome = NULL;
    if (simulation_run(&simulation, &limits, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    assert_true(outcome->response.impacts.count > 0);
    const Impact *impact = &outcome->response.impacts.at[0];
    const DropMade made = {impact->approach_speed, impact->separation_speed, impact->duration};
    outcome_unref(outcome);
    simulation_clear(&simulation);
    return made;
}

void drops_make(DropTest *test, size_t count) {
    assert_int_equal(fields_default(drop_test_fields, test), STATUS_OK);
    fields_clear(drop_test_fields, test);
    test->drops.at = calloc(count, sizeof *test->drops.at);
    assert_non_null(test->drops.at);
    test->drops.count = count;
    for (size_t i = 0; i < count; i++) {
        const double none = (double)NAN;
        test->drops.at[i] = (Drop){none, none, none, none, none, NULL, NULL};
    }
}

Status drops_read(const char *text, DropTest *test, Problem *problem) {
    problem_clear(problem);
    const Status status = json_parse(text, strlen(text), drop_test_fields, test, problem);
    const Status judged = drop_test_validate(test, "", problem);
    return status != STATUS_OK ? status : judged;
}

double drops_noise(uint64_t seed, uint64_t *next) {
    double pair[2];
    philox_normal_pair(seed, 1, *next / 2, pair);
    return pair[(*next)++ % 2];
}
