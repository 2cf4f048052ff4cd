// The slopes of a sensitivity study as CSV, a row for each parameter and statistic. Not the drawn
// runs: those are the JSON's. Used by answer.c.
#ifndef SERVER_FORMATS_SENSITIVITY_CSV_H
#define SERVER_FORMATS_SENSITIVITY_CSV_H

#include "core/study/sensitivity.h"
#include "server/util/bytes.h"

// Appends the whole document. First the closed forms of k_b and c_b, stop by stop: their statistic
// is "stiffness 1 left", a damper's number and side.
void sensitivity_csv(const Sensitivity *sensitivity, Bytes *bytes);

#endif
