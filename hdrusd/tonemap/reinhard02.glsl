// Reinhard, Stark, Shirley, Ferwerda, SIGGRAPH 2002, eq. 2 and 4; twin of tonemap/reinhard02.py
#include "colour.glsl"

uniform float reinhard02_scale;           // key / log average, 1/(cd/m2)
uniform float reinhard02_inverse_white2;  // 1 / (scaled luminance that becomes 1)^2

// cd/m2 to display-linear [0, 1].
vec3 reinhard02(vec3 rgb)
{
    float y = luminance(rgb);
    float scaled = reinhard02_scale * y;
    float gain = (1.0 + scaled * reinhard02_inverse_white2) * (reinhard02_scale / (1.0 + scaled));
    return to_gamut(rgb * gain, y * gain);
}
