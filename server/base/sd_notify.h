/* SPDX-License-Identifier: MIT */
/* Tells systemd how the service is, if it listens. Thread: any. */
#ifndef VITRAIL_SERVER_BASE_SD_NOTIFY_H
#define VITRAIL_SERVER_BASE_SD_NOTIFY_H

/* state: "READY=1", "STOPPING=1"; no-op without NOTIFY_SOCKET (systemd.exec(5), sd_notify(3)). */
void sd_notify_state(const char *state);

#endif
