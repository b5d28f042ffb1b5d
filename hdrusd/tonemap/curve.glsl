// One curve from ln scene luminance to ln display luminance; twin of tonemap/curve.py
#include "colour.glsl"

uniform sampler2D curve_steps;  // n x 1: ln cd/m2 on the display where a step begins, and its rise
uniform vec2 curve_from;        // ln cd/m2 of the scene where the first begins and the last ends
uniform vec2 curve_to;          // cd/m2 of the display's black and white

// Display-relative value in [0, 1] for a scene luminance in cd/m2.
float curve_value(float y)
{
    float b = log(max(y, 1e-30));
    float inside = clamp(b, curve_from.x, curve_from.y);
    float count = float(textureSize(curve_steps, 0).x);
    float place = (inside - curve_from.x) * (count / (curve_from.y - curve_from.x));
    float first = min(floor(place), count - 1.0);
    vec2 at = texelFetch(curve_steps, ivec2(int(first), 0), 0).xy;
    float shown = at.x + (place - first) * at.y + (b - inside);
    shown = exp(min(shown, log(curve_to.y)));
    return clamp((shown - curve_to.x) / (curve_to.y - curve_to.x), 0.0, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 curve(vec3 rgb)
{
    float value = curve_value(luminance(rgb));
    return to_gamut(with_luminance(rgb, value), value);
}
