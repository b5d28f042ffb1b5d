// Light of the sky that reaches a surface past all others, from one batch of directions.
// Result: rgb sum of what arrives, a sum of the luminance that would with nothing in the way;
// both cd/m2 times cosine.
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
uniform sampler2DShadow depths;  // a tile a direction, seen from outside of everything
uniform vec4 across[BATCH], along[BATCH];  // place relative to the eye (m), 1: texel of ``depths``
uniform vec4 towards[BATCH];     // unit vector to the sky; offset of the depth
uniform vec4 luminance[BATCH];   // cd/m2; factor of the depth, 1/m
uniform float texel;             // of a tile, m
uniform vec2 inverse_size;       // 1 / texels of ``depths``

layout(location = 0) out vec4 sum;

void main()
{
    float depth;
    vec3 n = g_normal_at(window, depth);
    vec3 p = g_position_at(window, depth);
    sum = vec4(0.0);
    for (int i = 0; i < BATCH; ++i) {
        float c = dot(n, towards[i].xyz);
        float front = max(c, 0.0);
        // A flat surface rises by this much within the texels that a look-up reads.
        float inverse = 1.0 / max(front, 1e-3);
        // The depth that the surface's own plane has in the middle of the texel, which is what
        // was drawn there if nothing is in the way; a normal need not be the plane's.
        vec2 place = vec2(dot(p, across[i].xyz) + across[i].w, dot(p, along[i].xyz) + along[i].w);
        vec2 middle = floor(place) + 0.5;
        vec2 lean = vec2(dot(n, across[i].xyz), dot(n, along[i].xyz)) * texel;
        float rise = texel * (0.1 + inverse * (0.1 - dot(middle - place, lean)));
        float z = towards[i].w - (dot(p, towards[i].xyz) + rise) * luminance[i].w;
        float seen = textureLod(depths, vec3(middle * inverse_size, z), 0.0);
        vec3 light = front * luminance[i].rgb;
        sum += vec4(seen * light, dot(light, vec3(0.2126, 0.7152, 0.0722)));
    }
}
