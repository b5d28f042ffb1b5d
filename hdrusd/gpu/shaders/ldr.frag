// Shader 2: HDR frame in cd/m2 to the bytes of an 8-bit picture, by any operator.
// An RGBA32UI texel holds 16 consecutive bytes of the RGB picture, so three of them hold 16
// pixels: nothing is left to convert or to drop when it is read (why: gpu/ldr.py).
#include "gpu/shaders/shown.glsl"

layout(location = 0) out uvec4 bytes;

// The pixel x to the right and y down: red in the lowest byte, then green and blue.
uint pixel(ivec2 p)
{
    uvec3 code = quantise(shown(p), dither(uint(p.x), uint(p.y)));
    return code.r | code.g << 8 | code.b << 16;
}

void main()
{
    // Texels 3n, 3n+1, 3n+2 begin 0, 1 and 2 bytes into the pixels 16n, 16n+5, 16n+10.
    ivec2 at = ivec2(gl_FragCoord.xy);
    int skip = at.x % 3;
    ivec2 p = ivec2(at.x / 3 * 16 + skip * 5, at.y);
    uint a = pixel(p);
    uint b = pixel(p + ivec2(1, 0));
    uint c = pixel(p + ivec2(2, 0));
    uint d = pixel(p + ivec2(3, 0));
    uint e = pixel(p + ivec2(4, 0));
    uint f = pixel(p + ivec2(5, 0));
    uvec4 words = uvec4(a | b << 24, b >> 8 | c << 16, c >> 16 | d << 8, e | f << 24);
    uvec4 next = uvec4(words.yzw, f >> 8);
    uint shift = uint(skip * 8);
    bytes = skip == 0 ? words : words >> shift | next << (32u - shift);
}
