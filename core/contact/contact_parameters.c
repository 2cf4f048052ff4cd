// Under a power law the duration of an isolated contact is (m_e v0^(1-n) / k)^(1/(n+1)) h, where h
// is the duration in its units. Hence k = m_e (h / T_c)^(n+1) v0^(1-n) gives the duration T_c.
#include "core/contact/contact_parameters.h"

#include <math.h>

#include "core/contact/identification.h"

// Sets all parameters except the stiffness and speed of a power law.
static void contact_parameters_set(ContactStop *stop, double restitution, double contact_time) {
    ContactParameters *own = &stop->parameters;
    own->restitution = restitution;
    if (stop->law->form == CONTACT_LINEAR) {
        const Identification found = identification_from_restitution(
            stop->mass, restitution, contact_time, (Separation)stop->separation);
        own->stiffness = found.stiffness;
        own->damping = found.damping;
    } else if (stop->law->form == CONTACT_POWER) {
        own->factor = stop->law->factor != NULL ? stop->law->factor(restitution) : 0;
        if (!isnan(contact_time))
            stop->duration = stop->law->duration(own->factor, own->exponent);
    }
}

ContactStop contact_stop_prepare(const ContactLaw *law, int separation, double mass,
                                 double own_mass, const ContactNumbers *numbers) {
    ContactStop stop = {.law = law,
                        .separation = separation,
                        .mass = mass,
                        .numbers = *numbers,
                        .parameters = {.restitution = numbers->restitution,
                                       .stiffness = numbers->stiffness,
                                       .damping = law->form == CONTACT_POWER ? 0 : numbers->damping,
                                       .exponent = numbers->exponent,
                                       .mass = own_mass}};
    const bool is_given = law->form == CONTACT_LINEAR && !isnan(numbers->stiffness);
    if (numbers->rows.count == 0 && !is_given)
        contact_parameters_set(&stop, numbers->restitution, numbers->contact_time);
    return stop;
}

ContactRow contact_rows_interpolate(const ContactRows *rows, double approach_speed) {
    const ContactRow *at = rows->at;
    const size_t last = rows->count - 1;
    if (!(approach_speed > at[0].approach_speed))
        return at[0];
    if (approach_speed >= at[last].approach_speed)
        return at[last];
    size_t below = 0, above = last;
    while (above - below > 1) {
        const size_t middle = below + (above - below) / 2;
        *(at[middle].approach_speed <= approach_speed ? &below : &above) = middle;
    }
    const double share = (approach_speed - at[below].approach_speed) /
                         (at[above].approach_speed - at[below].approach_speed);
    return (ContactRow){
        approach_speed,
        at[below].restitution + share * (at[above].restitution - at[below].restitution),
        at[below].contact_time + share * (at[above].contact_time - at[below].contact_time)};
}

ContactParameters contact_parameters_at(const ContactStop *stop, double approach_speed) {
    double contact_time = stop->numbers.contact_time, duration = stop->duration;
    ContactParameters frozen = stop->parameters;
    if (stop->numbers.rows.count > 0) {
        const ContactRow row = contact_rows_interpolate(&stop->numbers.rows, approach_speed);
        ContactStop own = *stop;
        contact_parameters_set(&own, row.restitution, row.contact_time);
        frozen = own.parameters;
        duration = own.duration;
        contact_time = row.contact_time;
    }
    if (stop->law->form != CONTACT_POWER)
        return frozen;
    frozen.speed = fmax(approach_speed, CONTACT_SPEED_MIN);
    if (!isnan(contact_time))
        frozen.stiffness = stop->mass * pow(duration / contact_time, frozen.exponent + 1) *
                           pow(frozen.speed, 1 - frozen.exponent);
    return frozen;
}
