// What a pixel shows before any lamp: G-buffer, and emission plus ambient in cd/m2.
// Variants by #define: what is not there must cost nothing, and a software device executes
// both sides of a branch. NAME_MAP is what a texture adds to a field: nothing, or
// "+ texel(k).rgb * name_scale"; the field itself is then the bias.
#include "photometry/microfacet.glsl"
#include "photometry/reflectance.glsl"
#include "photometry/sky.glsl"

in float depth;
in vec3 normal;
#ifdef VERTEX_COLOR
in vec3 color;
#endif

// -- textures: FETCHES of them, UV_SETS says which texture coordinates each takes -----------
#ifdef FETCHES
in vec4 uv01;
in vec4 uv23;
uniform sampler2D images[FETCHES];
uniform vec3 image_u[FETCHES];  // u' = dot(u, (s, t, 1))
uniform vec3 image_v[FETCHES];
const int uv_sets[FETCHES] = UV_SETS;

vec2 image_place(int k)
{
    int set = uv_sets[k];
    vec2 st = set == 0 ? uv01.xy : set == 1 ? uv01.zw : set == 2 ? uv23.xy : uv23.zw;
#ifdef PLAIN_PLACES            // the matrices of all are the identity
    return st;
#else
    return vec2(dot(image_u[k], vec3(st, 1.0)), dot(image_v[k], vec3(st, 1.0)));
#endif
}

#define texel(k) texture(images[k], image_place(k))  // k must be a constant
#endif

// -- fields of the material -----------------------------------------------------------------
// One that is what it mostly is, 0 or 1, comes as a #define: what a pixel reads of a uniform
// costs a software device more than what is done with it.
#ifdef DIFFUSE
const vec3 diffuse = DIFFUSE;
#else
uniform vec3 diffuse;          // reflectance
#endif
#ifdef DIFFUSE_SCALE
const vec3 diffuse_scale = DIFFUSE_SCALE;
#else
uniform vec3 diffuse_scale;
#endif
#ifdef EMISSION
const vec3 emission = EMISSION;
#else
uniform vec3 emission;         // cd/m2
#endif
#ifdef METALLIC
const float metallic = METALLIC;
#else
uniform float metallic;
#endif
#ifdef OCCLUSION
const float occlusion = OCCLUSION;
#else
uniform float occlusion;
#endif
uniform vec3 specular, specular_scale;    // reflectance at normal incidence
uniform vec3 emission_scale;
uniform float metallic_scale, occlusion_scale;
uniform float opacity, opacity_scale;
uniform float opacity_threshold;
#ifdef GGX
uniform float roughness, roughness_scale;
#else
uniform float shininess;
#endif
#ifdef EXTRA
uniform float clearcoat, clearcoat_scale;
uniform float clearcoat_roughness, clearcoat_roughness_scale;
uniform float links;           // bits of the draw's light links
#endif
uniform float back_sign;       // of a back face's normal: -1 double-sided, 1 single-sided
#ifdef SKY
uniform vec3 sky[18];          // coefficients of ambient_lux
#else
uniform vec3 ambient;          // lux
#endif
uniform float lambert_scale;   // 1/pi, or 1 for petit2010

#ifdef GGX
// mean_schlick of photometry/environment.glsl, over all views: off by 0.8 % of F90 where the
// surface faces the eye, by 2 % at its rim.
#define MEAN_SCHLICK 0.008
#endif

layout(location = 0) out vec4 g_normal;    // unit normal; distance along the view axis, m
layout(location = 1) out vec4 g_diffuse;   // reflectance; shininess, or minus alpha of GGX
#ifdef ONE_SPECULAR        // the same of all surfaces: there is no target for it
layout(location = 2) out vec4 hdr;         // cd/m2; 1, or as composite.frag wants it
#else
layout(location = 2) out vec4 g_specular;  // reflectance at normal incidence; metallic
layout(location = 3) out vec4 hdr;
#endif
#ifdef EXTRA
layout(location = EXTRA) out vec4 g_extra; // clear coat: weight, alpha; light links; 0
#endif

#ifdef SKY_APART
// What the sky's lux becomes, reflectance times occlusion: sky_light.frag adds it.
layout(location = SKY_APART) out vec4 g_scattered;
#endif

#ifdef PEEL
uniform sampler2D opaque;      // g_normal of what is not blended
uniform sampler2D before;      // g_normal of the layer in front of this one
uniform vec2 pixel;            // 1 / size of both
#endif

#ifdef NORMAL_MAP
in vec3 position;              // m, relative to the eye
uniform vec3 bump, bump_scale;

// A normal in tangent space, by how the texture's coordinates grow over the screen: +x along
// the growth of u, +y to the side to which v grows, so that mirrored coordinates are right.
vec3 bumped(vec3 n, vec3 tangent_space, vec2 place)
{
    vec3 px = dFdx(position), py = dFdy(position);
    vec2 tx = dFdx(place), ty = dFdy(place);
    float turn = sign(tx.x * ty.y - ty.x * tx.y);  // 0: coordinates that do not span a plane
    vec3 u = turn * (px * ty.y - py * tx.y);
    vec3 v = turn * (py * tx.x - px * ty.x);
    u -= n * dot(n, u);
    u *= inversesqrt(max(dot(u, u), 1e-30));
    vec3 w = cross(n, u);
    w *= dot(w, v) < 0.0 ? -1.0 : 1.0;
    vec3 sum = u * tangent_space.x + w * tangent_space.y + n * tangent_space.z;
    float length2 = dot(sum, sum);
    return turn != 0.0 && length2 > 0.0 ? sum * inversesqrt(length2) : n;
}
#endif

void main()
{
    vec3 base = diffuse DIFFUSE_MAP;
#ifdef DIFFUSE_HELD            // where scale and bias lead a texel out of 0 to 1
    base = clamp(base, 0.0, 1.0);
#endif
#ifdef VERTEX_COLOR
    base *= color;
#endif
    float metal = clamp(metallic METALLIC_MAP, 0.0, 1.0);
    vec3 n = normalize(normal);
#ifdef NORMAL_MAP
    n = bumped(n, bump NORMAL_MAP, image_place(NORMAL_PLACE));
#endif
    n *= gl_FrontFacing ? 1.0 : back_sign;
#ifdef SKY_APART
#elif defined(SKY)
    vec3 lux = ambient_lux(n, sky);
#elif !defined(DARK)
    vec3 lux = ambient;
#endif
    vec3 rho = base * (1.0 - metal);
    vec3 f0 = specular SPECULAR_MAP;
#ifdef SPECULAR_HELD
    f0 = clamp(f0, 0.0, 1.0);
#endif
    f0 = mix(f0, base, metal);
#ifdef GGX
    // What sky.frag mirrors is lost to what lies below.
    vec3 scattered = rho * (1.0 - fresnel(f0, grazing_reflectance(f0, metal), MEAN_SCHLICK));
#ifdef EXTRA
    scattered *= 1.0 - coat_reflectance(clamp(clearcoat CLEARCOAT_MAP, 0.0, 1.0), MEAN_SCHLICK);
#endif
#else
    // A metal of legacy materials mirrors the sky as a diffuse surface scatters it.
    vec3 scattered = base;
#endif
    scattered *= clamp(occlusion OCCLUSION_MAP, 0.0, 1.0);
    vec3 glow = max(emission EMISSION_MAP, 0.0);
#ifdef SKY_APART
    g_scattered = vec4(scattered, 0.0);
#elif !defined(DARK)       // no light but lamps
    glow += lambert(scattered, lux, lambert_scale);
#endif
#ifdef GGX
    float rough = clamp(roughness ROUGHNESS_MAP, 0.0, 1.0);
    float gloss = -max(rough * rough, 1e-3);
#else
    float gloss = shininess;
#endif
    float shown = 1.0;
#if defined(MASKED) || defined(BLEND)
    float alpha = clamp(opacity OPACITY_MAP, 0.0, 1.0);
#endif
#ifdef MASKED
    if (alpha < opacity_threshold)
        discard;
#endif
#ifdef BLEND
#ifdef PRESENCE
    shown = -alpha;            // all of it, highlights too: multiplied when the layer is complete
    if (alpha == 0.0)
        discard;
#else
    shown = alpha;             // a highlight is as bright on clear glass
    rho *= alpha;
    glow *= alpha;
#endif
#endif
#ifdef PEEL
    float wall = textureLod(opaque, gl_FragCoord.xy * pixel, 0.0).w;
    float front = textureLod(before, gl_FragCoord.xy * pixel, 0.0).w;
    // 0: the layer before had nothing left here. What is painted on a wall lies in it, but
    // for the rounding of both distances.
    if (front == 0.0 || depth <= front
        || (wall != 0.0 && depth > wall * (1.0 + 4e-6)))
        discard;
#endif
    g_normal = vec4(n, depth);
    g_diffuse = vec4(rho, gloss);
#ifndef ONE_SPECULAR
    g_specular = vec4(f0, metal);
#endif
    hdr = vec4(glow, shown);
#ifdef EXTRA
    float smooth_coat = clamp(clearcoat_roughness CLEARCOAT_ROUGHNESS_MAP, 0.0, 1.0);
    g_extra = vec4(clamp(clearcoat CLEARCOAT_MAP, 0.0, 1.0),
                   max(smooth_coat * smooth_coat, 1e-3), links, 0.0);
#endif
}
