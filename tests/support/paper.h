// The paper's scene (Li and Darby 2009, section 3) as a Simulation, built in C without JSON.
// Used by the truth tests and the benchmarks.
#ifndef TESTS_SUPPORT_PAPER_H
#define TESTS_SUPPORT_PAPER_H

#include "core/simulation/simulation.h"

typedef struct PaperBuffer {
    const char *name;
    double restitution, contact_time; // Table I
    double stiffness, damping;        // as printed, in N/m and N s/m
} PaperBuffer;
extern const PaperBuffer
    paper_buffers[5]; // sponge, soft_rubber, hard_rubber, hard_acrylic, aluminium

// Free vibration from 15 mm with a buffer of e and T_c; everything else at its default. Cleared by
// simulation_clear. Change what you mean, then simulation_complete.
void paper_scene(Simulation *simulation, double restitution, double contact_time, double duration);
void paper_free(Simulation *simulation, double displacement);
void paper_random(Simulation *simulation, double rms, uint64_t seed); // 0-15 Hz
void paper_sine(Simulation *simulation, double amplitude, double frequency);
void paper_model(Simulation *simulation, const char *model);
void paper_channels(Simulation *simulation, const char *const *names, size_t count);
void paper_no_psd(Simulation *simulation);

// Rms distance of two outcomes' first spectra over a band [dB].
double paper_distance(const Outcome *a, const Outcome *b, double from, double to);

#endif
