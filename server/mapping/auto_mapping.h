/* SPDX-License-Identifier: MIT */
/* What `shadows: auto` goes by, to be reported. Thread: any; nothing here touches GL. */
#ifndef VITRAIL_SERVER_MAPPING_AUTO_MAPPING_H
#define VITRAIL_SERVER_MAPPING_AUTO_MAPPING_H

#include "protocol/capabilities.h"
#include "renderer/cost/auto_technique.h"

/* The note is the caller's to fill in. */
void device_auto_from_settings(const struct auto_settings *settings, struct device_auto *automatic);

#endif
