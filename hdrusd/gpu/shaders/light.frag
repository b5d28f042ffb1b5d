// Shader 1: E_k = I_k cos(theta) / d^2 (Petit and Bremond 2010, eq. 1), diffuse and specular,
// added up over one batch of lights. Result in cd/m2.
#include "photometry/light.glsl"
#include "photometry/reflectance.glsl"
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
flat in vec4 data[BATCH * ROWS];
layout(location = 0) out vec4 hdr;

// Rows of a light: position, w | intensity rgb, 1/radius^2 | axis, exponent | inner, 1/width, 0, 0.
// With CONES (and no exponent): position, 1/radius^2 | intensity rgb, inner | axis, 1/width.
#if defined(FOCUS)
#define POSITION(i) data[(i) * ROWS].xyz, data[(i) * ROWS].w
#define INVERSE_RADIUS2(i) data[(i) * ROWS + 1].w
#define SHAPE(i) * cone_factor(-dot(l, data[(i) * ROWS + 2].xyz), data[(i) * ROWS + 3].x, \
                               data[(i) * ROWS + 3].y) \
                 * focus_factor(-dot(l, data[(i) * ROWS + 2].xyz), data[(i) * ROWS + 2].w)
#elif defined(CONES)
#define POSITION(i) data[(i) * ROWS].xyz, 1.0
#define INVERSE_RADIUS2(i) data[(i) * ROWS].w
#define SHAPE(i) * cone_factor(-dot(l, data[(i) * ROWS + 2].xyz), data[(i) * ROWS + 1].w, \
                               data[(i) * ROWS + 2].w)
#else
#define POSITION(i) data[(i) * ROWS].xyz, data[(i) * ROWS].w
#define INVERSE_RADIUS2(i) data[(i) * ROWS + 1].w
#define SHAPE(i)
#endif

#define LIGHT(i) \
    vec3 l = light_vector(POSITION(i), p); \
    float inverse_d = inversesqrt(max(dot(l, l), 1e-20)); \
    l *= inverse_d; \
    float nl = dot(n, l); \
    vec3 lux = data[(i) * ROWS + 1].xyz * (illuminance(nl, inverse_d * inverse_d, INVERSE_RADIUS2(i)) SHAPE(i));

#define DIFFUSE(i) { LIGHT(i) sum += lux; }
#define GLOSS(i) { LIGHT(i) sum += lux; \
    gloss += lux * blinn_phong(half_cosine(nl, nv, dot(l, v)), shininess, lambert_scale); }

// ALL, one of these, applies X to each light of the batch.
#define ALL1(X) X(0)
#define ALL4(X) ALL1(X) X(1) X(2) X(3)
#define ALL7(X) ALL4(X) X(4) X(5) X(6)
#define ALL10(X) ALL7(X) X(7) X(8) X(9)
#define ALL15(X) ALL10(X) X(10) X(11) X(12) X(13) X(14)

uniform float lambert_scale;  // 1/pi, or 1 for petit2010

void main()
{
    float depth;
    vec3 n = g_normal_at(window, depth);
    vec3 p = g_position_at(window, depth);
    vec4 diffuse = textureLod(g_diffuse, window, 0.0);
    vec3 rho = diffuse.rgb;
    vec3 sum = vec3(0.0);
#ifdef GLOSSY
    float shininess = diffuse.w;
    vec3 gloss = vec3(0.0);
    vec3 v = g_toward_eye(p);
    float nv = dot(n, v);
    ALL(GLOSS)
    hdr = vec4(lambert(rho, sum, lambert_scale)
               + textureLod(g_specular, window, 0.0).rgb * gloss, 0.0);
#else
    ALL(DIFFUSE)
    hdr = vec4(lambert(rho, sum, lambert_scale), 0.0);
#endif
}
