// Reinhard, Stark, Shirley, Ferwerda, SIGGRAPH 2002, eq. 7 to 9; twin of reinhard02_local.py
#include "colour.glsl"

uniform float reinhard02_local_scale;           // key / log average, 1/(cd/m2)
uniform float reinhard02_local_sharpness;       // 2^phi key
uniform float reinhard02_local_threshold;       // epsilon
uniform float reinhard02_local_inverse_white2;  // 1 / white^2, or 0

// Scaled luminance of the surround that a pixel is compressed by.
float surround(float around[BLURS])
{
    float centre = reinhard02_local_scale * around[0];
    float sharpness = reinhard02_local_sharpness;  // over the scale's square
    for (int i = 0; i < BLURS - 1; ++i) {
        float next = reinhard02_local_scale * around[i + 1];
        if (abs(centre - next) > reinhard02_local_threshold * (sharpness + centre))
            break;
        centre = next;
        sharpness *= 0.390625;  // 1.6^-2
    }
    return centre;
}

// cd/m2 to display-linear [0, 1]; around: luminance, blurred by the kernels of the twin.
vec3 reinhard02_local(vec3 rgb, float around[BLURS])
{
    float y = luminance(rgb);
    float scaled = reinhard02_local_scale * y;
    float gain = (1.0 + scaled * reinhard02_local_inverse_white2) * reinhard02_local_scale
               / (1.0 + surround(around));
    return to_gamut(rgb * gain, y * gain);
}
