// One curve from ln scene luminance to ln display luminance; twin of tonemap/curve.py
#include "colour.glsl"

// n x 1, log2 in units of white - black: display luminance where a step begins, and its rise
uniform sampler2D curve_steps;
uniform vec2 curve_place;  // factor and summand that make a step's number of log2 cd/m2
uniform vec2 curve_to;     // log2 of white, and black, in those units
uniform float curve_last;  // number of the last step

// Display-relative value in [0, 1] for a scene luminance in cd/m2.
float curve_value(float y)
{
    float place = log2(max(y, 1e-30)) * curve_place.x + curve_place.y;
    int at = int(clamp(place, 0.0, curve_last));
    vec2 from = texelFetch(curve_steps, ivec2(at, 0), 0).xy;
    float shown = min(from.x + (place - float(at)) * from.y, curve_to.x);
    return clamp(exp2(shown) - curve_to.y, 0.0, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 curve(vec3 rgb)
{
    float value = curve_value(luminance(rgb));
    return to_gamut(with_luminance(rgb, value), value);
}
