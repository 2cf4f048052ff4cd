// The likelihood of start, end and L, with size, baseline and noise integrated out, each value of
// start, end and e = exp(-L) counting alike beforehand. It jumps from gap to gap between samples:
// where the force jumps by much more than the noise, the samples say for sure in which gap a
// contact began, and it may have been anywhere there. So boxes, a gap of starts by a gap of ends,
// are filled with points one by one, from the best one outwards, as long as they matter:
//
//   start over its range under a normal distribution cut off by the box, end over that given start,
//   L at its best given both, by the parabola through three values.
#include "core/measure/trace_interval.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { START, END, DECAY };
enum { REACH = 24, SIDE = 2 * REACH + 1, POINTS_LEAST = 6, POINTS_MOST = 14 };

// Beyond which a width of L is that of what is asked at all.
#define WIDTH_MOST 1.0

typedef struct Point {
    double weight; // its log, first
    double contact_time, half_width, start, end, decay, decay_variance;
} Point;
typedef struct Points {
    Point *at;
    size_t count, most;
} Points;

// What lies within [low, high] of a normal distribution and is not beyond e^-12 of its largest
// there.
static bool range(double mean, double deviation, double *low, double *high) {
    const double nearest = fmin(fmax(mean, *low), *high), away = nearest - mean;
    const double reach = sqrt(away * away + 24 * deviation * deviation);
    *low = fmax(*low, mean - reach);
    *high = fmin(*high, mean + reach);
    return *high > *low;
}

static int places(double low, double high, double deviation) {
    return (int)fmin(fmax(ceil((high - low) / (0.7 * deviation)), POINTS_LEAST), POINTS_MOST);
}

static bool invert(double a[3][3], double inverse[3][3]) {
    const double det = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                       a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                       a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int p = (j + 1) % 3, q = (j + 2) % 3, r = (i + 1) % 3, s = (i + 2) % 3;
            inverse[i][j] = (a[p][r] * a[q][s] - a[p][s] * a[q][r]) / det;
        }
    return det > 0 && inverse[0][0] > 0 && inverse[1][1] > 0 && inverse[2][2] > 0;
}

// The log likelihood at the best L given start and end, and the residue there; *width is that of
// the normal distribution that L has about it.
static double profile(const TraceWindow *window, const TraceBox *box, TracePoint *point,
                      double step, double *width, TraceResidue *best) {
    double value = -(double)INFINITY;
    for (int round = 0; round < 6; round++) {
        const double centre = point->part[DECAY];
        double at[3];
        for (int i = 0; i < 3; i++) {
            point->part[DECAY] = centre + (i - 1) * step;
            const TraceResidue left = trace_residue(window, point, box);
            at[i] = trace_likelihood(window, left.sum);
            if (i == 1)
                *best = left;
        }
        point->part[DECAY] = centre;
        if (!isfinite(at[0] + at[1] + at[2]))
            return -(double)INFINITY;
        const double slope = (at[2] - at[0]) / 2, bend = 2 * at[1] - at[0] - at[2];
        const double shift = bend > 0 ? fmin(fmax(slope / bend, -4), 4) : slope > 0 ? 4 : -4;
        const double next = fmin(fmax(centre + step * shift, box->least[DECAY]), box->most[DECAY]);
        *width = bend > 0 ? fmin(step / sqrt(bend), WIDTH_MOST) : WIDTH_MOST;
        value = at[1];
        if (fabs(next - centre) < step) {
            const double part = (next - centre) / step;
            value += part * (slope - bend * part / 2);
            point->part[DECAY] = next;
            break;
        }
        point->part[DECAY] = next;
    }
    return value;
}

// Fills a box; *height is the largest weight in it.
static bool fill(const TraceWindow *window, const TraceBox *box, const TraceFit *fit,
                 Points *points, double *height) {
    double curvature[3][3], spread[3][3];
    const double variance = trace_variance(window, fit->residue.sum);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            curvature[i][j] = fit->curvature[i][j] / variance;
    if (!invert(curvature, spread))
        return false;
    double centre[3];
    for (int i = 0; i < 3; i++) {
        centre[i] = fit->at.part[i];
        for (int j = 0; j < 3; j++)
            centre[i] -= spread[i][j] * fit->slope[j] / variance;
    }
    const double start_deviation = sqrt(spread[START][START]);
    const double share = spread[START][END] / spread[START][START];
    const double end_deviation = sqrt(fmax(spread[END][END] - share * spread[START][END], 0));
    const double step = 1 / sqrt(curvature[DECAY][DECAY]);
    double low = box->least[START], high = box->most[START];
    if (!(end_deviation > 0) || !range(centre[START], start_deviation, &low, &high))
        return false;
    const int starts = places(low, high, start_deviation);
    const double start_step = (high - low) / starts;
    for (int i = 0; i < starts; i++) {
        TracePoint point;
        point.part[START] = low + (i + 0.5) * start_step;
        const double away = point.part[START] - centre[START];
        double near = box->least[END], far = box->most[END];
        if (!range(centre[END] + share * away, end_deviation, &near, &far))
            continue;
        const int ends = places(near, far, end_deviation);
        const double end_step = (far - near) / ends;
        for (int j = 0; j < ends; j++) {
            point.part[END] = near + (j + 0.5) * end_step;
            const double beyond = point.part[END] - centre[END];
            point.part[DECAY] =
                centre[DECAY] - (curvature[DECAY][START] * away + curvature[DECAY][END] * beyond) /
                                    curvature[DECAY][DECAY];
            point.part[DECAY] = fmin(fmax(point.part[DECAY], box->least[DECAY]), box->most[DECAY]);
            double width;
            TraceResidue best = {0};
            const double value = profile(window, box, &point, step, &width, &best);
            TraceShape shape;
            Point *target = &points->at[points->count];
            if (points->count == points->most || !isfinite(value) ||
                !trace_point_shape(window, &point, &shape, &target->contact_time))
                continue;
            *target = (Point){
                .weight = value - point.part[DECAY] + log(width) - log(best.model_square) / 2 +
                          log(start_step * end_step),
                .contact_time = target->contact_time,
                .half_width = (fabs(1 - share) * start_step + end_step) / 4 / shape.length,
                .start = point.part[START],
                .end = point.part[END],
                .decay = point.part[DECAY],
                .decay_variance = width * width,
            };
            *height = fmax(*height, target->weight);
            points->count++;
        }
    }
    return true;
}

// So many gaps at once that neither the pulse nor the jump tells them apart.
static long gaps_of(const TraceWindow *window, const TraceFit *fit) {
    double curvature[3][3], spread[3][3];
    const double variance = trace_variance(window, fit->residue.sum);
    memcpy(curvature, fit->curvature, sizeof curvature);
    if (!invert(curvature, spread))
        return 1;
    TraceShape shape;
    double T;
    trace_point_shape(window, &fit->at, &shape, &T);
    const double A = fit->residue.amplitude;
    const double jump = fmax(fabs(A * trace_shape_force(&shape, 0)),
                             fabs(A * trace_shape_force(&shape, shape.length)));
    const double deviation = sqrt(fmin(spread[START][START], spread[END][END]) * variance);
    return (long)fmin(fmax(floor(fmin(deviation, variance / (jump * jump)) / 2), 1), 1e6);
}

static void spread_out(const TraceWindow *window, const TraceFit *fits, size_t count,
                       Points *points) {
    const TraceFit *fit = fits;
    static const int moves[8][2] = {{-1, 0},  {1, 0}, {0, -1}, {0, 1},
                                    {-1, -1}, {1, 1}, {-1, 1}, {1, -1}};
    bool is_seen[SIDE][SIDE] = {{false}};
    TraceFit from[SIDE * SIDE];
    int queue[SIDE * SIDE][2], head = 0, tail = 0;
    double height = -(double)INFINITY;
    const long gaps = gaps_of(window, fit);
    for (size_t i = 0; i < count; i++) {
        const long p = REACH + lround((double)(fits[i].first - fit->first) / (double)gaps);
        const long q = REACH + lround((double)(fits[i].last - fit->last) / (double)gaps);
        if (p < 0 || q < 0 || p >= SIDE || q >= SIDE || is_seen[p][q])
            continue;
        is_seen[p][q] = true;
        from[tail] = fits[i];
        queue[tail][0] = (int)p;
        queue[tail][1] = (int)q;
        tail++;
    }
    while (head < tail) {
        TraceFit here = from[head];
        const int p = queue[head][0], q = queue[head][1];
        head++;
        const TraceBox box =
            trace_box(fit->first + (p - REACH) * gaps, fit->last + (q - REACH) * gaps, gaps);
        trace_fit_box(window, &box, &here);
        const double gain =
            trace_likelihood(window, here.residue.sum) - trace_likelihood(window, fit->residue.sum);
        if (!(gain > -14) || !fill(window, &box, &here, points, &height))
            continue;
        for (int way = 0; way < 8; way++) {
            const int r = p + moves[way][0], s = q + moves[way][1];
            if (r < 0 || s < 0 || r >= SIDE || s >= SIDE || is_seen[r][s])
                continue;
            is_seen[r][s] = true;
            from[tail] = here;
            queue[tail][0] = r;
            queue[tail][1] = s;
            tail++;
        }
    }
}

static int by_contact_time(const void *a, const void *b) {
    const Point *p = a, *q = b;
    return (p->contact_time > q->contact_time) - (p->contact_time < q->contact_time);
}

static void believe(TraceBelief *belief, const Points *points, size_t member, double sum) {
    double mean = 0, square = 0;
    for (size_t i = 0; i < points->count; i++)
        mean +=
            points->at[i].weight * *(const double *)((const char *)&points->at[i] + member) / sum;
    for (size_t i = 0; i < points->count; i++) {
        const double off = *(const double *)((const char *)&points->at[i] + member) - mean;
        square += points->at[i].weight * off * off / sum;
    }
    belief->mean = mean;
    belief->deviation = sqrt(square);
}

// Where so much of the weight lies below, each point spread evenly over its width.
static double quantile(const Points *points, double share, double sum) {
    double low = (double)INFINITY, high = -(double)INFINITY;
    for (size_t i = 0; i < points->count; i++) {
        low = fmin(low, points->at[i].contact_time - points->at[i].half_width);
        high = fmax(high, points->at[i].contact_time + points->at[i].half_width);
    }
    for (int step = 0; step < 50; step++) {
        const double middle = low + (high - low) / 2;
        double below = 0;
        for (size_t i = 0; i < points->count; i++) {
            const Point *point = &points->at[i];
            const double part =
                (middle - point->contact_time + point->half_width) / (2 * point->half_width);
            below += point->weight * fmin(fmax(part, 0), 1);
        }
        *(below < share * sum ? &low : &high) = middle;
    }
    return low + (high - low) / 2;
}

Status trace_interval(const TraceWindow *window, const TraceFit *fits, size_t count,
                      TraceInterval *interval) {
    Points points = {.most = 40000};
    points.at = malloc(points.most * sizeof *points.at);
    *interval = (TraceInterval){.least = (double)NAN, .most = (double)NAN};
    if (points.at == NULL)
        return STATUS_NO_MEMORY;
    spread_out(window, fits, count, &points);
    double height = -(double)INFINITY, sum = 0, variance = 0;
    for (size_t i = 0; i < points.count; i++)
        height = fmax(height, points.at[i].weight);
    size_t kept = 0;
    for (size_t i = 0; i < points.count; i++) {
        points.at[i].weight = exp(points.at[i].weight - height);
        if (points.at[i].weight > 1e-7)
            points.at[kept++] = points.at[i];
    }
    points.count = kept;
    qsort(points.at, points.count, sizeof *points.at, by_contact_time);
    for (size_t i = 0; i < points.count; i++) {
        sum += points.at[i].weight;
        variance += points.at[i].weight * points.at[i].decay_variance;
    }
    if (points.count > 0) {
        believe(&interval->contact_time, &points, offsetof(Point, contact_time), sum);
        believe(&interval->start, &points, offsetof(Point, start), sum);
        believe(&interval->end, &points, offsetof(Point, end), sum);
        believe(&interval->decay, &points, offsetof(Point, decay), sum);
        interval->decay.deviation = hypot(interval->decay.deviation, sqrt(variance / sum));
        interval->least = quantile(&points, 0.025, sum);
        interval->most = quantile(&points, 0.975, sum);
    }
    free(points.at);
    return STATUS_OK;
}
