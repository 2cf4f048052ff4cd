// The TLS certificate and its key: checked before they are used, so that a fault is reported in
// words, and replaced while connections come and go.
#ifndef SERVER_HTTP_TLS_H
#define SERVER_HTTP_TLS_H

#include <stdbool.h>

#include "core/base/status.h"

// Answers handshakes with this one from now on; both as PEM text. STATUS_USAGE for what cannot be
// read, for a key that is not the certificate's, and for a certificate whose time is over:
// `cert_path` and `key_path` are named in the fault, and what was used before stays.
Status tls_use(const char *cert, const char *cert_path, const char *key, const char *key_path,
               Problem *problem);

// A gnutls_certificate_retrieve_function2 that hands out the one in use; NULL while there is none.
typedef void CertificateSource(void);
CertificateSource *tls_source(void);

// Whether a session (gnutls_session_t) has decrypted bytes that were not read yet.
bool tls_has_pending(void *session);

// When no connection is left.
void tls_forget(void);

#endif
