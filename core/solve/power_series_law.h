// Which root makes a power law's contact smooth, and what powers of it N is made of. Not the series
// themselves (frame_series.h). Used by frame_series.c and frame_ode*.c.
#ifndef CORE_SOLVE_POWER_SERIES_LAW_H
#define CORE_SOLVE_POWER_SERIES_LAW_H

#include <stdbool.h>

#include "core/contact/contact.h"

enum { SERIES_POWERS = 20 };

// How N follows from Y = p^(1/root), where all of its exponents times root are whole numbers, and
// else only as far as Y > 0.
typedef struct SeriesLaw {
    double exponents[2]; // of p: N's own, and that of what damps it
    int root;
    bool is_whole;
    // Powers of Y: each is a product of two before; 0 is 1 and 1 is Y itself.
    int count, power[SERIES_POWERS], left[SERIES_POWERS], right[SERIES_POWERS];
    int pace, spring, viscous; // which of them are Y^(root - 1), and N's two
} SeriesLaw;
void series_law_make(SeriesLaw *law, const ContactTerms *terms);

#endif
