// One curve from ln scene luminance to ln display luminance; twin of tonemap/curve.py
#include "colour.glsl"

// n x 1, log2 in units of white - black: display luminance where a step begins, and its rise
uniform sampler2D curve_steps;
uniform vec2 curve_place;  // factor and summand that make a step's number of log2 cd/m2
uniform vec2 curve_to;     // log2 of white, and black, in those units
uniform float curve_last;  // number of the last step

// The number of a step, and how far on in it, for cd/m2.
float curve_at(vec3 rgb)
{
    return log2(max(luminance(rgb), 1e-30)) * curve_place.x + curve_place.y;
}

// Where the step at that place begins and its rise. By coordinates: a texel fetch is checked
// against the size.
vec2 curve_step(float at)
{
    float place = (floor(clamp(at, 0.0, curve_last)) + 0.5) / (curve_last + 1.0);
    return textureLod(curve_steps, vec2(place, 0.5), 0.0).xy;
}

// Display-relative value in [0, 1] at a place in a step.
float curve_shown(float at, vec2 from)
{
    float on = at - floor(clamp(at, 0.0, curve_last));
    return clamp(exp2(min(from.x + on * from.y, curve_to.x)) - curve_to.y, 0.0, 1.0);
}

// Display-relative value in [0, 1] for a scene luminance in cd/m2.
float curve_value(float y)
{
    float at = log2(max(y, 1e-30)) * curve_place.x + curve_place.y;
    return curve_shown(at, curve_step(at));
}

// cd/m2 to display-linear [0, 1].
vec3 curve(vec3 rgb)
{
    float value = curve_value(luminance(rgb));
    return to_gamut(with_luminance(rgb, value), value);
}
