// Every change begins at the scene's own numbers, so that no change leaves a trace in the next.
#include "core/study/parameter_perturbation.h"

#include "core/base/philox.h"
#include "core/study/input_uncertainty.h"

enum { DRAWS = 64, STREAM = 0x53454e53 };

const char *const sensitivity_parameter_names[] = {
    "restitution", "contact_time", "stiffness", "damping", "mass", "clearance", NULL};

enum { BUFFERS = 3, NUMBERS = 4 };
static const size_t buffers[BUFFERS] = {offsetof(Damper, buffer), offsetof(Damper, left_buffer),
                                        offsetof(Damper, right_buffer)};
static const size_t numbers[NUMBERS] = {
    [SENSITIVITY_RESTITUTION] = offsetof(Buffer, restitution),
    [SENSITIVITY_CONTACT_TIME] = offsetof(Buffer, contact_time),
    [SENSITIVITY_STIFFNESS] = offsetof(Buffer, stiffness),
    [SENSITIVITY_DAMPING] = offsetof(Buffer, damping),
};

static const Buffer *buffer_of(const Damper *damper, size_t index) {
    return (const Buffer *)(const void *)((const char *)damper + buffers[index]);
}

static Buffer *own_buffer(Damper *damper, size_t index) {
    return (Buffer *)(void *)((char *)damper + buffers[index]);
}

static double number_of(const Buffer *buffer, int parameter) {
    return *(const double *)(const void *)((const char *)buffer + numbers[parameter]);
}

static double row_number(const ContactRow *row, int parameter) {
    return parameter == SENSITIVITY_RESTITUTION    ? row->restitution
           : parameter == SENSITIVITY_CONTACT_TIME ? row->contact_time
                                                   : (double)NAN;
}

// The largest of what a buffer has of a parameter; NAN: nothing.
static double largest_of(const Buffer *buffer, int parameter) {
    double largest = number_of(buffer, parameter);
    for (size_t i = 0; i < buffer->table.count; i++)
        largest = fmax(largest, row_number(&buffer->table.at[i], parameter));
    return largest;
}

static bool is_of_buffer(int parameter) {
    return parameter < SENSITIVITY_MASS;
}

// The largest of what the scene has of a parameter; NAN: nothing.
static double largest(const Simulation *simulation, int parameter) {
    const Dampers *dampers = &simulation->scene.dampers;
    double most = (double)NAN;
    for (size_t i = 0; i < dampers->count; i++) {
        if (parameter == SENSITIVITY_MASS)
            most = fmax(most, dampers->at[i].mass);
        else if (parameter == SENSITIVITY_CLEARANCE)
            most = fmax(most, dampers->at[i].clearance);
        for (size_t k = 0; k < BUFFERS && is_of_buffer(parameter); k++)
            most = fmax(most, largest_of(buffer_of(&dampers->at[i], k), parameter));
    }
    return most;
}

const char *change_refuse(const Simulation *simulation, int parameter) {
    const Contact *contact = scene_contact(&simulation->scene);
    const ContactLaw *law = dampers_contact_law(&simulation->scene.dampers, contact);
    const double most = largest(simulation, parameter);
    if (isnan(most))
        return "no buffer of the scene has it, or the contact model does not use it";
    if (!(most > 0))
        return "it is 0: a relative change is none";
    // A law that gives all energy back has e = 1 and no other.
    if (parameter == SENSITIVITY_RESTITUTION && law->form == CONTACT_POWER && law->factor == NULL)
        return "the contact model gives all energy back";
    if (parameter == SENSITIVITY_CLEARANCE)
        for (size_t i = 0; i < simulation->scene.dampers.count; i++)
            if (fabs(simulation->scene.dampers.at[i].position) * 2 * (1 + 1e-9) >=
                simulation->scene.dampers.at[i].clearance)
                return "a free mass starts at a stop, which a smaller one would move past it";
    return NULL;
}

double change_max(const Simulation *simulation, int parameter, double step) {
    return parameter == SENSITIVITY_RESTITUTION
               ? fmax(0, fmin(step, 1 / largest(simulation, parameter) - 1))
               : step;
}

static void scale_buffer(const Buffer *from, int parameter, double factor, Buffer *to) {
    const double number = number_of(from, parameter) * factor;
    const bool is_beyond = parameter == SENSITIVITY_RESTITUTION && number > 1;
    *(double *)(void *)((char *)to + numbers[parameter]) = is_beyond ? 1 : number;
    for (size_t i = 0; i < from->table.count; i++) {
        if (parameter == SENSITIVITY_RESTITUTION)
            to->table.at[i].restitution = fmin(1, from->table.at[i].restitution * factor);
        else if (parameter == SENSITIVITY_CONTACT_TIME)
            to->table.at[i].contact_time = from->table.at[i].contact_time * factor;
    }
}

void change_apply(const Simulation *simulation, int parameter, double factor, Simulation *member) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0; i < dampers->count; i++) {
        const Damper *from = &dampers->at[i];
        Damper *to = &member->scene.dampers.at[i];
        if (parameter == SENSITIVITY_MASS)
            to->mass = from->mass * factor;
        else if (parameter == SENSITIVITY_CLEARANCE)
            to->clearance = from->clearance * factor;
        for (size_t k = 0; k < BUFFERS && is_of_buffer(parameter); k++)
            scale_buffer(buffer_of(from, k), parameter, factor, own_buffer(to, k));
    }
}

size_t change_buffers(const Simulation *simulation) {
    size_t count = 0;
    for (size_t i = 0; i < simulation->scene.dampers.count; i++)
        for (size_t k = 0; k < BUFFERS; k++)
            count += buffer_is_given(buffer_of(&simulation->scene.dampers.at[i], k));
    return count;
}

// Of mean 1 and relative deviation s.
static double factor_of(double normal, double s) {
    const double variance = log1p(s * s);
    return exp(sqrt(variance) * normal - variance / 2);
}

// Of one buffer: e and T_c.
typedef struct Spread {
    double restitution, contact_time;
} Spread;

static void draw(uint64_t seed, const Spread *spread, const Buffer *from, uint64_t run,
                 size_t buffer, double *restitution, double *contact_time) {
    const double most = largest_of(from, SENSITIVITY_RESTITUTION);
    for (uint64_t again = 0; again < DRAWS; again++) {
        double normal[2];
        noise_normal_pair(seed, STREAM + buffer, DRAWS * run + again, normal);
        *restitution = factor_of(normal[0], spread->restitution);
        if (again == 0)
            *contact_time = factor_of(normal[1], spread->contact_time);
        if (!(most * *restitution > 1))
            return;
    }
    *restitution = 1 / most; // hardly ever: e is 1 then
}

void change_draw(const SensitivityStudy *study, const Simulation *simulation, uint64_t run,
                 Simulation *member, double *restitution, double *contact_time) {
    const Dampers *dampers = &simulation->scene.dampers;
    for (size_t i = 0, buffer = 0; i < dampers->count; i++)
        for (size_t k = 0; k < BUFFERS; k++) {
            const Buffer *from = buffer_of(&dampers->at[i], k);
            Buffer *to = own_buffer(&member->scene.dampers.at[i], k);
            if (!buffer_is_given(from))
                continue;
            const Spread spread = {
                spread_of(study, i, (SensitivityBuffer)k, SENSITIVITY_RESTITUTION),
                spread_of(study, i, (SensitivityBuffer)k, SENSITIVITY_CONTACT_TIME)};
            draw(study->seed, &spread, from, run, buffer, &restitution[buffer],
                 &contact_time[buffer]);
            if (spread.restitution > 0)
                scale_buffer(from, SENSITIVITY_RESTITUTION, restitution[buffer], to);
            if (spread.contact_time > 0)
                scale_buffer(from, SENSITIVITY_CONTACT_TIME, contact_time[buffer], to);
            buffer++;
        }
}
