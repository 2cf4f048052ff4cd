// The three headers below that have no guard, compiled twice.
#include "tests/truth/reference.h"

#include <math.h>
#include <quadmath.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { TERMS = 46, PARTS = 8, NODES = 14, IMPACTS_MAX = 200000 };

static void *array(size_t count) {
    return calloc(count > 0 ? count : 1, sizeof(double));
}

void reference_clear(ReferenceAnswer *answer) {
    for (size_t i = 0; i < REFERENCE_CHANNELS; i++)
        free(answer->channels[i]);
    free(answer->impacts);
    memset(answer, 0, sizeof *answer);
}

__extension__ typedef __float128 Quad;

#define real Quad
#define NAME(x) quad_##x
#define real_abs fabsq
#define real_sin sinq
#define real_cos cosq
#define real_sinh sinhq
#define real_cosh coshq
#define real_log logq
#define REAL_EPSILON ((Quad)1e-34)
#define CLOSING ((Quad)1e-18)
#include "tests/truth/reference_polynomial.h"
#include "tests/truth/reference_start.h"
#include "tests/truth/reference_walk.h"
#undef real
#undef NAME
#undef real_abs
#undef real_sin
#undef real_cos
#undef real_sinh
#undef real_cosh
#undef real_log
#undef REAL_EPSILON
#undef CLOSING

#define real double
#define NAME(x) plain_##x
#define real_abs fabs
#define real_sin sin
#define real_cos cos
#define real_sinh sinh
#define real_cosh cosh
#define real_log log
#define REAL_EPSILON 1.1e-16
#define CLOSING 1e-14
#include "tests/truth/reference_polynomial.h"
#include "tests/truth/reference_start.h"
#include "tests/truth/reference_walk.h"

void reference_quad(const ReferenceScene *scene, double stride, double most,
                    ReferenceAnswer *answer) {
    quad_run(scene, stride, most, answer);
}

void reference_double(const ReferenceScene *scene, double stride, double most,
                      ReferenceAnswer *answer) {
    plain_run(scene, stride, most, answer);
}
