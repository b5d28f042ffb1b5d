// Geometry of shader 1: camera-relative world space, metres.
in vec3 in_position;   // mesh space, scene units
in vec3 in_normal;
#ifdef TEXTURED
in vec4 in_uv01;       // two texture coordinate sets, t up
in vec4 in_uv23;
out vec4 uv01;
out vec4 uv23;
#endif
#ifdef VERTEX_COLOR
in vec3 in_color;      // linear factor on the diffuse reflectance
out vec3 color;
#endif
in vec4 in_row0;       // per instance: columns of the row-vector matrix to
in vec4 in_row1;       // camera-relative metres, translation in w
in vec4 in_row2;

uniform mat4 view_projection;  // camera-relative world to clip space
uniform vec3 forward;          // unit vector along the view axis
uniform float handedness;      // sign of the instance matrices' determinant

out float depth;                // m along the view axis
out vec3 normal;

void main()
{
    vec4 p = vec4(in_position, 1.0);
    vec3 position = vec3(dot(in_row0, p), dot(in_row1, p), dot(in_row2, p));
    // Cofactor matrix: normals stay right under non-uniform scale, and no inverse is needed.
    depth = dot(position, forward);
    vec3 a = in_row0.xyz, b = in_row1.xyz, c = in_row2.xyz;
    normal = handedness * vec3(dot(cross(b, c), in_normal), dot(cross(c, a), in_normal),
                               dot(cross(a, b), in_normal));
#ifdef TEXTURED
    uv01 = in_uv01;
    uv23 = in_uv23;
#endif
#ifdef VERTEX_COLOR
    color = in_color;
#endif
    gl_Position = view_projection * vec4(position, 1.0);
}
