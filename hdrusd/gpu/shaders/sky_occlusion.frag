// Light of the sky that reaches a surface past all others, from one batch of directions.
// Result: rgb sum of what arrives, a sum of the luminance that would with nothing in the way;
// both cd/m2 times cosine.
#include "colour.glsl"
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
uniform sampler2DShadow depths;  // a tile a direction, seen from outside of everything
uniform vec4 across[BATCH], along[BATCH];  // place relative to the eye (m), 1: texel of ``depths``
uniform vec4 towards[BATCH];     // unit vector to the sky; offset of the depth
uniform vec4 shining[BATCH];   // cd/m2; factor of the depth, 1/m
uniform float texel;             // of a tile, m
uniform vec2 inverse_size;       // 1 / texels of ``depths``

layout(location = 0) out vec4 sum;

// From a pixel's place to that of a neighbour in its plane: of two the one nearer in depth.
vec3 step_in_plane(vec3 p, float depth, vec2 pixel)
{
    vec2 ahead = window + pixel, back = window - pixel;
    float a = textureLod(g_normal, ahead, 0.0).w, b = textureLod(g_normal, back, 0.0).w;
    // At the picture's edge a texel is its own neighbour.
    a = max(ahead.x, ahead.y) < 1.0 ? a : 0.0;
    b = min(back.x, back.y) > 0.0 ? b : 0.0;
    bool forth = abs(a - depth) <= abs(b - depth);
    vec3 other = forth ? g_position_at(ahead, a) : g_position_at(back, b);
    return forth ? other - p : p - other;
}

// The normal of the triangle that is seen; the shading normal where it has no neighbour.
vec3 flat_normal(vec3 p, float depth, vec3 n)
{
    vec2 pixel = 1.0 / vec2(textureSize(g_normal, 0));
    vec3 found = cross(step_in_plane(p, depth, vec2(pixel.x, 0.0)),
                       step_in_plane(p, depth, vec2(0.0, pixel.y)));
    found *= inversesqrt(max(dot(found, found), 1e-30));
    float side = dot(found, g_toward_eye(p));
    return abs(side) > 1e-3 ? found * sign(side) : n;
}

void main()
{
    float depth;
    vec3 n = g_normal_at(window, depth);
    vec3 p = g_position_at(window, depth);
    vec3 plane = flat_normal(p, depth, n);
    sum = vec4(0.0);
    for (int i = 0; i < BATCH; ++i) {
        float front = max(dot(n, towards[i].xyz), 0.0);
        float above = dot(plane, towards[i].xyz);
        float inverse = 1.0 / max(above, 1e-3);
        // The depth that the surface's own plane has in the middle of the texel, which is what
        // was drawn there if nothing is in the way.
        vec2 place = vec2(dot(p, across[i].xyz) + across[i].w, dot(p, along[i].xyz) + along[i].w);
        vec2 middle = floor(place) + 0.5;
        vec2 lean = vec2(dot(plane, across[i].xyz), dot(plane, along[i].xyz)) * texel;
        float rise = texel * (0.1 + inverse * (0.1 - dot(middle - place, lean)));
        float z = towards[i].w - (dot(p, towards[i].xyz) + rise) * shining[i].w;
        float seen = textureLod(depths, vec3(middle * inverse_size, z), 0.0) * step(0.0, above);
        vec3 light = front * shining[i].rgb;
        sum += vec4(seen * light, luminance(light));
    }
}
