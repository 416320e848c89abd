// SPDX-License-Identifier: MIT
// Light of an environment map (renderer/environment/environment.h) by means over lobes that were
// made once: the split sum of Karis 2013, "Real Shading in Unreal Engine 4". Directions are in view
// space. Needs: u_world_y; HAS_ENVIRONMENT_BACKGROUND where the map is seen.
layout(binding = UNIT_ENVIRONMENT_DIFFUSE) uniform sampler2D u_environment_diffuse;
layout(binding = UNIT_ENVIRONMENT_SPECULAR) uniform sampler2D u_environment_specular;
uniform vec3 u_world_x, u_world_z;
uniform vec3 u_environment; // cosine and sine of its rotation about +Y; factor

vec2 environment_at(vec3 direction)
{
    vec3 w = vec3(dot(u_world_x, direction), dot(u_world_y, direction), dot(u_world_z, direction));
    vec2 t = u_environment.xy;
    float x = t.x * w.x - t.y * w.z, z = t.y * w.x + t.x * w.z;
    float u = abs(x) + abs(z) > 0.0 ? atan(x, -z) / (2.0 * PI) : 0.0;
    return vec2(0.5 + u, acos(clamp(w.y, -1.0, 1.0)) / PI);
}

// Irradiance over pi.
vec3 environment_irradiance(vec3 normal)
{
    return textureLod(u_environment_diffuse, environment_at(normal), 0.0).rgb * u_environment.z;
}

// What a lobe of that roughness mirrors. A rough one leans from the mirror direction to the normal:
// Lagarde and de Rousiers 2014, "Moving Frostbite to Physically Based Rendering", section 4.9.3.
vec3 environment_mirrored(vec3 normal, vec3 view, float roughness)
{
    float level = roughness * float(textureQueryLevels(u_environment_specular) - 1);
    float alpha = roughness * roughness, smoothness = 1.0 - alpha;
    float lean = smoothness * (sqrt(smoothness) + alpha);
    vec2 at = environment_at(normalize(mix(normal, reflect(-view, normal), lean)));
    return textureLod(u_environment_specular, at, level).rgb * u_environment.z;
}

#ifdef HAS_ENVIRONMENT_BACKGROUND
layout(binding = UNIT_ENVIRONMENT_RADIANCE) uniform sampler2D u_environment_radiance;

vec3 environment_radiance(vec3 direction)
{
    return textureLod(u_environment_radiance, environment_at(direction), 0.0).rgb *
           u_environment.z;
}
#endif
