// SPDX-License-Identifier: MIT
// Lights and cameras: each becomes a node below the one that has its name.
#include "renderer/import/assimp/conversion.h"
#include "renderer/import/assimp/moving.h"

#include <algorithm>
#include <cmath>

#include <assimp/scene.h>

namespace vitrail
{

namespace
{

constexpr double PI = 3.14159265358979323846;
constexpr float FIELD_DEFAULT = 0.7853982f; // 45 degrees, where the file has none that can be

// Node of glTF that looks along its -Z: at a place, along a direction.
std::string looking(const aiVector3D &at, aiVector3D direction, const aiVector3D &up)
{
    direction.NormalizeSafe();
    if (direction.SquareLength() < 0.5f)
        direction = aiVector3D(0, 0, -1);
    aiVector3D back = -direction, right = up ^ back;
    if (right.SquareLength() < 1e-8f) // up says nothing: any that is not along it
        right = (std::fabs(back.y) < 0.9f ? aiVector3D(0, 1, 0) : aiVector3D(1, 0, 0)) ^ back;
    right.Normalize();
    aiVector3D own_up = back ^ right;
    const float matrix[16] = {right.x, right.y, right.z, 0, own_up.x, own_up.y, own_up.z, 0,
                              back.x,  back.y,  back.z,  0, at.x,     at.y,     at.z,     1};
    return "\"matrix\":" + json_numbers(matrix, 16);
}

} // namespace

// A brightness of 1 lights a white surface that faces it to a luminance of 1: pi lx, or pi cd at a
// metre. Quadratic falloff is in units of the file.
std::string write_light(conversion_state &state, const aiLight &light, double unit_m,
                        std::string *placing)
{
    const char *type = light.mType == aiLightSource_DIRECTIONAL ? "directional"
                       : light.mType == aiLightSource_POINT     ? "point"
                       : light.mType == aiLightSource_SPOT      ? "spot"
                                                                : nullptr;
    float channels[3] = {light.mColorDiffuse.r, light.mColorDiffuse.g, light.mColorDiffuse.b};
    float most = std::max({channels[0], channels[1], channels[2]});
    double intensity = PI * double(most), falloff = double(light.mAttenuationQuadratic);
    bool is_sane = std::isfinite(most) && std::min({channels[0], channels[1], channels[2]}) >= 0 &&
                   is_finite(light.mPosition) && is_finite(light.mDirection);
    if (!type || !is_sane || most <= 0) {
        state.warn(text("light '%.80s' is left out: %s", light.mName.C_Str(),
                        !type     ? "it is neither point, spot nor directional"
                        : is_sane ? "it is black"
                                  : "its numbers are out of range"));
        return "";
    }
    if (light.mType != aiLightSource_DIRECTIONAL && falloff > 0 && std::isfinite(falloff))
        intensity *= unit_m * unit_m / falloff;
    else if (light.mType != aiLightSource_DIRECTIONAL)
        state.warn(text("light '%.80s' falls off by the square of the distance, unlike in the file",
                        light.mName.C_Str()));
    for (float &channel : channels)
        channel /= most;
    std::string out = "{\"name\":" + json_string(light.mName.C_Str()) +
                      text(",\"type\":\"%s\",\"intensity\":%.9g", type, intensity) +
                      ",\"color\":" + json_numbers(channels, 3);
    if (light.mType == aiLightSource_SPOT) {
        double outer = std::min(std::max(double(light.mAngleOuterCone) / 2, 0.001), PI / 2);
        double inner = std::min(std::max(double(light.mAngleInnerCone) / 2, 0.0), outer * 0.999);
        out += text(",\"spot\":{\"innerConeAngle\":%.9g,\"outerConeAngle\":%.9g}", inner, outer);
    }
    *placing = looking(light.mPosition, light.mDirection, light.mUp);
    return out + "}";
}

std::string write_camera(conversion_state &state, const aiCamera &camera, double unit_m,
                         std::string *placing)
{
    double across = double(camera.mHorizontalFOV);
    double aspect =
        camera.mAspect > 0 && std::isfinite(camera.mAspect) ? double(camera.mAspect) : 1;
    // What assimp 5.2 makes of every camera of COLLADA: its own default, turned from degrees once
    // too often.
    bool is_unread = std::fabs(across - PI / 4 * PI / 180) < 1e-6;
    if (is_unread) {
        state.warn(text("camera '%.80s': assimp does not tell its field of view; 45 degrees are "
                        "assumed",
                        camera.mName.C_Str()));
        across = double(FIELD_DEFAULT);
    }
    if (!(across > 0.001 && across < PI - 0.001)) {
        state.warn(text("camera '%.80s': a field of view of %g degrees becomes 45",
                        camera.mName.C_Str(), across * 180 / PI));
        across = double(FIELD_DEFAULT);
    }
    double near = double(camera.mClipPlaneNear) * unit_m,
           far = double(camera.mClipPlaneFar) * unit_m;
    if (!(near > 0) || !std::isfinite(near))
        near = 0.01;
    std::string out =
        "{\"name\":" + json_string(camera.mName.C_Str()) +
        ",\"type\":\"perspective\",\"perspective\":{" +
        text("\"yfov\":%.9g,\"znear\":%.9g", 2 * std::atan(std::tan(across / 2) / aspect), near);
    if (camera.mAspect > 0 && std::isfinite(camera.mAspect))
        out += text(",\"aspectRatio\":%.9g", aspect);
    if (far > near && std::isfinite(far))
        out += text(",\"zfar\":%.9g", far);
    if (!is_finite(camera.mPosition) || !is_finite(camera.mLookAt) || !is_finite(camera.mUp))
        refuse("camera '%.80s': its place is not finite", camera.mName.C_Str());
    *placing = looking(camera.mPosition, camera.mLookAt, camera.mUp);
    return out + "}}";
}

} // namespace vitrail
