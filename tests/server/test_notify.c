/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the service manager hears, at both kinds of address; and that nobody listening does no harm.
 */
#include "notify.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* A manager that listens where `name` says. */
static int listen_at(const char *name)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    assert_true(fd >= 0);
    memcpy(address.sun_path, name, strlen(name));
    if (name[0] == '@')
        address.sun_path[0] = '\0';
    assert_int_equal(bind(fd, (const struct sockaddr *)&address,
                          (socklen_t)(offsetof(struct sockaddr_un, sun_path) + strlen(name))),
                     0);
    setenv("NOTIFY_SOCKET", name, 1);
    return fd;
}

static void assert_heard(int fd, const char *expected)
{
    char said[64] = "";
    ssize_t size = recv(fd, said, sizeof(said) - 1, MSG_DONTWAIT);
    assert_int_equal(size, (ssize_t)strlen(expected));
    assert_string_equal(said, expected);
}

static void hears_at_a_path(void **state)
{
    char directory[] = "/tmp/notifyXXXXXX", name[64];
    (void)state;
    assert_non_null(mkdtemp(directory));
    snprintf(name, sizeof(name), "%s/socket", directory);
    int fd = listen_at(name);
    assert_true(notify_manager("READY=1"));
    assert_heard(fd, "READY=1");
    close(fd);
    assert_false(notify_manager("READY=1")); /* nobody there any more */
    unlink(name);
    assert_false(notify_manager("READY=1"));
    rmdir(directory);
}

static void hears_at_an_abstract_name(void **state)
{
    char name[64];
    (void)state;
    snprintf(name, sizeof(name), "@bcdd-test-notify-%d", (int)getpid());
    int fd = listen_at(name);
    assert_true(notify_manager("STOPPING=1"));
    assert_heard(fd, "STOPPING=1");
    close(fd);
}

static void no_manager_no_harm(void **state)
{
    char longer[sizeof(((struct sockaddr_un *)NULL)->sun_path) + 2];
    const char *const names[] = {"", "@", "/", "relative", "vsock:2:1"};
    (void)state;
    unsetenv("NOTIFY_SOCKET");
    assert_false(notify_manager("READY=1"));
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
        setenv("NOTIFY_SOCKET", names[i], 1);
        assert_false(notify_manager("READY=1"));
    }
    memset(longer, 'x', sizeof(longer) - 1);
    longer[0] = '/';
    longer[sizeof(longer) - 1] = '\0';
    setenv("NOTIFY_SOCKET", longer, 1);
    assert_false(notify_manager("READY=1"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hears_at_a_path),
        cmocka_unit_test(hears_at_an_abstract_name),
        cmocka_unit_test(no_manager_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
