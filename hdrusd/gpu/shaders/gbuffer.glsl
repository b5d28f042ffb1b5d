// The G-buffer, read: where a pixel's surface is and which way it faces.

uniform sampler2D g_normal;    // unit normal; distance along the view axis, m
uniform sampler2D g_diffuse;   // reflectance; shininess, or minus alpha of GGX
uniform sampler2D g_specular;  // reflectance at normal incidence; metallic
uniform vec3 ray_origin, ray_x, ray_y;  // the window's corner and sides at distance 1, m
uniform vec3 forward;          // unit vector along the view axis
uniform bool orthographic;     // then the window is in m and does not grow with distance

// Unit normal in the world; depth: m along the view axis.
vec3 g_normal_at(vec2 window, out float depth)
{
    vec4 value = textureLod(g_normal, window, 0.0);
    depth = value.w;
    return value.xyz;
}

// m, relative to the eye, in the world's directions.
vec3 g_position_at(vec2 window, float depth)
{
    vec3 across = ray_origin + window.x * ray_x + window.y * ray_y;
    return across * (orthographic ? 1.0 : depth) + forward * depth;
}

// Unit vector from a surface point (relative to the eye) to the eye.
vec3 g_toward_eye(vec3 position)
{
    return orthographic ? -forward : -normalize(position);
}
