// Which results there may be: all that are, and few others.
#include "server/store/result_filter.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "server/store/access.h"
#include "tests/support/scratch.h"

static const char *make_id(uint64_t number) {
    static char id[72];
    uint64_t part[4];
    for (size_t i = 0; i < 4; i++) { // splitmix64
        uint64_t z = (4 * number + i + 1) * 0x9E3779B97F4A7C15u;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        part[i] = z ^ (z >> 31);
    }
    snprintf(id, sizeof id, "r-%016llx%016llx%016llx%016llx", (unsigned long long)part[0],
             (unsigned long long)part[1], (unsigned long long)part[2], (unsigned long long)part[3]);
    return id;
}

static void one_that_has_not_been_filled_denies_nothing(void **state) {
    (void)state;
    ResultFilter *filter = result_filter_new();
    assert_non_null(filter);
    assert_true(result_filter_may_have(filter, make_id(1)));
    result_filter_free(filter);
    result_filter_free(NULL);
}

static void all_that_were_added_are_there_and_hardly_any_other(void **state) {
    (void)state;
    enum { COUNT_ADDED = 100000 };
    Store *store;
    ResultFilter *filter = result_filter_new();
    assert_int_equal(store_open(NULL, &store, NULL), STATUS_OK);
    Database *database = store_take(store);
    assert_int_equal(result_filter_fill(filter, database, NULL), STATUS_OK);
    store_put(store, database);
    store_close(store);
    assert_false(result_filter_may_have(filter, make_id(1)));
    assert_true(result_filter_may_have(filter, ""));
    assert_true(result_filter_may_have(filter, "r-12345"));
    assert_true(result_filter_may_have(filter, "r-12345678901234567890123X"));
    for (uint64_t i = 0; i < COUNT_ADDED; i++)
        result_filter_add(filter, make_id(i));
    result_filter_add(filter, "no id of ours");
    for (uint64_t i = 0; i < COUNT_ADDED; i++)
        assert_true(result_filter_may_have(filter, make_id(i)));
    size_t wrong = 0;
    for (uint64_t i = 0; i < COUNT_ADDED; i++)
        wrong += result_filter_may_have(filter, make_id(COUNT_ADDED + i));
    assert_true(wrong < 10); // (100,000 x 4 / 2^24)^4 = 3e-7 of them
    result_filter_free(filter);
}

static void results_of_an_earlier_life_are_found(void **state) {
    (void)state;
    char folder[SCRATCH_SIZE];
    Store *store;
    ResultRow row = {.engine = "e",
                     .scene = "{}",
                     .plan = "{}",
                     .summary = "{}",
                     .warnings = "[]",
                     .energy = "{}",
                     .impacts = "null"};
    scratch_make(folder);
    for (uint64_t life = 0; life < 3; life++) {
        assert_int_equal(store_open(folder, &store, NULL), STATUS_OK);
        assert_false(store_result_exists(store, make_id(life)));
        snprintf(row.id, sizeof row.id, "%s", make_id(life));
        assert_int_equal(store_result_save(store, &row, NULL, 0, NULL), STATUS_OK);
        for (uint64_t i = 0; i <= life; i++)
            assert_true(store_result_exists(store, make_id(i)));
        store_close(store);
    }
    assert_int_equal(store_open_beside(folder, &store, NULL), STATUS_OK);
    assert_true(store_result_exists(store, make_id(2)));
    assert_false(store_result_exists(store, make_id(3)));
    store_close(store);
    scratch_remove(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_that_has_not_been_filled_denies_nothing),
        cmocka_unit_test(all_that_were_added_are_there_and_hardly_any_other),
        cmocka_unit_test(results_of_an_earlier_life_are_found),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
