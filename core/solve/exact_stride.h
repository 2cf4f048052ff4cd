// The exact solver's long strides: many samples of free flight at once, stops, and contacts by
// their closed form. Not for whatever is out of the ordinary: where it does nothing, exact.c goes
// on interval by interval. Used by exact.c; exact_stride_pass by exact_press.c too.
#ifndef CORE_SOLVE_EXACT_STRIDE_H
#define CORE_SOLVE_EXACT_STRIDE_H

#include "core/solve/exact_state.h"

// STATUS_CANCELLED where the progress says so.
Status exact_stride_start(Exact *exact);

// From the present sample over as many as go by strides, at most `most`; returns how many.
size_t exact_stride(Exact *exact, size_t most);

// The present contact, from here on, as far as it goes by its closed form; returns how many samples
// it has passed, at most `most`.
size_t exact_stride_press(Exact *exact, size_t most);

// Records the sample at the end of the present interval; what waits is entered where statistics
// begin.
void exact_stride_pass(Exact *exact);

// Enters what strides have summed up into ledger and recorder. Before anything else writes there.
void exact_stride_enter(Exact *exact);

#endif
