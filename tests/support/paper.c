#include "tests/support/paper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "tests/support/scenes.h"

const PaperBuffer paper_buffers[5] = {
    {"sponge", 0.61, 0.025, 1.65e3, 4.05},      {"soft_rubber", 0.44, 0.019, 2.99e3, 8.80},
    {"hard_rubber", 0.53, 0.004, 65.7e3, 32.5}, {"hard_acrylic", 0.49, 0.003, 118.0e3, 48.7},
    {"aluminium", 0.46, 0.0003, 11900e3, 530},
};

void paper_scene(Simulation *simulation, double restitution, double contact_time, double duration) {
    scene_with_damper(simulation, restitution, contact_time);
    simulation->scene.duration = duration;
}

void paper_free(Simulation *simulation, double displacement) {
    scene_choose(&simulation->scene.excitation, &excitation_kinds, "free");
    scene_start(simulation, displacement, 0);
}

void paper_random(Simulation *simulation, double rms, uint64_t seed) {
    scene_choose(&simulation->scene.excitation, &excitation_kinds, "random");
    ExcitationRandom *random = (ExcitationRandom *)(void *)simulation->scene.excitation;
    random->band.at = malloc(2 * sizeof *random->band.at);
    if (random->band.at == NULL)
        abort();
    random->band.at[0] = 0;
    random->band.at[1] = 15;
    random->band.count = 2;
    random->rms = rms;
    random->seed = seed;
}

void paper_sine(Simulation *simulation, double amplitude, double frequency) {
    scene_choose(&simulation->scene.excitation, &excitation_kinds, "sine");
    ExcitationSine *sine = (ExcitationSine *)(void *)simulation->scene.excitation;
    sine->amplitude = amplitude;
    sine->frequency = frequency;
}

void paper_model(Simulation *simulation, const char *model) {
    scene_choose(&simulation->scene.contact, &contact_kinds, model);
}

void paper_channels(Simulation *simulation, const char *const *names, size_t count) {
    Texts *channels_wanted = &simulation->output.channels;
    texts_clear(channels_wanted);
    for (size_t i = 0; i < count; i++)
        if (texts_append(channels_wanted, names[i]) != STATUS_OK)
            abort();
}

void paper_no_psd(Simulation *simulation) {
    texts_clear(&simulation->output.psd.channels);
}

double paper_distance(const Outcome *a, const Outcome *b, double from, double to) {
    const double *p = a->spectrum.densities.at[0].values, *q = b->spectrum.densities.at[0].values;
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < a->spectrum.densities.rows; i++)
        if (a->spectrum.frequency[i] >= from && a->spectrum.frequency[i] <= to) {
            const double level = 10 * log10(p[i] / q[i]);
            sum += level * level;
            count++;
        }
    return sqrt(sum / (double)count);
}
