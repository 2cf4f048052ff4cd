// No impact is missed: every flight, contact and rest of random scenes is proved to go on for as
// long as the ledger says. `test_missed COUNT SEED` runs a longer campaign.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/test.h"
#include "tests/truth/drawn.h"
#include "tests/truth/scan.h"

static size_t scenes = 500;
static uint64_t seed = 1;

static void short_scene(ReferenceScene *scene, size_t i) {
    Draws draws = {seed * 7919 + i};
    drawn_scene(scene, seed * 1000003 + i, draws_uniform(&draws, 0.5, 2));
    drawn_zero_force(scene, seed * 1000003 + i);
}

TEST(no_impact_is_missed) {
    size_t failed = 0, refused = 0, impacts = 0, pieces = 0;
    double worst = 0;
    for (size_t i = 0; i < scenes; i++) {
        ReferenceScene scene;
        Scan scan;
        short_scene(&scene, i);
        Outcome *outcome = drawn_run(&scene, false);
        if (outcome == NULL) {
            refused++;
        } else {
            scan_run(&scene, &outcome->response.impacts, outcome->summary.peak_displacement, &scan);
            impacts += outcome->response.impacts.count;
            pieces += scan.pieces;
            worst = fmax(worst, scan.worst);
        }
        if (outcome != NULL && !scan.is_whole) {
            failed++;
            printf("scene %zu (seed %llu): %s\n", i, (unsigned long long)seed, scan.why);
            drawn_print(&scene);
        }
        outcome_unref(outcome);
        drawn_clear(&scene);
    }
    printf("%zu scenes with %zu impacts, %zu pieces proved: %zu failed, %zu refused; listed events "
           "missed by %.2g of what is allowed\n",
           scenes, impacts, pieces, failed, refused, worst);
    assert_true(failed == 0 && refused == 0);
}

// The judge itself: a row taken out, one made up, and one that begins a nanosecond late.
TEST(a_ledger_that_is_not_whole_is_seen) {
    size_t tried = 0;
    for (size_t i = 0; i < 60; i++) {
        ReferenceScene scene;
        Scan scan;
        short_scene(&scene, i);
        Outcome *outcome = drawn_run(&scene, false);
        assert_non_null(outcome);
        const Impacts *from = &outcome->response.impacts;
        double most = 0;
        for (size_t j = 0; j < from->count; j++)
            most = fmax(most, from->at[j].approach_speed);
        for (size_t j = 0; j < from->count && j < 20; j++) {
            if (!(from->at[j].approach_speed > 0.01 * most))
                continue;
            Impacts wrong = {malloc((from->count + 1) * sizeof(Impact)), from->count};
            assert_non_null(wrong.at);
            for (int way = 0; way < 2; way++) {
                memcpy(wrong.at, from->at, from->count * sizeof(Impact));
                wrong.count = from->count;
                if (way == 0)
                    memmove(&wrong.at[j], &wrong.at[j + 1], (--wrong.count - j) * sizeof(Impact));
                else
                    wrong.at[j].start += 1e-9;
                scan_run(&scene, &wrong, outcome->summary.peak_displacement, &scan);
                if (scan.is_whole) {
                    drawn_print(&scene);
                    fail_msg("scene %zu, row %zu at %.17g, way %d", i, j, from->at[j].start, way);
                }
                tried++;
            }
            free(wrong.at);
        }
        outcome_unref(outcome);
        drawn_clear(&scene);
    }
    assert_true(tried > 300);
}

int main(int argc, char **argv) {
    if (argc > 1)
        scenes = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        seed = strtoull(argv[2], NULL, 10);
    return test_run(0, NULL);
}
