// SHA-256 by GnuTLS.
#ifndef SERVER_UTIL_SHA256_H
#define SERVER_UTIL_SHA256_H

#include <stddef.h>

typedef struct Sha256 Sha256;

Sha256 *sha256_new(void);                                      // NULL without memory
void sha256_add(void *digest, const void *bytes, size_t size); // fits canonical_write's callback
// Ends and frees; 64 lower-case hexadecimal digits and a NUL.
void sha256_end(Sha256 *digest, char target[65]);

enum { DIGEST_BYTES = 32 };
// The digest of all of `bytes` at once, as it is.
void sha256_sum(const void *bytes, size_t size, unsigned char target[DIGEST_BYTES]);
// The same as 64 digits and a NUL.
void sha256_hex(const unsigned char sum[DIGEST_BYTES], char target[65]);

#endif
