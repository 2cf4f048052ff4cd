// systemd's side of the socket: what arrives, and that nothing happens without it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "server/util/process.h"
#include "tests/support/test.h"

static int listen_at(const char *path) {
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    const size_t size = strlen(path);
    memcpy(name.sun_path, path, size);
    if (path[0] == '@')
        name.sun_path[0] = '\0';
    const int door = socket(AF_UNIX, SOCK_DGRAM, 0);
    assert_true(door >= 0);
    assert_int_equal(bind(door, (const struct sockaddr *)&name,
                          (socklen_t)(offsetof(struct sockaddr_un, sun_path) + size)),
                     0);
    return door;
}

static void expect_told(const char *path) {
    char text[32] = "";
    const int door = listen_at(path);
    setenv("NOTIFY_SOCKET", path, 1);
    process_notify_systemd("READY=1");
    assert_int_equal(recv(door, text, sizeof text - 1, MSG_DONTWAIT), 7);
    assert_string_equal(text, "READY=1");
    close(door);
    unsetenv("NOTIFY_SOCKET");
}

TEST(states_arrive_at_both_kinds_of_socket) {
    char path[64];
    snprintf(path, sizeof path, "/tmp/impactd-notify-%ld", (long)getpid());
    expect_told(path);
    unlink(path);
    snprintf(path, sizeof path, "@impactd-notify-%ld", (long)getpid());
    expect_told(path);
}

TEST(without_a_socket_nothing_happens) {
    unsetenv("NOTIFY_SOCKET");
    process_notify_systemd("READY=1");
    setenv("NOTIFY_SOCKET", "vsock:1", 1);
    process_notify_systemd("READY=1");
    setenv("NOTIFY_SOCKET", "/nowhere/at/all", 1);
    process_notify_systemd("READY=1");
    unsetenv("NOTIFY_SOCKET");
}

TEST(the_watchdog_is_fed_twice_a_period) {
    char own[32];
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    assert_int_equal(process_watchdog_ms(), 0);
    setenv("WATCHDOG_USEC", "30000000", 1);
    assert_int_equal(process_watchdog_ms(), 15000);
    setenv("WATCHDOG_PID", "1", 1);
    assert_int_equal(process_watchdog_ms(), 0);
    snprintf(own, sizeof own, "%ld", (long)getpid());
    setenv("WATCHDOG_PID", own, 1);
    assert_int_equal(process_watchdog_ms(), 15000);
    setenv("WATCHDOG_USEC", "x", 1);
    assert_int_equal(process_watchdog_ms(), 0);
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
}
