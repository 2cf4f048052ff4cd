#include "core/solve/exact_flight.h"

#include <math.h>

#include "core/math/matrix_exponential.h"

enum {
    X,
    V,
    R,
    W,
    A,
    B,
    SUM,
    SIZE
}; // B is the slope or the sine's other half, SUM the integral of a_g

static void pick_row(const long double *transition, int row, double target[4]) {
    static const int columns[4] = {X, V, A, B};
    for (int i = 0; i < 4; i++)
        target[i] = (double)transition[row * SIZE + columns[i]];
}

static void pick_form(const long double *form, double target[10]) {
    static const int columns[4] = {X, V, A, B};
    for (int i = 0, n = 0; i < 4; i++)
        for (int j = i; j < 4; j++)
            target[n++] = (double)(form[columns[i] * SIZE + columns[j]] * (i == j ? 1 : 2));
}

void exact_flight_make(ExactFlight *flight, const Motion *motion, double base_omega,
                       double length) {
    long double system[SIZE * SIZE] = {0};
    system[X * SIZE + V] = 1;
    system[V * SIZE + X] = -(long double)motion->omega2;
    system[V * SIZE + V] = -(long double)motion->damping;
    system[V * SIZE + A] = -1;
    system[R * SIZE + W] = 1;
    system[W * SIZE + X] = motion->omega2;
    system[W * SIZE + V] = motion->damping;
    system[SUM * SIZE + A] = 1;
    if (base_omega > 0) { // a_g = A cos + B sin, seen from wherever the interval starts
        system[A * SIZE + B] = base_omega;
        system[B * SIZE + A] = -(long double)base_omega;
    } else {
        system[A * SIZE + B] = 1;
    }
    long double transition[SIZE * SIZE], forms[2][SIZE * SIZE];
    exponential(system, SIZE, length, transition);
    // What x and v gain: rounding 1 - small would err the same way in every step.
    transition[X * SIZE + X] -= 1;
    transition[V * SIZE + V] -= 1;
    pick_row(transition, X, flight->x);
    pick_row(transition, V, flight->v);
    pick_row(transition, R, flight->r);
    pick_row(transition, W, flight->w);
    flight->a[0] = (double)transition[SUM * SIZE + A];
    flight->a[1] = (double)transition[SUM * SIZE + B];
    const long double v_row[SIZE] = {[V] = 1}, a_row[SIZE] = {[A] = 1};
    const long double *const pairs[2][2] = {{v_row, v_row}, {a_row, v_row}};
    exponential_forms(system, SIZE, length, 2, pairs, forms[0]);
    pick_form(forms[0], flight->vv);
    pick_form(forms[1], flight->av);
    flight->length = length;
    flight->omega = sqrt(motion->omega2);
    flight->curvature = motion->damping + flight->omega;
}
