// gzip of whole texts, and the CRC-32 of archives.
#ifndef SERVER_UTIL_GZIP_H
#define SERVER_UTIL_GZIP_H

#include <stdint.h>

#include "server/util/bytes.h"

// Appends `size` bytes as one gzip member, the same bytes every time. False without memory.
bool gzip_compress(Bytes *bytes, const void *data, size_t size);

// CRC-32 as of zlib and ZIP; `crc` is 0 at first, then the result of the call before.
uint32_t gzip_crc32(uint32_t crc, const void *data, size_t size);

#endif
