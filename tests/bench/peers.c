#include "tests/bench/peers.h"

#include <math.h>
#include <string.h>

void peer_system(const ReferenceScene *scene, PeerSystem *system) {
    const double M = scene->mass, m = scene->damper_mass, T = scene->contact_time[0];
    const double loss = log(scene->restitution[0]), pi = 3.141592653589793;
    memset(system, 0, sizeof *system);
    system->omega2 = scene->stiffness / M;
    system->damping = scene->damping / M;
    system->share = m / (M + m);
    system->effective = M * m / (M + m);
    system->half = scene->clearance / 2;
    system->contact_omega2 = (pi * pi + loss * loss) / (T * T);
    system->contact_damping = -2 * loss / T;
    const double length = scene->clearance, speed = length * sqrt(system->omega2);
    const double scale[4] = {length, speed, length, speed};
    memcpy(system->scale, scale, sizeof scale);
    system->scene = scene;
}

double peer_base(const PeerSystem *system, double t) {
    const ReferenceScene *scene = system->scene;
    if (scene->base != REFERENCE_RECORD || system->kink + 1 >= scene->sample_count)
        return 0;
    const double *a = scene->samples + system->kink;
    return a[0] + (a[1] - a[0]) * (t / scene->interval - (double)system->kink);
}

void peer_at(PeerSystem *system, double t) {
    if (system->scene->base == REFERENCE_RECORD)
        system->kink = (size_t)(t / system->scene->interval + 1e-6);
}

static double pressure(const PeerSystem *system, const double *y) {
    if (system->stop == 0)
        return 0;
    return system->contact_omega2 * (y[2] - system->stop * system->half) +
           system->contact_damping * y[3];
}

void peer_slopes(const PeerSystem *system, double t, const double *y, double *slopes) {
    const double push = system->omega2 * y[0] + system->damping * y[1];
    const double n = pressure(system, y);
    slopes[0] = y[1];
    slopes[1] = system->share * n - push - peer_base(system, t);
    slopes[2] = y[3];
    slopes[3] = push - n;
}

void peer_sample(const PeerSystem *system, double t, const double *y, PeerAnswer *answer,
                 size_t sample) {
    const double n = pressure(system, y);
    (void)t;
    answer->columns[0][sample] = y[0];
    answer->columns[1][sample] = y[1];
    answer->columns[2][sample] = system->share * n - system->omega2 * y[0] - system->damping * y[1];
    answer->columns[3][sample] = y[0] + y[2];
    answer->columns[4][sample] = n * system->effective;
}

double peer_gap(const PeerSystem *system, const double *y, int stop) {
    const double gap = system->half - stop * y[2];
    return system->stop == 0 ? gap : -gap;
}

void peer_switch(PeerSystem *system, double t, int stop, PeerAnswer *answer) {
    if (system->stop != 0) {
        system->stop = 0;
        return;
    }
    system->stop = stop;
    if (answer->impacts < PEER_STARTS)
        answer->starts[answer->impacts] = t;
    answer->impacts++;
}
