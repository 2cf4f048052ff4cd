#include "server/http/shield.h"

#include <stddef.h>

const ShieldHeader shield_headers[] = {
    {"X-Content-Type-Options", "nosniff"},
    {"Content-Security-Policy",
     "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {NULL, NULL},
};

const ShieldHeader shield_tls = {"Strict-Transport-Security", "max-age=31536000"};
