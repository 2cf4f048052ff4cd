#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include <math.h>
#include <string.h>

#include "tests/bench/peers.h"

static int slopes(double t, const double y[], double out[], void *of) {
    peer_slopes(of, t, y, out);
    return GSL_SUCCESS;
}

// The step from y0 that ends where the gap to `stop` closes, at most `h`; y becomes the state
// there. Regula falsi of the Illinois kind.
static double locate(gsl_odeiv2_step *step, gsl_odeiv2_system *gsl, const PeerSystem *system,
                     double t, double h, int stop, const double *y0, double *y) {
    double error[4], low = 0, high = h, above = peer_gap(system, y0, stop),
                     below = peer_gap(system, y, stop), s = h;
    // A contact begins at a gap of 0.
    while (above <= 0 && s > h * 1e-6) {
        s /= 2;
        memcpy(y, y0, 4 * sizeof *y);
        gsl_odeiv2_step_apply(step, t, s, y, error, NULL, NULL, gsl);
        const double here = peer_gap(system, y, stop);
        if (here > 0)
            low = s, above = here;
        else
            high = s, below = here;
    }
    int last = 0;
    for (int i = 0; i < 60 && high - low > 1e-15; i++) {
        s = low + (high - low) * above / (above - below);
        memcpy(y, y0, 4 * sizeof *y);
        gsl_odeiv2_step_apply(step, t, s, y, error, NULL, NULL, gsl);
        const double here = peer_gap(system, y, stop);
        if (fabs(here) < 1e-17)
            break;
        if (here > 0) {
            low = s, above = here;
            below /= last == 1 ? 2 : 1;
            last = 1;
        } else {
            high = s, below = here;
            above /= last == -1 ? 2 : 1;
            last = -1;
        }
    }
    return s;
}

bool peer_gsl(const ReferenceScene *scene, double tolerance, PeerAnswer *answer) {
    PeerSystem system;
    peer_system(scene, &system);
    gsl_odeiv2_system gsl = {slopes, NULL, 4, &system};
    gsl_odeiv2_step *step = gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, 4);
    gsl_odeiv2_step *search = gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, 4);
    gsl_odeiv2_control *control =
        gsl_odeiv2_control_scaled_new(tolerance, tolerance, 1, 0, system.scale, 4);
    gsl_odeiv2_evolve *evolve = gsl_odeiv2_evolve_alloc(4);
    bool is_good = step != NULL && search != NULL && control != NULL && evolve != NULL;
    double y[4] = {scene->displacement, scene->velocity, 0, 0}, t = 0;
    const double interval = 1 / scene->sample_rate;
    double h = interval;
    answer->impacts = 0;
    peer_at(&system, 0);
    for (size_t i = 0; i < answer->count && is_good; i++) {
        const double end = (double)i * interval;
        while (t < end && is_good) {
            double before[4];
            const double start = t;
            memcpy(before, y, sizeof y);
            if (gsl_odeiv2_evolve_apply(evolve, control, step, &gsl, &t, end, &h, y) != GSL_SUCCESS)
                is_good = false;
            int stop = system.stop;
            if (stop == 0)
                stop = y[2] > 0 ? 1 : -1;
            if (peer_gap(&system, y, stop) >= 0)
                continue;
            t = start + locate(search, &gsl, &system, start, t - start, stop, before, y);
            peer_switch(&system, t, stop, answer);
            gsl_odeiv2_evolve_reset(evolve);
            gsl_odeiv2_step_reset(step);
        }
        peer_sample(&system, t, y, answer, i);
        peer_at(&system, end);
        h = h > interval ? interval : h;
    }
    gsl_odeiv2_evolve_free(evolve);
    gsl_odeiv2_control_free(control);
    gsl_odeiv2_step_free(search);
    gsl_odeiv2_step_free(step);
    return is_good;
}
