// What systemd is told of a service of Type=notify: ready, stopping, still alive. Without systemd
// (no NOTIFY_SOCKET) all of it does nothing. Used by cli/serve.c.
#ifndef SERVER_UTIL_SYSTEMD_H
#define SERVER_UTIL_SYSTEMD_H

#include <stdint.h>

// Sends "READY=1", "STOPPING=1", "WATCHDOG=1" and the like; a datagram that is not taken is lost.
void systemd_notify(const char *state);
// How often "WATCHDOG=1" is to be sent: half of WATCHDOG_USEC. 0: not asked for.
int64_t systemd_watchdog_ms(void);

#endif
