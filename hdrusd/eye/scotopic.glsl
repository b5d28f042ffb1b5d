// What the rods see, and what colour is left at night; sources and units: scotopic.py
#include "colour.glsl"

uniform float night_ramp, night_tint;  // shares in [0, 1] of ward_scotopic and jensen_night

const vec3 SCOTOPIC_WEIGHTS = vec3(0.0602851, 1.0859576, 1.0491639);
const float WHITE_RATIO = 2.1954066;
const float ROD_LIMIT = 5.62e-3, CONE_LIMIT = 5.62;
const vec3 NIGHT_BLUE = vec3(0.70616031, 0.98986039, 1.96568095);
const float NIGHT_SUM = 4.0;
const vec3 RGB_SUM = vec3(0.6443, 1.1920, 1.2032);  // X + Y + Z of each channel

float scotopic(vec3 rgb)
{
    return dot(rgb, SCOTOPIC_WEIGHTS);
}

float white_relative(float scotopic_luminance)
{
    return scotopic_luminance / WHITE_RATIO;
}

vec3 ward_scotopic(vec3 rgb, float s_n)
{
    float k = clamp((luminance(rgb) - ROD_LIMIT) / (CONE_LIMIT - ROD_LIMIT), 0.0, 1.0);
    return k * rgb + (1.0 - k) * s_n;
}

vec3 jensen_night(vec3 rgb, float s_n)
{
    float y = luminance(rgb);
    float t = clamp((0.30103 * log2(max(y, 1e-9)) + 2.0) / 2.6, 0.0, 1.0);
    float s = t * t * (3.0 - 2.0 * t);
    float total = max(dot(rgb, RGB_SUM), 1e-9);
    float blue = (1.0 - s) * total / NIGHT_SUM;
    float gain = ((1.0 - s) * s_n + s * y) / (s * y + blue);
    return (s * rgb + blue * NIGHT_BLUE) * gain;
}

vec3 night_colour(vec3 rgb, float s_n)
{
    vec3 grey = mix(rgb, ward_scotopic(rgb, s_n), night_ramp);
    return mix(grey, jensen_night(rgb, s_n), night_tint);
}
