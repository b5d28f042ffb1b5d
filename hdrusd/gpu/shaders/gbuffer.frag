// What a pixel shows before any lamp: G-buffer, and emission plus ambient in cd/m2.
// Variants by #define (DIFFUSE_MAP, EMISSION_MAP, OPACITY_MAP): a texture that is not used must
// not be sampled, and a software device samples both sides of a branch.
#include "photometry/reflectance.glsl"

in float depth;
in vec3 normal;
#ifdef VERTEX_COLOR
in vec3 color;
#endif
#ifdef TEXTURED
in vec4 uv01;
in vec4 uv23;

struct Map {
    int uv;          // texture coordinate set, 0 to 3
    vec3 u;          // u' = dot(u, (s, t, 1))
    vec3 v;
    vec4 scale;
    vec4 bias;
    int channel;     // -1: rgb; 0 to 3: one channel
};

vec4 texel(Map map, sampler2D image)
{
    vec2 st = map.uv == 0 ? uv01.xy : map.uv == 1 ? uv01.zw : map.uv == 2 ? uv23.xy : uv23.zw;
    vec3 s = vec3(st, 1.0);
    vec4 value = texture(image, vec2(dot(map.u, s), dot(map.v, s))) * map.scale + map.bias;
    return map.channel < 0 ? value : vec4(value[map.channel]);
}
#endif

uniform vec3 diffuse;      // reflectance
uniform vec3 specular;     // reflectance of the Blinn-Phong lobe
uniform float shininess;
uniform float metallic;
uniform vec3 emission;     // cd/m2
uniform float opacity;
uniform float opacity_threshold;
uniform float back_sign;   // of a back face's normal: -1 double-sided, 1 single-sided
uniform vec3 ambient;      // lux
uniform float lambert_scale;
#ifdef DIFFUSE_MAP
uniform Map diffuse_map;
uniform sampler2D diffuse_image;
#endif
#ifdef EMISSION_MAP
uniform Map emission_map;
uniform sampler2D emission_image;
#endif
#ifdef OPACITY_MAP
uniform Map opacity_map;
uniform sampler2D opacity_image;
#endif

layout(location = 0) out vec4 g_normal;    // unit normal; distance along the view axis, m
layout(location = 1) out vec4 g_diffuse;   // reflectance; shininess
layout(location = 2) out vec4 g_specular;  // reflectance; opacity
layout(location = 3) out vec4 hdr;         // cd/m2; 1

void main()
{
    float alpha = opacity;
#ifdef OPACITY_MAP
    alpha = texel(opacity_map, opacity_image).r;
#endif
    if (alpha < opacity_threshold)
        discard;
    vec3 base = diffuse;
#ifdef DIFFUSE_MAP
    base = texel(diffuse_map, diffuse_image).rgb;
#endif
#ifdef VERTEX_COLOR
    base *= color;
#endif
    vec3 glow = emission;
#ifdef EMISSION_MAP
    glow = texel(emission_map, emission_image).rgb;
#endif
    vec3 n = normalize(normal) * (gl_FrontFacing ? 1.0 : back_sign);
    vec3 rho = base * (1.0 - metallic);
    vec3 ks = mix(specular, base, metallic);
    g_normal = vec4(n, depth);
    g_diffuse = vec4(rho, shininess);
    g_specular = vec4(ks, alpha);
    // What comes from everywhere alike is mirrored by a metal as a diffuse surface scatters it.
    hdr = vec4(max(glow, 0.0) + lambert(base, ambient, lambert_scale), 1.0);
}
