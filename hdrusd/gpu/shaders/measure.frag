// Sums, extremes and (PERCENTILES) bins of the luminance of a block of pixels; see gpu/measure.py.
#include "colour.glsl"

uniform sampler2D hdr;  // cd/m2, nearest, black outside
uniform vec2 texel;     // 1 / size of hdr

// Sum of log2, number of pixels, smallest and largest, of the pixels above FLOOR, cd/m2.
layout(location = 0) out vec4 partial;
layout(location = 1) out float total;  // sum over all pixels, cd/m2
#ifdef PERCENTILES
layout(location = 2) out uvec4 bins;  // 8 pixels, 16 bits each
#endif

int exponents = 0;
float mantissas = 1.0, counted = 0.0, smallest = 1e38, largest = 0.0, sum = 0.0;

// Takes in a pixel; returns the upper half of its luminance as a float, 0 where it is not counted.
uint take(ivec2 p)
{
    float y = luminance(clean(textureLod(hdr, (vec2(p) + 0.5) * texel, 0.0).rgb));
    bool counts = y > FLOOR;
    int bits = floatBitsToInt(counts ? y : 1.0);
    exponents += bits >> 23;
    mantissas *= intBitsToFloat((bits & 0x7fffff) | 0x3f800000);
    counted += counts ? 1.0 : 0.0;
    smallest = min(smallest, counts ? y : smallest);
    largest = max(largest, y);
    sum += y;
    return counts ? uint(bits) >> 16 : 0u;
}

uint take_two(ivec2 p)
{
    uint low = take(p);
    return low | take(p + ivec2(1, 0)) << 16;
}

void main()
{
    ivec2 p = ivec2(gl_FragCoord.xy) * ivec2(COLUMNS, ROWS);
    float logs = 0.0;
#ifdef PERCENTILES
    bins.x = take_two(p);
    bins.y = take_two(p + ivec2(2, 0));
    bins.z = take_two(p + ivec2(4, 0));
    bins.w = take_two(p + ivec2(6, 0));
    logs = log2(mantissas);
#else
    for (int row = 0; row < ROWS; ++row) {
        for (int column = 0; column < COLUMNS; ++column)
            take(p + ivec2(column, row));
        // At most 16 mantissas below 2: the product stays below 2^16.
        logs += log2(mantissas);
        mantissas = 1.0;
    }
#endif
    // The exponents' bias of 127 is taken off here, where the count of all pixels is known.
    logs += float(exponents - 127 * COLUMNS * ROWS);
    partial = vec4(logs, counted, smallest, largest);
    total = sum;
}
