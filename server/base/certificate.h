// A TLS certificate and its key, looked at before anything listens, so that what is wrong with them
// is said in words. Not TLS itself (http/listener.c). Used by command/serve.c.
#ifndef SERVER_BASE_CERTIFICATE_H
#define SERVER_BASE_CERTIFICATE_H

#include "core/base/status.h"

// Both as PEM text. STATUS_USAGE for what cannot be read, for a key that is not the certificate's,
// and for a certificate whose time is over; `cert_path` and `key_path` are named in the fault.
Status certificate_check(const char *cert, const char *cert_path, const char *key,
                         const char *key_path, Problem *problem);

#endif
