// SPDX-License-Identifier: MIT
// The lists of a deep shadow map as capture and sort write them, a stream for each kind of number.
//   IDS    the object of each event
//   MEDIA  the medium of each event (shadow_deep.frag.glsl), once sorted what it adds up to
#include "shared/bindings.h"

layout(std430, binding = BIND_SHADOW_EVENTS) writeonly buffer event_buffer { vec4 events[]; };
#ifdef IDS
layout(std430, binding = BIND_SHADOW_EVENTS_ID) writeonly buffer id_buffer { uint events_id[]; };
#endif
#ifdef MEDIA
layout(std430, binding = BIND_SHADOW_MEDIA) writeonly buffer media_buffer {
    uvec4 events_medium[];
};
#endif
