// SHA-256; GnuTLS's hashing lives here alone.
#ifndef SERVER_BASE_DIGEST_H
#define SERVER_BASE_DIGEST_H

#include <stdbool.h>
#include <stddef.h>

enum { DIGEST_SIZE = 65 }; // 64 lower-case hexadecimal digits and a NUL

typedef struct Digest Digest;

Digest *digest_new(void);                                       // NULL without memory
void digest_take(void *digest, const void *bytes, size_t size); // fits canonical_write's callback
void digest_end(Digest *digest, char target[DIGEST_SIZE]);      // ends and frees
// Of one piece, quickly. False where it cannot be made.
bool digest_of(const void *bytes, size_t size, char target[DIGEST_SIZE]);

#endif
