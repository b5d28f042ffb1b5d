// Shader 2: HDR frame in cd/m2 to the bytes of an 8-bit picture, by any operator.
// An RGBA32UI texel holds 16 consecutive bytes of the RGB picture, so three of them hold 16
// pixels: nothing is left to convert or to drop when it is read (why: gpu/ldr.py).
#include "gpu/shaders/shown.glsl"

layout(location = 0) out uvec4 bytes;

// What the screen is told: red in the lowest byte, then green and blue.
uint bytes_of(vec3 linear, ivec2 p)
{
    uvec3 code = quantise(ENCODE(linear), dither(uint(p.x), uint(p.y)));
    return code.r | code.g << 8 | code.b << 16;
}

void main()
{
    // Texels 3n, 3n+1, 3n+2 begin 0, 1 and 2 bytes into the pixels 16n, 16n+5, 16n+10.
    ivec2 at = ivec2(gl_FragCoord.xy);
    int skip = at.x % 3;
    ivec2 p = ivec2(at.x / 3 * 16 + skip * 5, at.y);
    // Step by step for all six, not pixel by pixel: a step is a chain in which each instruction
    // waits for the one before, and a processor looks ahead for others no further than a step.
    // That is a fifth of the time.
    vec3 rgb[6];
    uint code[6];
    for (int i = 0; i < 6; ++i)
        rgb[i] = light(p + ivec2(i, 0));
#ifdef PLAIN_CURVE  // the steps of curve(): a fifth of the time once more
    float value[6];
    vec2 from[6];
    for (int i = 0; i < 6; ++i)
        value[i] = curve_at(rgb[i]);
    for (int i = 0; i < 6; ++i)
        from[i] = curve_step(value[i]);
    for (int i = 0; i < 6; ++i)
        value[i] = curve_shown(value[i], from[i]);
    for (int i = 0; i < 6; ++i)
        rgb[i] = to_gamut(with_luminance(rgb[i], value[i]), value[i]);
#else
    for (int i = 0; i < 6; ++i)
        rgb[i] = mapped(rgb[i], p + ivec2(i, 0));
#endif
    for (int i = 0; i < 6; ++i)
        code[i] = bytes_of(rgb[i], p + ivec2(i, 0));
    uvec4 words = uvec4(code[0] | code[1] << 24, code[1] >> 8 | code[2] << 16,
                        code[2] >> 16 | code[3] << 8, code[4] | code[5] << 24);
    uvec4 next = uvec4(words.yzw, code[5] >> 8);
    uint shift = uint(skip * 8);
    bytes = skip == 0 ? words : words >> shift | next << (32u - shift);
}
