/* SPDX-License-Identifier: BSD-3-Clause */
/* Messages to a service manager: one datagram each to the socket named by $NOTIFY_SOCKET. */
#ifndef SHCDD_NOTIFY_H
#define SHCDD_NOTIFY_H

/** Sends e.g. "READY=1"; does nothing without a manager. */
void notify(const char *text);

#endif
