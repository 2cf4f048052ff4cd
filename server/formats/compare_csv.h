// The variants of a comparison as CSV, a row for each. Used by answer.c.
#ifndef SERVER_FORMATS_COMPARE_CSV_H
#define SERVER_FORMATS_COMPARE_CSV_H

#include "core/study/model_comparison.h"
#include "server/util/bytes.h"

// Appends the whole document: model, rule, status, k_b and c_b of the first stop, the summary's
// numbers, the contacts', the differences from the reference, the distance of the spectra, the time
// of divergence, and why it was not run.
void compare_csv(const Comparison *comparison, Bytes *bytes);

#endif
