// Radiance's falsecolor, its scales and palettes; twin of tonemap/falsecolour.py
#include "colour.glsl"

uniform float falsecolour_scale;    // cd/m2 at the top
uniform float falsecolour_decades;  // powers of ten down to the bottom; 0: linear
uniform float falsecolour_kind;     // 0 spec, 1 pm3d, 2 hot, 3 eco
uniform float falsecolour_steps;    // that the scale is cut into; 0: none

// cd/m2 to the place on the scale, [0, 1].
float falsecolour_position(float y)
{
    if (falsecolour_decades == 0.0)
        return min(y / falsecolour_scale, 1.0);
    float ratio = max(y / falsecolour_scale, exp2(-3.3219280948873623 * falsecolour_decades));
    return clamp(1.0 + log2(ratio) * (0.30102999566398120 / falsecolour_decades), 0.0, 1.0);
}

// The middle of the step that a place is in.
float falsecolour_step(float v)
{
    if (falsecolour_steps == 0.0)
        return v;
    return (min(floor(v * falsecolour_steps), falsecolour_steps - 1.0) + 0.5) / falsecolour_steps;
}

// Place on the scale [0, 1] to code values [0, 1].
vec3 falsecolour_palette(float v)
{
    float green = v > 0.375 ? 1.6 - 1.6 * v : v * (8.0 / 3.0);
    vec3 code = vec3(1.6 * v - 0.6, green, 1.0 - v * (8.0 / 3.0));
    if (falsecolour_kind == 1.0)
        code = vec3(sqrt(v), v * v * v, sin(6.283185307179586 * v));
    else if (falsecolour_kind == 2.0)
        code = 3.0 * v - vec3(0.0, 1.0, 2.0);
    else if (falsecolour_kind == 3.0)
        code = vec3(2.0 * v, 2.0 * v - 1.0, 1.0 - 2.0 * v);
    return clamp(code, 0.0, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 falsecolour(vec3 rgb)
{
    float place = falsecolour_step(falsecolour_position(luminance(rgb)));
    return srgb_decode(falsecolour_palette(place));
}
