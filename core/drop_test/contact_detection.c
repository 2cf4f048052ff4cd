// Baseline: where the values lie densest, which is not the median where contacts fill half of the
// trace; of the whole, or of sixteen parts with a line through them (Theil and Sen), whichever
// leaves the values denser. Then what lies outside contacts is fitted with a polynomial again and
// again, as it becomes clear what that is. Nothing here is random.
#include "core/drop_test/contact_detection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/force_trace.h"

enum { PARTS = 16, PART_MIN = 16, TERMS = 3 };

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// What a value that comes again and again in sorted ones is next to, if that comes often as well:
// the step of a converter that is coarser than the noise; else 0.
static double step_about(const double *values, size_t count, size_t at) {
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

// The middle of the shortest interval that holds 30 % of the values, which become sorted.
static double densest(double *values, size_t count, double *width) {
    qsort(values, count, sizeof *values, by_value);
    const size_t held = count * 3 / 10 < 2 ? (count < 2 ? count : 2) : count * 3 / 10;
    size_t best = 0;
    for (size_t i = 1; i + held <= count; i++)
        if (values[i + held - 1] - values[i] < values[best + held - 1] - values[best])
            best = i;
    *width = values[best + held - 1] - values[best];
    // Of few the shortest is shorter by chance.
    *width *= 1 + 8 / (double)held;
    if (*width == 0)
        *width = step_about(values, count, best);
    return held % 2 == 1 ? values[best + held / 2]
                         : (values[best + held / 2 - 1] + values[best + held / 2]) / 2;
}

// A line c[0] + c[1] u, u from -1 to 1 over the trace.
static void line_through_parts(const double *force, size_t count, double *scratch, double *c) {
    double place[PARTS], value[PARTS], slopes[PARTS * (PARTS - 1) / 2], width;
    size_t n = 0;
    for (size_t i = 0; i < PARTS; i++) {
        const size_t from = count * i / PARTS, to = count * (i + 1) / PARTS;
        memcpy(scratch, force + from, (to - from) * sizeof *scratch);
        value[i] = densest(scratch, to - from, &width);
        place[i] = (double)(from + to) / (double)count - 1;
        for (size_t j = 0; j < i; j++)
            slopes[n++] = (value[i] - value[j]) / (place[i] - place[j]);
    }
    qsort(slopes, n, sizeof *slopes, by_value);
    c[1] = (slopes[n / 2 - 1] + slopes[n / 2]) / 2;
    for (size_t i = 0; i < PARTS; i++)
        value[i] -= c[1] * place[i];
    qsort(value, PARTS, sizeof *value, by_value);
    c[0] = (value[PARTS / 2 - 1] + value[PARTS / 2]) / 2;
}

static double place_of(double i, size_t count) {
    return count > 1 ? 2 * i / (double)(count - 1) - 1 : 0;
}

double contact_detection_baseline(const ContactDetection *found, double sample) {
    const double u = place_of(sample, found->samples);
    return found->baseline + u * (found->bend[0] + u * found->bend[1]);
}

static void take_off(ContactDetection *found, const Reals *force, const double *c) {
    for (size_t i = 0; i < force->count; i++) {
        const double u = place_of((double)i, force->count);
        found->force[i] = force->at[i] - (c[0] + u * (c[1] + u * c[2]));
    }
    found->baseline = c[0];
    found->bend[0] = c[1];
    found->bend[1] = c[2];
    found->samples = force->count;
}

// A polynomial of so many terms added to c, through the samples outside contacts, by least squares;
// the sum of squares that it leaves.
static double refine(const Reals *force, const bool *is_inside, size_t terms, double *c) {
    double a[TERMS][TERMS + 1] = {{0}};
    for (size_t i = 0; i < force->count; i++) {
        if (is_inside[i])
            continue;
        const double u = place_of((double)i, force->count), power[TERMS] = {1, u, u * u};
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
        const double u = place_of((double)i, force->count);
        const double left = force->at[i] - (c[0] + u * (c[1] + u * c[2]));
        sum += is_inside[i] ? 0 : left * left;
    }
    return sum;
}

// A level, and a slope and a bend where they explain more than chance does. Returns the variance of
// what is left.
static double refine_best(const Reals *force, const bool *is_inside, size_t outside, double *c) {
    double best = refine(force, is_inside, 1, c);
    double variance = best / ((double)outside - 1);
    for (size_t terms = 2; terms <= TERMS && outside >= 6 * terms; terms++) {
        double other[TERMS];
        memcpy(other, c, sizeof other);
        const double left = refine(force, is_inside, terms, other);
        const double freedom = (double)(outside - terms);
        if (!(best - left > 12 * left / freedom))
            continue;
        memcpy(c, other, sizeof other);
        best = left;
        variance = left / freedom;
    }
    return variance;
}

// Marks what is above the threshold, with half its length and a little about it; how many are not.
static size_t mark(const ContactDetection *found, size_t count, double threshold, bool *is_inside) {
    memset(is_inside, 0, count * sizeof *is_inside);
    size_t outside = count, marked = 0; // all before `marked` are done
    for (size_t i = 0; i < count; i++) {
        if (!(fabs(found->force[i]) > threshold))
            continue;
        size_t end = i + 1;
        while (end < count && fabs(found->force[end]) > threshold)
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
        marked = end; // what is behind may be marked again
    }
    return outside;
}

static Status find_baseline(const Reals *force, ContactDetection *found) {
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
    level[0] = densest(scratch, n, &width);
    bool is_line = false;
    if (n >= PARTS * PART_MIN) {
        line_through_parts(force->at, n, scratch, line);
        take_off(found, force, line);
        memcpy(scratch, found->force, n * sizeof *scratch);
        line[0] += densest(scratch, n, &line_width);
        is_line = line_width < width;
    }
    double *c = is_line ? line : level;
    take_off(found, force, c);
    // 30 % of a normal distribution lie within 0.385 of its deviation; of what there is of it.
    double noise = (is_line ? line_width : width) / 0.77, largest = 0;
    for (size_t i = 0; i < n; i++)
        largest = fmax(largest, fabs(found->force[i]));
    for (int round = 0; round < 6; round++) {
        const size_t outside = mark(found, n, fmax(4 * noise, 1e-6 * largest), is_inside);
        if (outside < 2)
            break;
        noise = sqrt(refine_best(force, is_inside, outside, c));
        take_off(found, force, c);
        found->noise_count = (double)outside;
    }
    found->noise = noise;
    free(scratch);
    free(is_inside);
    return STATUS_OK;
}

static bool add_run(ContactDetection *found, const DetectedContact *run, size_t *most) {
    if (found->count == TRACE_CONTACTS_MAX) {
        found->is_full = true;
        return true;
    }
    if (found->count == *most) {
        const size_t more = *most == 0 ? 16 : 2 * *most;
        DetectedContact *runs = realloc(found->runs, more * sizeof *runs);
        if (runs == NULL)
            return false;
        found->runs = runs;
        *most = more;
    }
    found->runs[found->count++] = *run;
    return true;
}

// Whether `next` belongs to the contact `run`: after noise that dips below the threshold, though
// not to the baseline, or as the tensile end, which is smaller and follows soon.
static bool belongs(const ContactDetection *found, const DetectedContact *run,
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
        sum += found->force[i];
    return fabs(sum) > found->threshold / 2 * (double)gap && (sum > 0) == (run->peak > 0);
}

static Status find_runs(size_t count, ContactDetection *found) {
    size_t most = 0;
    for (size_t i = 0; i < count; i++) {
        const double value = found->force[i];
        if (!(fabs(value) > found->threshold))
            continue;
        DetectedContact run = {.first = i, .last = i, .pressed = i, .peak = value};
        while (run.last + 1 < count && fabs(found->force[run.last + 1]) > found->threshold &&
               (found->force[run.last + 1] > 0) == (value > 0)) {
            run.last++;
            if (fabs(found->force[run.last]) > fabs(run.peak))
                run.peak = found->force[run.last];
        }
        run.pressed = run.last;
        i = run.last;
        DetectedContact *before = found->count > 0 ? &found->runs[found->count - 1] : NULL;
        if (before == NULL || found->is_full || !belongs(found, before, &run)) {
            if (!add_run(found, &run, &most))
                return STATUS_NO_MEMORY;
            continue;
        }
        before->last = run.last;
        if ((before->peak > 0) == (run.peak > 0)) {
            before->pressed = run.last;
            if (fabs(run.peak) > fabs(before->peak))
                before->peak = run.peak;
        }
    }
    return STATUS_OK;
}

Status contact_detection_run(const Reals *force, double threshold, ContactDetection *found) {
    *found = (ContactDetection){.noise_count = 0};
    found->force = malloc((force->count + 1) * sizeof *found->force);
    if (found->force == NULL)
        return STATUS_NO_MEMORY;
    TRY(find_baseline(force, found));
    double largest = 0;
    for (size_t i = 0; i < force->count; i++)
        largest = fmax(largest, fabs(found->force[i]));
    found->threshold = isnan(threshold) ? fmax(6 * found->noise, 0.002 * largest) : threshold;
    return find_runs(force->count, found);
}

void contact_detection_clear(ContactDetection *found) {
    free(found->force);
    free(found->runs);
    *found = (ContactDetection){.count = 0};
}
