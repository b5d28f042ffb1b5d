// Fits to ACES 1.x by Narkowicz and by Hill, 2016; twin of tonemap/aces.py
#include "tonemap/exposure.glsl"

uniform float aces_fit;  // 0: Narkowicz, 1: Hill

// A column a channel of what comes out.
const mat3 HILL_IN = mat3(0.59719, 0.35458, 0.04823,
                          0.07600, 0.90834, 0.01566,
                          0.02840, 0.13383, 0.83777);
const mat3 HILL_OUT = mat3(1.60475, -0.53108, -0.07367,
                           -0.10208, 1.10813, -0.00605,
                           -0.00327, -0.07276, 1.07602);

// Exposed RGB to display-linear [0, 1], each channel for itself.
vec3 narkowicz(vec3 x)
{
    return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

// Exposed RGB to display-linear [0, 1].
vec3 hill(vec3 rgb)
{
    vec3 v = rgb * HILL_IN;
    v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(v * HILL_OUT, 0.0, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 aces(vec3 rgb)
{
    vec3 x = exposed(rgb);
    return aces_fit > 0.5 ? hill(x) : narkowicz(x);
}
