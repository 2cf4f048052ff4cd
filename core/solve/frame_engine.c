// Flight of all masses over a whole sample interval is one step where bounds on the gaps' curvature
// prove that no stop can be reached (frame_flight.h); a mass pressed to a stiff stop that it surely
// does not leave has long steps too (frame_press.h); everything else goes by arcs (frame_arc.h),
// whose polynomials locate events to rounding. Time is a sample's number and an offset from it, so
// that short contacts keep their digits late in a run.
#include "core/solve/frame_engine.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/solve/frame_work.h"

enum { STILL_EVENTS = 1000, STORM_EVENTS = 100, IDLE_STEPS = 1000 };

// An arc this short would lose its speeds' digits below the smallest doubles: it takes no time.
static const double SHORTEST = 1e-250; // [s]

static const double GAIN_CONTACTS = 1e3;

static const double WATCH_STEPS = 3e4; // between looks at the progress
static const double WORK_OF_STEP = 60; // multiplications

Status frame_engine_check(FrameEngine *engine) {
    const Frame *frame = &engine->frame;
    engine->work = 0;
    const EnergyState energy = frame_energy(frame);
    double sum = energy.kinetic + energy.strain;
    for (size_t i = 0; i < frame->mode_count; i++)
        sum += fabs(frame->q[i]);
    for (size_t d = 0; d < frame->dampers; d++)
        sum += fabs(frame->damper[d].r);
    if (!isfinite(sum))
        return problem_set(frame->problem, STATUS_UNSTABLE,
                           "the motion left what double precision can hold at t = %.6g s",
                           frame_time(frame));
    if (frame->run->steps_max > 0 && frame->run->steps > frame->run->steps_max)
        return problem_set(frame->problem, STATUS_LIMIT, SOLVER_STOPPED "t = %.6g s of %.6g s",
                           frame->run->steps_max, frame->run->steps_max * SOLVER_STEP,
                           frame_time(frame), frame->plan->duration);
    if (!progress_advance(frame->run->progress, frame_time(frame) / frame->plan->duration))
        return problem_set(frame->problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                           frame_time(frame));
    return STATUS_OK;
}

static double each(const FrameEngine *engine, FrameWorkKind kind) {
    const Frame *frame = &engine->frame;
    return frame_work_steps(kind, frame->mode_count, frame->dampers, frame->diagonal == NULL);
}

static Status count_steps(FrameEngine *engine, double steps) {
    engine->frame.run->steps += steps;
    engine->work += steps;
    return engine->work > WATCH_STEPS ? frame_engine_check(engine) : STATUS_OK;
}

static void take_work(FrameEngine *engine, const FrameWork *work) {
    ledger_work(&engine->frame.ledger, work->input, work->damping);
    engine->record.base_speed += work->ground;
}

// What a stretch of contact or rest adds to a damper's row; the state becomes that of a new peak.
static void take_contact(FrameEngine *engine, size_t d) {
    Frame *frame = &engine->frame;
    FrameDamper *damper = &frame->damper[d];
    const FrameArc *arc = &engine->arc;
    double s = -1, impulse, lost;
    const double peak = arc_largest(frame_arc_force(arc, d), arc->degree - 1,
                                    ledger_least_force(&frame->ledger, &damper->row), &s);
    ledger_force(&frame->ledger, &damper->row, peak);
    if (s > 0) {
        frame_arc_state(arc, frame, s);
        frame_feel(frame);
        frame_record_acceleration(frame);
    }
    frame_arc_contact(arc, frame, d, &impulse, &lost);
    ledger_stretch(&frame->ledger, &damper->row, arc->length, impulse, lost);
}

// After an arc: has the gap of a mass released from rest opened beyond rounding yet? Where the arc
// ends by closing it, the speed stays.
static void leave(FrameDamper *damper, bool is_hit) {
    const double sign = frame_sign((Side)damper->origin);
    if (sign * damper->r < 0)
        damper->leaving = 0;
    else if (!is_hit || sign * damper->w < 0)
        damper->r = damper->w = 0;
}

// Takes what lies on the arc and moves to its end, where `hit` (or none) has its event.
static void pass(FrameEngine *engine, const FrameEvent *hit) {
    Frame *frame = &engine->frame;
    const FrameArc *arc = &engine->arc;
    if (!frame->is_shadow) {
        const FrameWork work = frame_arc_work(arc, frame);
        take_work(engine, &work);
    }
    for (size_t d = 0; d < frame->dampers && !frame->is_shadow; d++)
        if (frame->damper[d].row.is_open)
            take_contact(engine, d);
    frame_arc_state(arc, frame, 1);
    frame->offset += arc->length;
    frame->still_events = 0;
    frame->storm_time += arc->length;
    if (frame->storm_time > frame_clock(frame)) {
        frame->storm_events = 0;
        frame->storm_time = 0;
    }
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->is_fresh = false;
        if (damper->leaving > 0)
            leave(damper, hit != NULL && hit->damper == d);
    }
}

static Status happen(Frame *frame, const FrameEvent *event) {
    const size_t most = STILL_EVENTS * frame->dampers;
    frame->events++;
    frame->storm_events++;
    if (++frame->still_events > most)
        return problem_set(frame->problem, STATUS_UNSTABLE,
                           "more than %zu contact events at one instant, t = %.17g s", most,
                           frame_time(frame));
    frame_happen(frame, event);
    return ledger_status(&frame->ledger, frame->problem);
}

// The longest arc: a half-sine of the base is fast only while it lasts.
static double arc_max(const Frame *frame, const Slice *slice) {
    return 1 / fmax(frame_rate(frame), slice->omega);
}

// One step of contact under a power law, at most `length` long.
static Status press(FrameEngine *engine, const Slice *slice, double length) {
    Frame *frame = &engine->frame;
    FrameOdeStep step;
    frame_ode_step(&engine->ode, slice, length, &step);
    ledger_work(&frame->ledger, step.input, step.damping);
    engine->record.base_speed += step.ground;
    const double before = frame->offset;
    frame->offset += step.length;
    frame->ground = slice_at(slice, step.length);
    frame->still_events = 0;
    // A step may be shorter than what the clock tells, or end where it began; not very many in
    // turn.
    engine->idle = frame->offset > before ? 0 : engine->idle + 1;
    frame->events += engine->idle > 0 && engine->idle < IDLE_STEPS;
    if (step.is_event)
        TRY(happen(frame, &step.event));
    else
        frame_record_note(frame);
    frame->run->work.steps++;
    return count_steps(engine, step.work / WORK_OF_STEP);
}

// A long step of contact. False: it must go by arcs.
static bool hold(FrameEngine *engine, const Slice *slice, double length) {
    Frame *frame = &engine->frame;
    FrameWork work;
    if (slice->omega > 0 && frame->turning == 0)
        return false; // its steps know no such base
    const double taken =
        frame_press_step(&engine->pressing, frame, slice, length, frame->is_shadow ? NULL : &work);
    if (taken == 0)
        return false;
    if (!frame->is_shadow)
        take_work(engine, &work);
    frame->offset += taken;
    frame->ground = slice_at(slice, taken);
    return true;
}

// Masses that touch and part at one instant again and again do so by rounding alone: between stops
// without clearance, say, of a storey that hardly moves yet. They stay as they are for a while that
// is longer each time, until the motion itself decides. (Impulses close such series themselves.)
static bool is_stalled(Frame *frame) {
    if (frame->storm_events < STORM_EVENTS * frame->dampers ||
        frame->plan->form == CONTACT_IMPULSIVE)
        return false;
    const double now = frame_time(frame);
    const bool goes_on = now - frame->stalled_at <= 4 * frame->stall;
    frame->stall = fmax(goes_on ? 2 * frame->stall : 0, frame_clock(frame));
    frame->stalled_at = now;
    return true;
}

// One arc, at most `length` long, up to its end or the first event.
static Status advance(FrameEngine *engine, double length) {
    Frame *frame = &engine->frame;
    FrameArc *arc = &engine->arc;
    Slice slice;
    const double knot = base_cursor_slice(&frame->base, frame->sample, frame->offset, &slice);
    frame->ground = slice.value;
    if (frame_ode_serves(&engine->ode))
        return press(engine, &slice, fmin(length, knot));
    if (hold(engine, &slice, fmin(length, knot)))
        return count_steps(engine, each(engine, FRAME_WORK_HOLD));
    const bool stays = is_stalled(frame);
    const double most = fmin(fmin(length, knot), stays ? frame->stall : INFINITY);
    frame_arc_make(arc, frame, &slice, fmin(most, arc_max(frame, &slice)));
    frame->run->work.arcs++;
    FrameEvent event;
    const bool is_event = frame_find_event(frame, arc, &event) &&
                          !(stays && event.s * arc->length <= frame_clock(frame));
    if (is_event)
        frame_arc_cut(arc, frame, event.s * arc->length < SHORTEST ? 0 : event.s);
    if (arc->length > 0)
        pass(engine, is_event ? &event : NULL);
    if (is_event)
        TRY(happen(frame, &event));
    return count_steps(engine, each(engine, FRAME_WORK_ARC) +
                                   (is_event ? each(engine, FRAME_WORK_EVENT) : 0));
}

Status frame_engine_cross(FrameEngine *engine, double length) {
    Frame *frame = &engine->frame;
    // Less than this cannot be told from nothing: the clock's resolution at the interval's end.
    const double clock = 2 * DBL_EPSILON * length;
    while (length - frame->offset > clock) {
        const double before = frame->offset;
        const size_t events = frame->events;
        TRY(advance(engine, length - frame->offset));
        if (frame->offset == before && frame->events == events)
            return problem_set(frame->problem, STATUS_UNSTABLE,
                               "the contact is too stiff to be followed: at t = %.6g s a step of "
                               "1/%.6g s is below the clock's resolution",
                               frame_time(frame), frame_rate(frame));
    }
    return STATUS_OK;
}

// a_g over whole intervals from the present sample on; returns over how many it has no kinks.
static size_t find_slices(const Frame *frame, size_t count, Slice *slices) {
    size_t found = 0;
    for (; found < count; found++) {
        if (found > 0 && frame->base.base->form == BASE_SINE) {
            const Slice *last = &slices[found - 1];
            slices[found] = (Slice){last->value * frame->turned[0] + last->slope * frame->turned[1],
                                    last->slope * frame->turned[0] - last->value * frame->turned[1],
                                    last->omega};
        } else if (!base_cursor_interval(&frame->base, frame->sample + found, &slices[found]))
            break;
    }
    return found;
}

// Whole intervals at once, up to sample `until`, and writes them down. Returns how many; 0: it must
// go by arcs.
static size_t fly(FrameEngine *engine, size_t until) {
    Frame *frame = &engine->frame;
    FrameRecord *record = &engine->record;
    Slice slices[TRAIL_MAX];
    FrameWork work;
    for (size_t d = 0; d < frame->dampers; d++)
        if (frame->damper[d].phase != FRAME_FLIGHT || frame->damper[d].leaving > 0)
            return 0;
    size_t count = until - frame->sample;
    if (count > TRAIL_MAX)
        count = TRAIL_MAX;
    // Statistics begin with a stretch.
    if (frame->sample + 1 < record->statistics_start &&
        frame->sample + count >= record->statistics_start)
        count = record->statistics_start - 1 - frame->sample;
    count = engine->flight.length == 0 ? 0 : find_slices(frame, count, slices);
    frame->run->work.stop_searches += count > 0 && frame->has_stops;
    if (count > 0)
        count = frame_flight_run(&engine->flight, &engine->trail, frame, slices, count,
                                 frame->is_shadow ? NULL : &work);
    frame->sample += count;
    if (count == 0 || frame->is_shadow)
        return count;
    Work *done = &frame->run->work;
    *(frame->base.base->form == BASE_STILL ? &done->unforced_samples : &done->flight_samples) +=
        count;
    done->mode_samples += count * frame->mode_count;
    frame->ground = base_cursor_at(&frame->base, frame->sample);
    ledger_work(&frame->ledger, work.input, work.damping);
    FrameTrail *trail = &engine->trail;
    frame_trail_feel(trail, frame, count);
    if (frame->sample + 1 - count == record->statistics_start)
        frame_record_forget(frame);
    frame_record_take(record, frame, count);
    frame_record_flight_peaks(record, frame, count);
    return count;
}

Status frame_engine_settle(FrameEngine *engine) {
    Frame *frame = &engine->frame;
    for (bool is_event = true; is_event;) {
        Slice slice;
        FrameEvent event;
        (void)base_cursor_slice(&frame->base, 0, 0, &slice);
        frame_arc_make(&engine->arc, frame, &slice, fmin(frame->interval, arc_max(frame, &slice)));
        is_event = frame_find_event(frame, &engine->arc, &event) && event.s == 0 &&
                   frame->damper[event.damper].phase == FRAME_FLIGHT;
        if (is_event)
            TRY(happen(frame, &event));
    }
    return STATUS_OK;
}

static void balance(Frame *frame) {
    if (frame->is_shadow || frame->sample % 64 != 0)
        return;
    const EnergyState energy = frame_energy(frame);
    ledger_balance(&frame->ledger, &energy);
}

void frame_engine_take_sample(FrameEngine *engine) {
    Frame *frame = &engine->frame;
    if (frame->is_shadow)
        return;
    frame->ground = base_cursor_at(&frame->base, frame->sample);
    frame_feel(frame);
    if (frame->sample == engine->record.statistics_start && frame->sample > 0)
        frame_record_forget(frame);
    frame_trail_take(&engine->trail, frame, engine->record.base_speed);
    frame_record_take(&engine->record, frame, 1);
    frame_record_peaks(frame);
}

// Notes the samples just passed: so many flown over, or the present one.
static void track(FrameEngine *engine, size_t flown) {
    const Frame *frame = &engine->frame;
    const FrameTrail *trail = &engine->trail;
    for (size_t k = 1; k <= (flown > 0 ? flown : 1); k++) {
        const size_t sample = flown > 0 ? frame->sample - flown + k : frame->sample;
        memcpy(engine->track + (sample - 1) % TRAIL_MAX * frame->padded,
               flown > 0 ? trail->q + k * trail->padded : frame->q,
               frame->mode_count * sizeof *engine->track);
    }
}

Status frame_engine_step(FrameEngine *engine, size_t until) {
    Frame *frame = &engine->frame;
    const size_t flown = fly(engine, until);
    if (flown > 0) {
        TRY(count_steps(engine, (double)flown * each(engine, FRAME_WORK_FLIGHT)));
    } else {
        TRY(frame_engine_cross(engine, frame->interval));
        frame->run->work.mode_samples += frame->mode_count;
        frame->sample++;
        frame->offset = 0;
        frame_engine_take_sample(engine);
    }
    if (engine->track != NULL)
        track(engine, flown);
    balance(frame);
    return STATUS_OK;
}

Status frame_engine_make(FrameEngine *engine, Run *run, double tolerance, Response *response,
                         Problem *problem) {
    Frame *frame = &engine->frame;
    TRY(frame_make(frame, run, problem));
    TRY(frame_arc_room(&engine->arc, frame, problem));
    TRY(frame_flight_make(&engine->flight, frame, problem));
    TRY(frame_press_make(&engine->pressing, frame, problem));
    TRY(frame_ode_make(&engine->ode, frame, tolerance, problem));
    TRY(frame_trail_make(&engine->trail, frame, problem));
    TRY(frame_record_start(&engine->record, &engine->trail, frame, response, problem));
    const EnergyState energy = frame_energy(frame);
    ledger_start(&frame->ledger, response, run->impacts_max, &energy);
    // What contacts may be wrong by each, of many of them.
    frame->ledger.gain_max =
        fmax(LEDGER_GAIN_EXACT, tolerance > FRAME_ODE_TOLERANCE ? GAIN_CONTACTS * tolerance : 0);
    return STATUS_OK;
}

Status frame_engine_shadow(FrameEngine *engine, const FrameEngine *of, Run *run, double tolerance,
                           Response *response) {
    Frame *frame = &engine->frame;
    TRY(frame_make(frame, run, NULL));
    TRY(frame_ode_make(&engine->ode, frame, tolerance, NULL));
    engine->arc = of->arc;
    engine->flight = of->flight;
    engine->pressing = of->pressing;
    engine->trail = of->trail;
    frame->is_shadow = true;
    const EnergyState energy = frame_energy(frame);
    ledger_start(&frame->ledger, response, run->impacts_max, &energy);
    return STATUS_OK;
}

void frame_engine_clear(FrameEngine *engine) {
    frame_record_clear(&engine->record);
    frame_trail_clear(&engine->trail);
    frame_flight_clear(&engine->flight);
    frame_press_clear(&engine->pressing);
    frame_ode_clear(&engine->ode);
    frame_arc_clear(&engine->arc);
    frame_clear(&engine->frame);
}
