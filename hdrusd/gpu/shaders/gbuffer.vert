// Geometry of shader 1: camera-relative world space, metres.
in vec3 in_position;   // mesh space, scene units
in vec3 in_normal;
#ifdef FETCHES
in vec4 in_uv01;       // two texture coordinate sets, t up
in vec4 in_uv23;
out vec4 uv01;
out vec4 uv23;
#endif
#ifdef VERTEX_COLOR
in vec3 in_color;      // linear factor on the diffuse reflectance
out vec3 color;
#endif
in vec4 in_row0;       // per instance: columns of the row-vector matrix to world metres,
in vec4 in_row1;       // translation in w;
in vec4 in_row2;
in vec4 in_row3;       // what float32 loses of the translation; sign of the determinant

uniform vec3 eye_high, eye_low;  // m, and what float32 loses of it
uniform mat4 view_projection;    // camera-relative world to clip space
uniform vec3 forward;            // unit vector along the view axis

out float depth;                 // m along the view axis
out vec3 normal;
#ifdef NORMAL_MAP
out vec3 position;               // m, relative to the eye
#endif

void main()
{
    vec3 a = in_row0.xyz, b = in_row1.xyz, c = in_row2.xyz;
    // Far from the world's origin the large parts cancel exactly, the small ones matter.
    vec3 origin = (vec3(in_row0.w, in_row1.w, in_row2.w) - eye_high) + (in_row3.xyz - eye_low);
    vec3 place = vec3(dot(a, in_position), dot(b, in_position), dot(c, in_position)) + origin;
    depth = dot(place, forward);
    // Cofactor matrix: normals stay right under non-uniform scale, and no inverse is needed.
    normal = in_row3.w * vec3(dot(cross(b, c), in_normal), dot(cross(c, a), in_normal),
                              dot(cross(a, b), in_normal));
#ifdef NORMAL_MAP
    position = place;
#endif
#ifdef FETCHES
    uv01 = in_uv01;
    uv23 = in_uv23;
#endif
#ifdef VERTEX_COLOR
    color = in_color;
#endif
    gl_Position = view_projection * vec4(place, 1.0);
}
