// Sample i stands at t = i * interval; between samples the acceleration is linear, from the last
// one on it is 0. A piece holds until the next one begins.
#include "tests/support/base_at.h"

#include <math.h>

static double sampled_at(const Base *base, double time) {
    const double place = time / base->interval;
    if (base->count == 0 || !(place < (double)(base->count - 1)))
        return 0;
    const size_t i = (size_t)place;
    const double part = place - (double)i;
    return base->values[i] + part * (base->values[i + 1] - base->values[i]);
}

static double pieces_at(const Base *base, double time) {
    const BasePiece *piece = NULL;
    for (size_t i = 0; i < base->piece_count && base->pieces[i].time <= time; i++)
        piece = &base->pieces[i];
    if (piece == NULL)
        return 0;
    const double since = time - piece->time;
    return base->omega > 0
               ? piece->value * cos(base->omega * since) + piece->slope * sin(base->omega * since)
               : piece->value + piece->slope * since;
}

double base_at(const Base *base, double time) {
    switch (base->form) {
    case BASE_SAMPLED:
        return sampled_at(base, time);
    case BASE_SINE:
        return base->amplitude * sin(base->omega * time);
    case BASE_PIECES:
        return pieces_at(base, time);
    case BASE_STILL:
        break;
    }
    return 0;
}
