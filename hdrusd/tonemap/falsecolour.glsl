// Radiance's falsecolor, logarithmic scale, palette "spec"; twin of tonemap/falsecolour.py
#include "colour.glsl"

uniform float falsecolour_scale;    // cd/m2 at the top
uniform float falsecolour_decades;  // powers of ten down to the bottom

// cd/m2 to the place on the scale, [0, 1].
float falsecolour_position(float y)
{
    float ratio = max(y / falsecolour_scale, exp2(-3.3219280948873623 * falsecolour_decades));
    return clamp(1.0 + log2(ratio) * (0.30102999566398120 / falsecolour_decades), 0.0, 1.0);
}

// Place on the scale [0, 1] to code values [0, 1].
vec3 falsecolour_palette(float v)
{
    float green = v > 0.375 ? 1.6 - 1.6 * v : v * (8.0 / 3.0);
    return clamp(vec3(1.6 * v - 0.6, green, 1.0 - v * (8.0 / 3.0)), 0.0, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 falsecolour(vec3 rgb)
{
    return srgb_decode(falsecolour_palette(falsecolour_position(luminance(rgb))));
}
