// A GnuTLS handle under our name. The hash is made when the digest is and freed when it ends.
#include "server/base/digest.h"

#include <stdlib.h>

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

enum { SHA256_BYTES = 32 };

struct Digest {
    gnutls_hash_hd_t hash;
};

Digest *digest_new(void) {
    Digest *digest = malloc(sizeof *digest);
    if (digest == NULL)
        return NULL;
    if (gnutls_hash_init(&digest->hash, GNUTLS_DIG_SHA256) < 0) {
        free(digest);
        return NULL;
    }
    return digest;
}

void digest_take(void *digest, const void *bytes, size_t size) {
    // SHA-256 in software fails on no input.
    (void)gnutls_hash(((Digest *)digest)->hash, bytes, size);
}

void digest_end(Digest *digest, char target[65]) {
    static const char hexadecimal[] = "0123456789abcdef";
    unsigned char sum[SHA256_BYTES];
    gnutls_hash_deinit(digest->hash, sum);
    free(digest);
    for (size_t i = 0; i < SHA256_BYTES; i++) {
        target[2 * i] = hexadecimal[sum[i] >> 4];
        target[2 * i + 1] = hexadecimal[sum[i] & 15];
    }
    target[2 * SHA256_BYTES] = '\0';
}
