// Scenes are accepted side by side; whoever takes a name away is alone, and is not kept waiting by
// those who come after him.
#include "server/jobs/naming.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>

#include <cmocka.h>

static Naming naming;
static atomic_int inside, alone, wrong, closed;

enum { READERS = 4, CLOSINGS = 50 };

static void *enter_again_and_again(void *of) {
    (void)of;
    while (atomic_load(&closed) < 2 * CLOSINGS) {
        naming_enter(&naming);
        atomic_fetch_add(&inside, 1);
        if (atomic_load(&alone) != 0)
            atomic_fetch_add(&wrong, 1);
        atomic_fetch_sub(&inside, 1);
        naming_leave(&naming);
    }
    return NULL;
}

static void *close_again_and_again(void *of) {
    (void)of;
    for (int i = 0; i < CLOSINGS; i++) {
        naming_close(&naming);
        if (atomic_fetch_add(&alone, 1) != 0 || atomic_load(&inside) != 0)
            atomic_fetch_add(&wrong, 1);
        atomic_fetch_sub(&alone, 1);
        naming_open(&naming);
        atomic_fetch_add(&closed, 1);
    }
    return NULL;
}

static void whoever_closes_is_alone_and_comes_to_his_end(void **state) {
    (void)state;
    pthread_t readers[READERS], closers[2];
    naming_init(&naming);
    for (int i = 0; i < READERS; i++)
        assert_int_equal(pthread_create(&readers[i], NULL, enter_again_and_again, NULL), 0);
    for (int i = 0; i < 2; i++)
        assert_int_equal(pthread_create(&closers[i], NULL, close_again_and_again, NULL), 0);
    for (int i = 0; i < 2; i++)
        pthread_join(closers[i], NULL);
    for (int i = 0; i < READERS; i++)
        pthread_join(readers[i], NULL);
    assert_int_equal(atomic_load(&wrong), 0);
    naming_destroy(&naming);
}

static void two_scenes_are_accepted_side_by_side(void **state) {
    (void)state;
    naming_init(&naming);
    naming_enter(&naming);
    naming_enter(&naming); // would hang
    naming_leave(&naming);
    naming_leave(&naming);
    naming_close(&naming);
    naming_open(&naming);
    naming_enter(&naming);
    naming_leave(&naming);
    naming_destroy(&naming);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whoever_closes_is_alone_and_comes_to_his_end),
        cmocka_unit_test(two_scenes_are_accepted_side_by_side),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
