// Sums and extremes of the luminance of a block of COLUMNS x ROWS pixels; see gpu/measure.py.
#include "colour.glsl"

uniform sampler2D hdr;  // cd/m2, nearest, black outside
uniform vec2 texel;     // 1 / size of hdr

// Of the pixels above FLOOR: sum of log2, number, smallest and largest, cd/m2.
layout(location = 0) out vec4 counted;
layout(location = 1) out float total;  // sum over all pixels, cd/m2

void main()
{
    ivec2 corner = ivec2(gl_FragCoord.xy) * ivec2(COLUMNS, ROWS);
    // log2 from exponents and the product of mantissas: one logarithm a row, COLUMNS <= 16
    // numbers below 2 at a time, in place of one a pixel. A pixel that does not count is 1.
    int exponents = 0;
    float logs = 0.0, number = 0.0, smallest = 1e38, largest = 0.0;
    total = 0.0;
    for (int row = 0; row < ROWS; ++row) {
        float mantissas = 1.0;
        for (int column = 0; column < COLUMNS; ++column) {
            vec2 place = (vec2(corner + ivec2(column, row)) + 0.5) * texel;
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
    }
    counted = vec4(logs + float(exponents), number, smallest, largest);
}
