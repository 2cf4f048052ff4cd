#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>

#include "core/base/status.h"
#include "core/math/cosine_table.h"

#define PI 3.14159265358979323846264338328

static void cosines_at_equal_steps_are_the_library_s(void **state) {
    (void)state;
    static double cosines[5000];
    static const size_t counts[] = {0, 1, 63, 64, 65, 4096, 5000};
    for (size_t c = 0; c < COUNT(counts); c++) {
        const double start = c % 2 == 0 ? 0 : -PI / 2, step = 2 * PI / ((double)counts[c] + 1);
        circle_cosines(start, step, counts[c], cosines);
        for (size_t i = 0; i < counts[c]; i++)
            assert_true(fabs(cosines[i] - cos(start + (double)i * step)) < 1e-15);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cosines_at_equal_steps_are_the_library_s),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
