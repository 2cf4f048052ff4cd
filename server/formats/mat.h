// MATLAB's MAT-file, level 5, without compression: one column vector of doubles per column under
// its name, and the axis. Read by MATLAB, Octave and scipy.io.loadmat. Used by encoders.c.
#ifndef SERVER_FORMATS_MAT_H
#define SERVER_FORMATS_MAT_H

#include "server/formats/format.h"

enum { MAT_NAME_SIZE = 64 }; // 63 characters, MATLAB's longest, and a NUL

// A name that MATLAB takes for a variable's: letters, digits and underscores, a letter first.
void mat_name(const char *name, char target[MAT_NAME_SIZE]);

extern const TableFormat encoder_mat;

#endif
