// The paper's scene through other libraries, as a user who knows them would: x'' and the free
// mass's r'' relative to the structure, events located by the library's own means. Not solvers of
// the product. Used by bench_peers.c.
#ifndef TESTS_BENCH_PEERS_H
#define TESTS_BENCH_PEERS_H

#include <stdbool.h>
#include <stddef.h>

#include "tests/truth/reference.h"

enum { PEER_STARTS = 10 };

// What a right-hand side sees; `stop` is +1 or -1 in contact with the right or left stop, else 0.
typedef struct PeerSystem {
    double omega2, damping; // K / M, C / M
    double share;           // m / (M + m)
    double half;            // clearance / 2
    double contact_omega2, contact_damping;
    double effective; // m_e
    double scale[4];  // of x, x', r, r'
    int stop;
    const ReferenceScene *scene; // its base: still or a record
    size_t kink;                 // the record's interval
} PeerSystem;

typedef struct PeerAnswer {
    double *columns[5]; // given: x, x', absolute x'', z, N; each of `count` samples
    size_t count;
    double starts[PEER_STARTS]; // of the first impacts
    size_t impacts;
} PeerAnswer;

void peer_system(const ReferenceScene *scene, PeerSystem *system);

// a_g; the record's interval stays the present one until peer_at moves it.
double peer_base(const PeerSystem *system, double t);
void peer_at(PeerSystem *system, double t);

void peer_slopes(const PeerSystem *system, double t, const double *y, double *slopes);
void peer_sample(const PeerSystem *system, double t, const double *y, PeerAnswer *answer,
                 size_t sample);

// Positive until the present phase ends: the gap to a stop in flight, the penetration in contact.
double peer_gap(const PeerSystem *system, const double *y, int stop);

// ExactFlight ends at `stop`, or contact ends.
void peer_switch(PeerSystem *system, double t, int stop, PeerAnswer *answer);

// `tolerance` is relative, and of each variable's scale. GSL's rk8pd, a step at most a sample; an
// event is searched for by steps of other lengths from the last state.
bool peer_gsl(const ReferenceScene *scene, double tolerance, PeerAnswer *answer);

// SUNDIALS' CVODE: BDF, its root finding, a dense analytic Jacobian. With `has_stops` it is told to
// stop at every sample of the base.
bool peer_cvode(const ReferenceScene *scene, double tolerance, bool has_stops, PeerAnswer *answer);

#endif
