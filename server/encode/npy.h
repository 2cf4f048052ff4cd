// NumPy's array file, version 1.0: float64 of shape (rows, 1 + columns), the axis first. Used by
// encoders.c. Not self-describing: names and units stand in the result's document.
#ifndef SERVER_ENCODE_NPY_H
#define SERVER_ENCODE_NPY_H

#include "server/encode/encoder.h"

extern const Encoder encoder_npy;

#endif
