// The shortest digits that read back to the same double, by dragonbox. C interface of its C++.
#ifndef SERVER_UTIL_DTOA_H
#define SERVER_UTIL_DTOA_H

#include <stddef.h>

enum { SHORTEST_SIZE = 32 };

#ifdef __cplusplus
extern "C" {
#endif

// Writes a finite double as valid JSON ("0.015", "1e-9", "10001", "-0.5", "-0.0"; plain digits
// where the first one's power of ten is within -5..16, else d.ddde±x) without a NUL; returns the
// length. `target` has room for SHORTEST_SIZE bytes, all of which may be written to.
size_t dtoa_write(char *target, double value);

// Many of them with commas between, "null" where one is not finite; returns the length. `target`
// has room for SHORTEST_SIZE + 1 bytes for each.
size_t dtoa_list(char *target, const double *values, size_t count);

#ifdef __cplusplus
}
#endif

#endif
