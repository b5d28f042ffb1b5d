// The frame with its veil: what leaves a pixel for others taken away, what they send added.
#include "colour.glsl"
#include "eye/scotopic.glsl"

uniform sampler2D hdr;   // cd/m2, nearest
uniform sampler2D veil;  // cd/m2 and the share that leaves, SCALE pixels a texel, linear
uniform vec2 texel, veil_texel;  // 1 / size

layout(location = 0) out vec4 veiled;

void main()
{
    vec2 q = (gl_FragCoord.xy * (1.0 / SCALE) + float(MARGIN)) * veil_texel;
    vec4 light = textureLod(veil, q, 0.0);
    vec4 seen = textureLod(hdr, gl_FragCoord.xy * texel, 0.0);
    veiled = vec4((1.0 - light.a) * clean(seen.rgb) + light.rgb, seen.a);
#ifdef RODS  // alpha is scotopic luminance; of the veil's, its colour tells
    veiled.a = (1.0 - light.a) * seen.a + white_relative(scotopic(light.rgb));
#endif
}
