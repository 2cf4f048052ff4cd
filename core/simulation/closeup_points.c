// The ends are the contact law's own: a sample at a release shows the flight behind it, so the
// force there follows from the speed.
#include "core/simulation/closeup_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TIME, FORCE, PENETRATION, SPEED, COLUMNS };

static double sign_of(int side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// One row of the answer, in the fine run's time.
typedef struct Point {
    double time, force, penetration, speed;
} Point;

static Point sample_at(const Shot *shot, size_t i) {
    const Column *fine = shot->fine.at;
    const double sign = sign_of(shot->again->side);
    return (Point){.time = (double)i / shot->plan->sample_rate,
                   .force = sign * fine[FINE_FORCE].values[i],
                   .penetration = fine[FINE_PENETRATION].values[i],
                   .speed = sign *
                            (fine[FINE_DAMPER_VELOCITY].values[i] - fine[FINE_VELOCITY].values[i])};
}

// The parameters of the contact, which may have begun before a pause of its force.
static ContactParameters frozen(const Shot *shot) {
    const Impact *first = shot->again;
    for (const Impact *at = first; at > shot->response.impacts.at && first->is_resumed; at--)
        if (at[-1].damper == first->damper && at[-1].side == first->side)
            first = &at[-1];
    const PlanStop *stop = &shot->plan->dampers[first->damper - 1].stops[first->side];
    return contact_freeze(&stop->contact, first->approach_speed);
}

// The contact's side of an end of it, `near` being the nearest sample within.
static Point end_at(const Shot *shot, double time, double speed, bool has_force,
                    const Point *near) {
    const ContactParameters own = frozen(shot);
    Point point = {.time = time, .speed = speed};
    if (shot->plan->form == CONTACT_LINEAR) {
        point.force = has_force ? own.damping * speed : 0;
        point.penetration = has_force ? 0 : fmax(-own.damping * speed / own.stiffness, 0);
    } else {
        point.penetration = fmax(near->penetration + near->speed * (time - near->time), 0);
        point.force = fmax(shot->plan->law->force(&own, point.penetration, point.speed).value, 0);
    }
    return point;
}

// At the vertex of the parabola through three points; the force is the ledger's, which searched for
// it.
static Point peak_between(const Point *a, const Point *b, const Point *c, double force) {
    const double left = a->time - b->time, right = c->time - b->time;
    const double low = (a->force - b->force) / left, high = (c->force - b->force) / right;
    const double bend = (high - low) / (right - left), slope = low - bend * left;
    const double t = bend != 0 ? fmin(fmax(-slope / (2 * bend), left), right) : 0;
    const double by_a = t * (t - right) / (left * (left - right)),
                 by_c = t * (t - left) / (right * (right - left)), by_b = 1 - by_a - by_c;
    return (Point){.time = b->time + t,
                   .force = copysign(force, b->force),
                   .penetration =
                       by_a * a->penetration + by_b * b->penetration + by_c * c->penetration,
                   .speed = by_a * a->speed + by_b * b->speed + by_c * c->speed};
}

// All rows but the peak's. Returns how many.
static size_t gather(const Shot *shot, Point *points) {
    const Impact *again = shot->again;
    const double rate = shot->plan->sample_rate;
    const bool is_open = isnan(again->end), has_ends = again->kind == IMPACT_IMPACT;
    const double end = is_open ? shot->plan->duration : again->end, edge = 1e-6 / rate;
    const size_t last = shot->plan->count - 1;
    size_t count = has_ends ? 1 : 0, i = (size_t)fmax(ceil((again->start + edge) * rate), 0);
    for (; i <= last && ((double)i / rate < end - edge || (is_open && i == last)); i++)
        points[count++] = sample_at(shot, i);
    if (!has_ends)
        return count;
    const Point none = {.time = again->start};
    const Point *first = count > 1 ? &points[1] : &none;
    points[0] = end_at(shot, again->start, again->approach_speed, !again->is_resumed, first);
    if (is_open)
        return count;
    const bool pulls = shot->plan->separation == SEPARATION_ZERO_PENETRATION;
    points[count] = end_at(shot, end, -again->separation_speed, pulls, &points[count - 1]);
    return count + 1;
}

static size_t add_peak(const Shot *shot, Point *points, size_t count) {
    size_t top = 0;
    for (size_t i = 1; i < count; i++)
        if (fabs(points[i].force) > fabs(points[top].force))
            top = i;
    if (top == 0 || top + 1 >= count || isnan(shot->again->peak_force))
        return count;
    const Point peak =
        peak_between(&points[top - 1], &points[top], &points[top + 1], shot->again->peak_force);
    const double apart = peak.time - points[top].time;
    if (fabs(apart) * shot->plan->sample_rate < 1e-6) {
        points[top] = peak;
        return count;
    }
    const size_t at = apart > 0 ? top + 1 : top;
    memmove(&points[at + 1], &points[at], (count - at) * sizeof *points);
    points[at] = peak;
    return count + 1;
}

Status closeup_points(const Shot *shot, Columns *columns, Problem *problem) {
    static const struct {
        const char *name, *unit;
    } names[COLUMNS] = {[TIME] = {"time", "s"},
                        [FORCE] = {"contact_force", "N"},
                        [PENETRATION] = {"penetration", "m"},
                        [SPEED] = {"approach_speed", "m/s"}};
    Point *points = malloc((shot->plan->count + 3) * sizeof *points);
    if (points == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the contact");
    const size_t count = add_peak(shot, points, gather(shot, points));
    const Status status = columns_make(columns, COLUMNS, count, 0, problem);
    for (size_t c = 0; c < COLUMNS && status == STATUS_OK; c++)
        columns_name(columns, c, names[c].name, names[c].unit);
    for (size_t i = 0; i < count && status == STATUS_OK; i++) {
        columns->at[TIME].values[i] = shot->start + points[i].time;
        columns->at[FORCE].values[i] = points[i].force;
        columns->at[PENETRATION].values[i] = points[i].penetration;
        columns->at[SPEED].values[i] = points[i].speed;
    }
    free(points);
    return status;
}
