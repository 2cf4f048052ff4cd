// SHA-256; GnuTLS's hashing lives here alone.
#ifndef SERVER_UTIL_SHA256_H
#define SERVER_UTIL_SHA256_H

#include <stddef.h>

typedef struct Digest Digest;

Digest *digest_new(void);                                       // NULL without memory
void digest_take(void *digest, const void *bytes, size_t size); // fits canonical_write's callback
// Ends and frees; 64 lower-case hexadecimal digits and a NUL.
void digest_end(Digest *digest, char target[65]);

enum { DIGEST_BYTES = 32 };
// The digest of all of `bytes` at once, as it is.
void digest_sum(const void *bytes, size_t size, unsigned char target[DIGEST_BYTES]);
// The same as 64 digits and a NUL.
void digest_spell(const unsigned char sum[DIGEST_BYTES], char target[65]);

#endif
