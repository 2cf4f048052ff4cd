

#include <stdlib.h>
#include <string.h>

#include "core/study/tradeoff.h"
#include "tests/support/test.h"

static TradeoffPoint point(char *name, double cpu, double error) {
    return (TradeoffPoint){.name = name,
                           .status = TRADEOFF_MEASURED,
                           .cpu_minimum = cpu,
                           .errors = {.displacement = error, .psd = (double)NAN}};
}

TEST(a_point_is_best_if_none_is_both_cheaper_and_closer) {
    TradeoffPoint all[] = {
        point("slow and close", 8, 1e-9), point("beaten", 8, 1e-3),
        point("fast and far", 1, 1e-1),   point("between", 2, 1e-2),
        point("as fast, farther", 1, 1),  point("as far, slower", 3, 1e-2),
        point("unknown", 0.1, NAN),       point("twin of between", 2, 1e-2),
    };
    all[1].is_best = true; // of another metric
    const bool best[] = {true, false, true, true, false, false, false, true};
    TradeoffPoints points = {all, COUNT(all)};
    tradeoff_mark_best(&points, METRIC_DISPLACEMENT);
    for (size_t i = 0; i < COUNT(all); i++)
        if (all[i].is_best != best[i])
            fail_msg("%s: %d", all[i].name, all[i].is_best);
    tradeoff_mark_best(&points, METRIC_PSD);
    for (size_t i = 0; i < COUNT(all); i++)
        assert_false(all[i].is_best);
}

TEST(what_was_not_measured_is_neither_best_nor_taken) {
    TradeoffPoint all[] = {point("refused", 0, 0), point("failed", 0, 0), point("sound", 5, 1e-4)};
    all[0].status = TRADEOFF_REFUSED;
    all[1].status = TRADEOFF_FAILED;
    TradeoffPoints points = {all, COUNT(all)};
    TradeoffRecommendation choice = {COUNT_ABSENT, NULL};
    tradeoff_mark_best(&points, METRIC_DISPLACEMENT);
    assert_false(all[0].is_best || all[1].is_best);
    assert_true(all[2].is_best);
    assert_int_equal(tradeoff_recommend(&points, METRIC_DISPLACEMENT, 1, &choice), STATUS_OK);
    assert_int_equal(choice.point, 3);
    assert_non_null(strstr(choice.why, "no other point keeps it"));
    free(choice.why);
}

TEST(the_cheapest_that_keeps_the_error_is_taken) {
    TradeoffPoint all[] = {point("exact", 4, 1e-12), point("fine", 8, 1e-4),
                           point("coarse", 1, 0.1), point("middle", 2, 1e-3)};
    TradeoffPoints points = {all, COUNT(all)};
    static const struct {
        double error;
        uint64_t point;
        const char *says;
    } cases[] = {
        {1, 3, "the cheapest other is middle: 0.001 in 2 s"},
        {0.1, 3, "coarse keeps displacement within 0.1"}, // kept, not passed
        {0.09, 4, "the cheapest other is exact"},
        {1e-3, 4, "0.001 in 2 s"},
        {1e-4, 1, "exact keeps displacement"},
        {1e-13, COUNT_ABSENT, "no point keeps displacement within 1e-13; the closest, exact"},
    };
    TradeoffRecommendation choice = {COUNT_ABSENT, NULL};
    for (size_t i = 0; i < COUNT(cases); i++) {
        assert_int_equal(tradeoff_recommend(&points, METRIC_DISPLACEMENT, cases[i].error, &choice),
                         STATUS_OK);
        if (choice.point != cases[i].point || strstr(choice.why, cases[i].says) == NULL)
            fail_msg("%g: point %llu, %s", cases[i].error, (unsigned long long)choice.point,
                     choice.why);
    }
    assert_int_equal(tradeoff_recommend(&points, METRIC_PSD, 1, &choice), STATUS_OK);
    assert_true(choice.point == COUNT_ABSENT);
    assert_string_equal(choice.why, "no point has an error of psd");
    free(choice.why);
}

TEST(of_times_that_are_nearly_alike_the_closest_is_taken) {
    TradeoffPoint all[] = {point("coarse", 1, 1e-4), point("exact", 1.2, 1e-12),
                           point("closer still", 1.3, 1e-14), point("far", 0.9, 1)};
    TradeoffPoints points = {all, COUNT(all)};
    TradeoffRecommendation choice = {COUNT_ABSENT, NULL};
    assert_int_equal(tradeoff_recommend(&points, METRIC_DISPLACEMENT, 1e-3, &choice), STATUS_OK);
    assert_int_equal(choice.point, 2);
    assert_non_null(strstr(choice.why, "the cheapest other is coarse"));
    free(choice.why);
}
