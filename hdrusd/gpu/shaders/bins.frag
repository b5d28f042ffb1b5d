// The bins of 8 pixels' luminances: the upper 16 bits of each as a float; see gpu/measure.py.
#include "colour.glsl"

uniform sampler2D hdr;  // cd/m2, nearest, black outside
uniform vec2 texel;     // 1 / size of hdr

layout(location = 0) out uvec4 bins;

// 0 for a pixel that is not above FLOOR.
uint bin(ivec2 p)
{
    float y = luminance(clean(textureLod(hdr, (vec2(p) + 0.5) * texel, 0.0).rgb));
    return y > FLOOR ? floatBitsToUint(y) >> 16 : 0u;
}

uint two_bins(ivec2 p)
{
    return bin(p) | bin(p + ivec2(1, 0)) << 16;
}

void main()
{
    ivec2 p = ivec2(gl_FragCoord.xy) * ivec2(8, 1);
    bins = uvec4(two_bins(p), two_bins(p + ivec2(2, 0)),
                 two_bins(p + ivec2(4, 0)), two_bins(p + ivec2(6, 0)));
}
