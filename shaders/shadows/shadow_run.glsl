// SPDX-License-Identifier: MIT
// Where the list of a texel lies, and what is looked for in it.
layout(binding = UNIT_SHADOW_HEADS) uniform usamplerBuffer u_shadow_heads;

struct shadow_run {
    int begin, end; // events or nodes in the pools; linked: begin is the first element
};

struct shadow_look {
    uint flags;         // SHADOW_FLAG_* of the light's structure
    uint event_base;    // of the light's structure
    float depth, reach; // what is nearer shadows; of the receiver itself
    vec3 sigma;         // extinction where the light stands
    float keys_per_m;   // shadow_key.glsl
    uint object;        // node whose own events are left out, else NO_OBJECT
};
