// What a pixel shows before any lamp: G-buffer, and emission plus ambient in cd/m2.
#include "photometry/reflectance.glsl"

struct Map {
    bool used;
    int uv;          // texture coordinate set, 0 to 3
    vec3 u;          // u' = dot(u, (s, t, 1))
    vec3 v;
    vec4 scale;
    vec4 bias;
    int channel;     // -1: rgb; 0 to 3: one channel
};

in vec3 position;
in vec3 normal;
in vec4 uv01;
in vec4 uv23;
in vec3 color;

uniform vec3 diffuse;      // reflectance
uniform vec3 specular;     // reflectance of the Blinn-Phong lobe
uniform float shininess;
uniform float metallic;
uniform vec3 emission;     // cd/m2
uniform float opacity;
uniform float opacity_threshold;
uniform bool double_sided;
uniform Map diffuse_map, emission_map, opacity_map;
uniform sampler2D diffuse_image, emission_image, opacity_image;
uniform vec3 ambient;      // lux
uniform float lambert_scale;
uniform vec3 toward_eye;   // orthographic: unit vector to the eye; perspective: zero

layout(location = 0) out vec4 g_position;  // m, relative to the eye; shininess
layout(location = 1) out vec4 g_normal;    // unit; 0
layout(location = 2) out vec4 g_diffuse;   // reflectance; opacity
layout(location = 3) out vec4 g_specular;  // reflectance; 0
layout(location = 4) out vec4 hdr;         // cd/m2; 1

vec4 texel(Map map, sampler2D image)
{
    vec2 st = map.uv == 0 ? uv01.xy : map.uv == 1 ? uv01.zw : map.uv == 2 ? uv23.xy : uv23.zw;
    vec3 s = vec3(st, 1.0);
    vec4 value = texture(image, vec2(dot(map.u, s), dot(map.v, s))) * map.scale + map.bias;
    return map.channel < 0 ? value : vec4(value[map.channel]);
}

void main()
{
    float alpha = opacity_map.used ? texel(opacity_map, opacity_image).r : opacity;
    if (alpha < opacity_threshold)
        discard;
    vec3 base = (diffuse_map.used ? texel(diffuse_map, diffuse_image).rgb : diffuse) * color;
    vec3 glow = emission_map.used ? texel(emission_map, emission_image).rgb : emission;
    vec3 n = normalize(normal);
    if (double_sided) {
        vec3 eye = toward_eye == vec3(0.0) ? -position : toward_eye;
        n = gl_FrontFacing ? n : -n;
        // An interpolated normal may point away at a silhouette; that is not the other side.
    }
    vec3 rho = base * (1.0 - metallic);
    g_position = vec4(position, shininess);
    g_normal = vec4(n, 0.0);
    g_diffuse = vec4(rho, alpha);
    g_specular = vec4(mix(specular, base, metallic), 0.0);
    hdr = vec4(max(glow, 0.0) + lambert(rho, ambient, lambert_scale), 1.0);
}
