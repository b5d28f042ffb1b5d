// Khronos PBR Neutral Tone Mapper, 2024; twin of tonemap/pbr_neutral.py
#include "tonemap/exposure.glsl"

// Exposed RGB >= 0 to display-linear [0, 1].
vec3 neutral(vec3 rgb)
{
    const float F0 = 0.04, START = 0.76, DESATURATION = 0.15;
    float least = min(rgb.r, min(rgb.g, rgb.b));
    vec3 colour = rgb - (least <= 2.0 * F0 ? least - least * least / (4.0 * F0) : F0);
    float peak = max(colour.r, max(colour.g, colour.b));
    float high = max(peak, START);
    float shown = 1.0 - (1.0 - START) * (1.0 - START) / (high + 1.0 - 2.0 * START);
    float keep = 1.0 / (DESATURATION * (high - shown) + 1.0);
    vec3 compressed = colour * (shown / high * keep) + shown * (1.0 - keep);
    return min(peak > START ? compressed : colour, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 pbr_neutral(vec3 rgb)
{
    return neutral(exposed(rgb));
}
