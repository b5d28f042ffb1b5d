// Sums and extremes of the luminance of BLOCK pixels in a row; see gpu/measure.py.
#include "colour.glsl"

uniform sampler2D hdr;  // cd/m2, nearest, black outside
uniform vec2 texel;     // 1 / size of hdr

// Of the pixels above FLOOR: sum of log2, number, smallest and largest, cd/m2.
layout(location = 0) out vec4 counted;
layout(location = 1) out float total;  // sum over all pixels, cd/m2

void main()
{
    float x = floor(gl_FragCoord.x) * float(BLOCK) + 0.5;
    // log2 from exponents and the product of mantissas: one logarithm for RUN <= 16 numbers
    // below 2 at a time, in place of one a pixel. A pixel that does not count is 1.
    int exponents = 0;
    float logs = 0.0, number = 0.0, smallest = 1e38, largest = 0.0;
    total = 0.0;
    for (int run = 0; run < BLOCK; run += RUN) {
        float mantissas = 1.0;
        for (int i = 0; i < RUN; ++i) {  // with other bounds it would not be unrolled
            vec2 place = vec2(x + float(i), gl_FragCoord.y) * texel;
            float y = luminance(clean(textureLod(hdr, place, 0.0).rgb));
            bool counts = y > FLOOR;
            int bits = floatBitsToInt(counts ? y : 1.0);
            exponents += (bits >> 23) - 127;
            mantissas *= intBitsToFloat((bits & 0x7fffff) | 0x3f800000);
            number += counts ? 1.0 : 0.0;
            smallest = min(smallest, counts ? y : smallest);
            largest = max(largest, y);
            total += y;
        }
        logs += log2(mantissas);
        x += float(RUN);
    }
    counted = vec4(logs + float(exponents), number, smallest, largest);
}
