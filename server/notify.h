/* SPDX-License-Identifier: GPL-3.0-or-later
 * notify.h - tells the service manager how far the daemon is; sd_notify(3) says what may be told.
 */
#ifndef NOTIFY_H
#define NOTIFY_H

#include <stdbool.h>

/* One datagram to the socket that $NOTIFY_SOCKET names: a path, or with "@" an abstract name. False
 * when there is none, or nobody takes it: that is no reason not to serve. */
bool notify_manager(const char *state);

#endif
