// The baseline starts as the densest value, which is not the median where contacts fill half of the
// trace: of the whole trace, or of sixteen parts with a line through them (Theil and Sen),
// whichever leaves the values denser. A polynomial through the samples outside contacts then
// refines it, and the samples outside contacts follow from the polynomial, several times in turn.
#include "core/drop_test/contact_detection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PARTS = 16, PART_MIN = 16, TERMS = 3 };

static int detection_compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The distance from a repeated value to its neighbours among sorted values, if those are frequent
// too: the step of a converter that is coarser than the noise; else 0.
static double detection_step(const double *values, size_t count, size_t at) {
    size_t from = at, to = at + 1, before, after;
    while (from > 0 && values[from - 1] == values[at])
        from--;
    while (to < count && values[to] == values[at])
        to++;
    for (before = from; before > 0 && values[before - 1] == values[from - 1]; before--)
        ;
    for (after = to; after < count && values[after] == values[to]; after++)
        ;
    if (from - before + (after - to) < 3 + count / 50)
        return 0;
    return fmax(from > before ? values[at] - values[from - 1] : 0,
                after > to ? values[to] - values[at] : 0);
}

// The middle of the shortest interval that holds 30 % of the values. Sorts them.
static double detection_densest(double *values, size_t count, double *width) {
    qsort(values, count, sizeof *values, detection_compare);
    const size_t held = count * 3 / 10 < 2 ? (count < 2 ? count : 2) : count * 3 / 10;
    size_t best = 0;
    for (size_t i = 1; i + held <= count; i++)
        if (values[i + held - 1] - values[i] < values[best + held - 1] - values[best])
            best = i;
    *width = values[best + held - 1] - values[best];
    // The shortest of few is too short by chance.
    *width *= 1 + 8 / (double)held;
    if (*width == 0)
        *width = detection_step(values, count, best);
    return held % 2 == 1 ? values[best + held / 2]
                         : (values[best + held / 2 - 1] + values[best + held / 2]) / 2;
}

// A line c[0] + c[1] u through the densest values of the parts, by medians.
static void detection_line(const double *force, size_t count, double *scratch, double *c) {
    double place[PARTS], value[PARTS], slopes[PARTS * (PARTS - 1) / 2], width;
    size_t n = 0;
    for (size_t i = 0; i < PARTS; i++) {
        const size_t from = count * i / PARTS, to = count * (i + 1) / PARTS;
        memcpy(scratch, force + from, (to - from) * sizeof *scratch);
        value[i] = detection_densest(scratch, to - from, &width);
        place[i] = (double)(from + to) / (double)count - 1;
        for (size_t j = 0; j < i; j++)
            slopes[n++] = (value[i] - value[j]) / (place[i] - place[j]);
    }
    qsort(slopes, n, sizeof *slopes, detection_compare);
    c[1] = (slopes[n / 2 - 1] + slopes[n / 2]) / 2;
    for (size_t i = 0; i < PARTS; i++)
        value[i] -= c[1] * place[i];
    qsort(value, PARTS, sizeof *value, detection_compare);
    c[0] = (value[PARTS / 2 - 1] + value[PARTS / 2]) / 2;
}

// u of a sample, from -1 to 1 over the trace.
static double detection_place(double i, size_t count) {
    return count > 1 ? 2 * i / (double)(count - 1) - 1 : 0;
}

double contact_detection_baseline(const ContactDetection *detection, double sample) {
    const double u = detection_place(sample, detection->samples);
    return detection->baseline + u * (detection->bend[0] + u * detection->bend[1]);
}

static void detection_subtract(ContactDetection *detection, const Reals *force, const double *c) {
    for (size_t i = 0; i < force->count; i++) {
        const double u = detection_place((double)i, force->count);
        detection->force[i] = force->at[i] - (c[0] + u * (c[1] + u * c[2]));
    }
    detection->baseline = c[0];
    detection->bend[0] = c[1];
    detection->bend[1] = c[2];
    detection->samples = force->count;
}

// Adds to c a polynomial of `terms` terms through the samples outside contacts, by least squares.
// Returns the sum of squares of the residuals.
static double detection_fit(const Reals *force, const bool *is_inside, size_t terms, double *c) {
    double a[TERMS][TERMS + 1] = {{0}};
    for (size_t i = 0; i < force->count; i++) {
        if (is_inside[i])
            continue;
        const double u = detection_place((double)i, force->count), power[TERMS] = {1, u, u * u};
        const double left = force->at[i] - (c[0] + u * (c[1] + u * c[2]));
        for (size_t j = 0; j < terms; j++) {
            for (size_t k = 0; k < terms; k++)
                a[j][k] += power[j] * power[k];
            a[j][TERMS] += power[j] * left;
        }
    }
    for (size_t j = 0; j < terms; j++)
        for (size_t i = 0; i < terms; i++) {
            if (i == j)
                continue;
            const double factor = a[i][j] / a[j][j];
            for (size_t k = 0; k <= TERMS; k++)
                a[i][k] -= factor * a[j][k];
        }
    for (size_t j = 0; j < terms; j++)
        if (isfinite(a[j][TERMS] / a[j][j]))
            c[j] += a[j][TERMS] / a[j][j];
    double sum = 0;
    for (size_t i = 0; i < force->count; i++) {
        const double u = detection_place((double)i, force->count);
        const double left = force->at[i] - (c[0] + u * (c[1] + u * c[2]));
        sum += is_inside[i] ? 0 : left * left;
    }
    return sum;
}

// Fits a level, and a slope and a bend where they are significant. Returns the variance of the
// residuals.
static double detection_fit_baseline(const Reals *force, const bool *is_inside, size_t outside,
                                     double *c) {
    double best = detection_fit(force, is_inside, 1, c);
    double variance = best / ((double)outside - 1);
    for (size_t terms = 2; terms <= TERMS && outside >= 6 * terms; terms++) {
        double other[TERMS];
        memcpy(other, c, sizeof other);
        const double left = detection_fit(force, is_inside, terms, other);
        const double freedom = (double)(outside - terms);
        if (!(best - left > 12 * left / freedom))
            continue;
        memcpy(c, other, sizeof other);
        best = left;
        variance = left / freedom;
    }
    return variance;
}

// Marks the samples above the threshold and, on both sides, half of each run's length and two more.
// Returns how many are not marked.
static size_t detection_mark(const ContactDetection *detection, size_t count, double threshold,
                             bool *is_inside) {
    memset(is_inside, 0, count * sizeof *is_inside);
    size_t outside = count, marked = 0; // all before `marked` are final
    for (size_t i = 0; i < count; i++) {
        if (!(fabs(detection->force[i]) > threshold))
            continue;
        size_t end = i + 1;
        while (end < count && fabs(detection->force[end]) > threshold)
            end++;
        const size_t about = (end - i) / 2 + 2;
        size_t from = i > about ? i - about : 0;
        from = from > marked ? from : marked;
        marked = end + about < count ? end + about : count;
        for (size_t k = from; k < marked; k++) {
            outside -= !is_inside[k];
            is_inside[k] = true;
        }
        i = end - 1;
        marked = end; // samples behind the run may be marked again
    }
    return outside;
}

static Status detection_find_baseline(const Reals *force, ContactDetection *detection) {
    const size_t n = force->count;
    double *scratch = malloc(n * sizeof *scratch);
    bool *is_inside = malloc(n * sizeof *is_inside);
    if (scratch == NULL || is_inside == NULL) {
        free(scratch);
        free(is_inside);
        return STATUS_NO_MEMORY;
    }
    double level[TERMS] = {0}, width, line[TERMS] = {0}, line_width;
    memcpy(scratch, force->at, n * sizeof *scratch);
    level[0] = detection_densest(scratch, n, &width);
    bool is_line = false;
    if (n >= PARTS * PART_MIN) {
        detection_line(force->at, n, scratch, line);
        detection_subtract(detection, force, line);
        memcpy(scratch, detection->force, n * sizeof *scratch);
        line[0] += detection_densest(scratch, n, &line_width);
        is_line = line_width < width;
    }
    double *c = is_line ? line : level;
    detection_subtract(detection, force, c);
    // 30 % of a normal distribution are within 0.385 standard deviations of its mean.
    double noise = (is_line ? line_width : width) / 0.77, largest = 0;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(detection->force[i]));
    for (int round = 0; round < 6; round++) {
        const size_t outside =
            detection_mark(detection, n, fmax(4 * noise, 1e-6 * largest), is_inside);
        if (outside < 2)
            break;
        noise = sqrt(detection_fit_baseline(force, is_inside, outside, c));
        detection_subtract(detection, force, c);
        detection->noise_count = (double)outside;
    }
    detection->noise = noise;
    free(scratch);
    free(is_inside);
    return STATUS_OK;
}

// Whether `next` belongs to the contact `run`: as its tensile part, which is smaller and
// follows soon, or after noise that fell below the threshold but not to the baseline.
static bool detection_is_same(const ContactDetection *detection, const DetectedContact *run,
                              const DetectedContact *next) {
    const size_t length = run->last - run->first + 1, other = next->last - next->first + 1;
    const size_t longer = length > other ? length : other, gap = next->first - run->last - 1;
    if (gap > 2 + longer)
        return false;
    if ((run->peak > 0) != (next->peak > 0))
        return fabs(next->peak) < fabs(run->peak);
    if (run->pressed != run->last)
        return false;
    double sum = 0;
    for (size_t i = run->last + 1; i < next->first; i++)
        sum += detection->force[i];
    return fabs(sum) > detection->threshold / 2 * (double)gap && (sum > 0) == (run->peak > 0);
}

static void detection_find_runs(size_t count, ContactDetection *detection) {
    for (size_t i = 0; i < count; i++) {
        const double value = detection->force[i];
        if (!(fabs(value) > detection->threshold))
            continue;
        DetectedContact run = {.first = i, .last = i, .pressed = i, .peak = value};
        while (run.last + 1 < count &&
               fabs(detection->force[run.last + 1]) > detection->threshold &&
               (detection->force[run.last + 1] > 0) == (value > 0)) {
            run.last++;
            if (fabs(detection->force[run.last]) > fabs(run.peak))
                run.peak = detection->force[run.last];
        }
        run.pressed = run.last;
        i = run.last;
        DetectedContact *before =
            detection->count > 0 ? &detection->runs[detection->count - 1] : NULL;
        if (before == NULL || detection->is_full || !detection_is_same(detection, before, &run)) {
            detection->is_full = detection->count == TRACE_CONTACTS_MAX;
            if (!detection->is_full)
                detection->runs[detection->count++] = run;
            continue;
        }
        before->last = run.last;
        if ((before->peak > 0) == (run.peak > 0)) {
            before->pressed = run.last;
            if (fabs(run.peak) > fabs(before->peak))
                before->peak = run.peak;
        }
    }
}

Status contact_detection_run(const Reals *force, double threshold, ContactDetection *detection) {
    *detection = (ContactDetection){.noise_count = 0};
    detection->force = malloc((force->count + 1) * sizeof *detection->force);
    if (detection->force == NULL)
        return STATUS_NO_MEMORY;
    TRY(detection_find_baseline(force, detection));
    double largest = 0;
    for (size_t i = 0; i < force->count; i++)
        largest = fmax(largest, fabs(detection->force[i]));
    detection->threshold =
        isnan(threshold) ? fmax(6 * detection->noise, 0.002 * largest) : threshold;
    detection_find_runs(force->count, detection);
    return STATUS_OK;
}

void contact_detection_clear(ContactDetection *detection) {
    free(detection->force);
    *detection = (ContactDetection){.count = 0};
}
