/* SPDX-License-Identifier: MIT */
/* Edges and highlights over a frame whose colour is complete. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_FRAME_OVERLAY_H
#define VITRAIL_RENDERER_FRAME_FRAME_OVERLAY_H

#include "renderer/frame/frame_run.h"

MUST_CHECK bool frame_overlay(const struct frame_run *run, struct error *err);

#endif
