// Drago, Myszkowski, Annen, Chiba, Computer Graphics Forum 2003, eq. 4; twin of tonemap/drago03.py
#include "colour.glsl"

uniform float drago03_scale;  // 1/(cd/m2)
uniform float drago03_top;    // the frame's largest luminance times it
uniform float drago03_power;  // ln(bias) / ln(0.5)

// cd/m2 to display-linear, not yet clipped.
float drago03_curve(float y)
{
    float x = y * drago03_scale;
    // pow(0, 0) is undefined; 1e-30 only matters where x is 0.
    float base = 2.0 + 8.0 * pow(clamp(x / drago03_top, 1e-30, 1.0), drago03_power);
    // 1 + x keeps little of a small x.
    float rise = x < 0.01 ? x - x * x * (0.5 - x / 3.0) : log(1.0 + x);
    return rise / (log(base) * log2(1.0 + drago03_top) * 0.30102999566398120);
}

// cd/m2 to display-linear [0, 1].
vec3 drago03(vec3 rgb)
{
    float shown = drago03_curve(luminance(rgb));
    return to_gamut(with_luminance(rgb, shown), shown);
}
