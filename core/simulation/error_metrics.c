// An outcome may have fewer samples than the reference. Then its displacement is interpolated
// linearly, and its mean acceleration is constant over the sample interval.
#include "core/simulation/error_metrics.h"

#include <math.h>

#include "core/result/spectrum_distance.h"
#include "core/simulation/internal.h"

// clang-format off
const Field error_fields[] = {
    FIELD_REAL(Errors, displacement, NULL, ANY, OPTIONAL, "largest difference within the horizon over the largest displacement, of all storeys; the reference's own error where that is larger"),
    FIELD_REAL(Errors, mean_acceleration, NULL, ANY, OPTIONAL, "rms of the difference over rms within the horizon"),
    FIELD_REAL(Errors, peak_force, NULL, ANY, OPTIONAL, "relative difference of the largest contact force within the horizon; unknown where impacts have no force"),
    FIELD_REAL(Errors, impacts, NULL, ANY, OPTIONAL, "difference of the numbers of impacts within the horizon"),
    FIELD_REAL(Errors, psd, "dB", ANY, OPTIONAL, "rms distance of the spectra over the band that holds 99.9 % of the reference's power, of the channel with the largest distance; unknown if that band is not covered"),
    FIELD_REAL(Errors, rms_displacement, NULL, ANY, OPTIONAL, "relative difference of the rms displacement of the whole run"),
    FIELD_REAL(Errors, peak_storey_drift, NULL, ANY, OPTIONAL, "relative difference of the largest storey drift of the whole run; unknown where the structure is no frame"),
    FIELD_REAL(Errors, peak_base_shear, NULL, ANY, OPTIONAL, "the same for the largest base shear"),
    FIELD_END
};

const Field reference_summary_fields[] = {
    FIELD_REAL(ReferenceSummary, error_estimate, NULL, ANY, OPTIONAL, "error of its displacement up to the horizon"),
    FIELD_REAL(ReferenceSummary, trust_horizon, "s", ANY, OPTIONAL, "end of the comparison of samples and impacts; unknown: end of the run"),
    FIELD_COUNT(ReferenceSummary, impacts, NULL, AT_MIN(0), OPTIONAL, "its impacts within the horizon"),
    FIELD_REAL(ReferenceSummary, peak_force, "N", ANY, OPTIONAL, "its largest contact force within the horizon"),
    FIELD_REAL(ReferenceSummary, largest, "m", ANY, OPTIONAL, "its largest displacement"),
    FIELD_REAL(ReferenceSummary, psd_from, "Hz", ANY, OPTIONAL, "lower limit of the compared band"),
    FIELD_REAL(ReferenceSummary, psd_to, "Hz", ANY, OPTIONAL, "upper limit of the compared band"),
    FIELD_END
};
// clang-format on

double error_metrics_by(const Errors *errors, int metric) {
    const double all[METRIC_COUNT] = {errors->displacement,
                                      errors->mean_acceleration,
                                      errors->peak_force,
                                      errors->impacts,
                                      errors->psd,
                                      errors->rms_displacement,
                                      errors->peak_storey_drift,
                                      errors->peak_base_shear};
    return all[metric];
}

static double errors_ratio(double difference, double whole) {
    if (whole > 0)
        return difference / whole;
    return difference == 0 ? 0 : (double)NAN;
}

static double errors_end(const Outcome *reference) {
    const double horizon = reference->summary.trust_horizon;
    return isnan(horizon) ? (double)INFINITY : horizon;
}

// Error of the reference within the samples compared. The estimate is for the whole run; at the
// horizon the error is RESPONSE_DIVERGENCE.
static double errors_own(const Summary *reference) {
    return isnan(reference->trust_horizon) ? reference->error_estimate
                                           : fmin(reference->error_estimate, RESPONSE_DIVERGENCE);
}

// Samples of the reference that can be compared.
static size_t errors_samples(const Outcome *reference) {
    const Response *response = &reference->response;
    const double within = floor(errors_end(reference) * response->sample_rate) + 1;
    return within < (double)response->count ? (size_t)within : response->count;
}

// Sample i of the reference is at index at + part of the other outcome, 0 <= part < 1.
typedef struct SamplePlace {
    size_t at;
    double part;
} SamplePlace;

static SamplePlace errors_place(size_t i, const Response *reference, const Response *point) {
    const double index = (double)i * point->sample_rate / reference->sample_rate;
    const double at = floor(index * (1 + 1e-12));
    const double part = index - at;
    return (SamplePlace){(size_t)at, part > 1e-9 ? part : 0};
}

static double errors_displacement(const Response *from, const Response *to, size_t count) {
    const size_t storeys = from->series.count / 2;
    double largest = 0, worst = 0;
    for (size_t s = 0; s < storeys; s++) {
        const double *x = from->series.at[s].values, *y = to->series.at[s].values;
        for (size_t i = 0; i < from->count; i++)
            largest = fmax(largest, fabs(x[i]));
        for (size_t i = 0; i < count; i++) {
            const SamplePlace place = errors_place(i, from, to);
            if (place.at + (place.part > 0) >= to->count)
                break;
            double value = y[place.at];
            if (place.part > 0)
                value += place.part * (y[place.at + 1] - value);
            worst = fmax(worst, fabs(value - x[i]));
        }
    }
    return errors_ratio(worst, largest);
}

static double errors_acceleration(const Response *from, const Response *to, size_t count) {
    const size_t storeys = from->series.count / 2;
    double squares = 0, differences = 0;
    for (size_t s = 0; s < storeys; s++) {
        const double *x = from->series.at[storeys + s].values;
        const double *y = to->series.at[storeys + s].values;
        for (size_t i = 0; i < count; i++) {
            const SamplePlace place = errors_place(i, from, to);
            const size_t at = place.at + (place.part > 0); // the mean before its sample
            if (at >= to->count)
                break;
            squares += x[i] * x[i];
            differences += (y[at] - x[i]) * (y[at] - x[i]);
        }
    }
    return sqrt(errors_ratio(differences, squares));
}

typedef struct HorizonImpacts {
    uint64_t impacts;
    double peak; // NAN: no contact has a peak force
} HorizonImpacts;

// Contacts that begin within the horizon.
static HorizonImpacts errors_impacts(const Impacts *impacts, double horizon) {
    HorizonImpacts within = {0, (double)NAN};
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *impact = &impacts->at[i];
        if (impact->start > horizon)
            continue;
        within.impacts += impact->kind == IMPACT_IMPACT;
        within.peak = fmax(within.peak, impact->peak_force);
    }
    return within;
}

static double errors_channel_distance(const Spectrum *reference, const double *wanted,
                                      const Spectrum *point, const double *density) {
    const size_t end = spectrum_distance_band_end(wanted, reference->densities.rows);
    return spectrum_distance_level(reference, wanted, point, density, 1, end);
}

// The channel with the largest distance.
static double errors_psd(const Spectrum *reference, const Spectrum *point) {
    const size_t count = reference->densities.count;
    double worst = (double)NAN;
    for (size_t i = 0; i < count && i < point->densities.count; i++) {
        const double own = errors_channel_distance(reference, reference->densities.at[i].values,
                                                   point, point->densities.at[i].values);
        if (isnan(own))
            return own;
        worst = fmax(worst, own);
    }
    return worst;
}

ReferenceSummary error_metrics_reference(const Outcome *reference) {
    const HorizonImpacts within =
        errors_impacts(&reference->response.impacts, errors_end(reference));
    ReferenceSummary summary = {.error_estimate = errors_own(&reference->summary),
                                .trust_horizon = reference->summary.trust_horizon,
                                .impacts = within.impacts,
                                .peak_force = within.peak,
                                .largest = reference->summary.peak_displacement,
                                .psd_from = (double)NAN,
                                .psd_to = (double)NAN};
    const Spectrum *spectrum = &reference->spectrum;
    for (size_t i = 0; i < spectrum->densities.count; i++) {
        const size_t end =
            spectrum_distance_band_end(spectrum->densities.at[i].values, spectrum->densities.rows);
        if (end < 2)
            continue;
        summary.psd_from = spectrum->frequency[1];
        summary.psd_to = fmax(summary.psd_to, spectrum->frequency[end - 1]);
    }
    return summary;
}

Errors error_metrics_measure(const Outcome *reference, const Outcome *point, bool has_motion) {
    const Response *from = &reference->response, *to = &point->response;
    Errors errors = {.displacement = (double)NAN,
                     .mean_acceleration = (double)NAN,
                     .peak_force = (double)NAN,
                     .impacts = (double)NAN,
                     .psd = errors_psd(&reference->spectrum, &point->spectrum),
                     .rms_displacement = (double)NAN,
                     .peak_storey_drift = (double)NAN,
                     .peak_base_shear = (double)NAN};
    if (!has_motion)
        return errors;
    const size_t count = errors_samples(reference);
    if (count > 1) {
        // Nothing closer than the reference itself can be measured.
        errors.displacement =
            fmax(errors_displacement(from, to, count), errors_own(&reference->summary));
        errors.mean_acceleration = errors_acceleration(from, to, count);
    }
    const double horizon = errors_end(reference), rms = reference->summary.rms_displacement;
    const HorizonImpacts a = errors_impacts(&from->impacts, horizon);
    const HorizonImpacts b = errors_impacts(&to->impacts, horizon);
    errors.impacts = fabs((double)a.impacts - (double)b.impacts);
    if (outcome_has_force(point) && outcome_has_force(reference) && !isnan(a.peak))
        errors.peak_force = errors_ratio(fabs(fmax(b.peak, 0) - a.peak), a.peak);
    errors.rms_displacement = errors_ratio(fabs(point->summary.rms_displacement - rms), rms);
    const Summary *is = &point->summary, *should = &reference->summary;
    errors.peak_storey_drift = errors_ratio(fabs(is->peak_storey_drift - should->peak_storey_drift),
                                            should->peak_storey_drift);
    errors.peak_base_shear =
        errors_ratio(fabs(is->peak_base_shear - should->peak_base_shear), should->peak_base_shear);
    return errors;
}

Status error_metrics_request(Simulation *simulation, Problem *problem) {
    const size_t storeys = structure_storeys(scene_structure(&simulation->scene));
    static const ChannelId wanted[] = {CHANNEL_DISPLACEMENT, CHANNEL_MEAN_ACCELERATION};
    Texts *names = &simulation->output.channels;
    texts_clear(names);
    for (size_t i = 0; i < COUNT(wanted) * storeys; i++)
        if (channel_names_add(&simulation->scene, wanted[i / storeys], i % storeys + 1, names) !=
            STATUS_OK)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    return STATUS_OK;
}
