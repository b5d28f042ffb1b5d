// Shader 2 for one pixel in three steps: its light, the operator, and ENCODE for the screen.
#include "colour.glsl"
#include "eye/scotopic.glsl"
#include OPERATOR_GLSL

uniform sampler2D hdr;          // cd/m2, nearest
uniform vec2 texel;             // 1 / size of hdr
uniform int top_row, row_step;  // row of hdr at the top of the picture, and +1 or -1
uniform vec2 panel;             // what the screen itself emits at black and at white, cd/m2
#ifdef BLURS
uniform sampler2D around_0, around_1, around_2, around_3;  // four blurs each
#endif

// Display-linear [0, 1] to code values [0, 1], by the screen's EOTF.
vec3 encode_srgb(vec3 linear) { return srgb_encode_fit(linear); }
vec3 encode_gamma22(vec3 linear) { return gamma_encode(linear, 2.2); }
vec3 encode_bt1886(vec3 linear) { return bt1886_encode(linear, panel.x, panel.y); }
vec3 encode_pq(vec3 linear)
{
    return pq_encode(max(to_rec2020(panel.x + linear * (panel.y - panel.x)), 0.0));
}
vec3 encode_none(vec3 code) { return code; }

// Where the pixel x to the right and y down is in hdr.
vec2 place_of(ivec2 p)
{
    // By coordinates: a texel fetch is checked against the size, which costs a fifth on llvmpipe.
    return (vec2(p.x, top_row + row_step * p.y) + 0.5) * texel;
}

// cd/m2 of that pixel, as the eye has them.
vec3 light(ivec2 p)
{
    vec4 frame = textureLod(hdr, place_of(p), 0.0);
    vec3 rgb = clean(frame.rgb);
#ifdef NIGHT  // 1: alpha is the white-relative scotopic luminance
    rgb = night_colour(rgb, NIGHT == 1 ? max(frame.a, 0.0) : white_relative(scotopic(rgb)));
#endif
    return rgb;
}

// Display-linear [0, 1] of that pixel, whose light is rgb.
vec3 mapped(vec3 rgb, ivec2 p)
{
#ifdef BLURS
    vec2 place = place_of(p);
    vec4 blurs[4] = vec4[4](
        textureLod(around_0, place, 0.0),
        BLURS > 4 ? textureLod(around_1, place, 0.0) : vec4(0.0),
        BLURS > 8 ? textureLod(around_2, place, 0.0) : vec4(0.0),
        BLURS > 12 ? textureLod(around_3, place, 0.0) : vec4(0.0));
    float around[BLURS];
    for (int i = 0; i < BLURS; ++i)
        around[i] = blurs[i / 4][i % 4];
    return OPERATOR(rgb, around);
#else
    return OPERATOR(rgb);
#endif
}
