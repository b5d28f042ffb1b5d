// The rectangle between four samples of the foveal image (gpu/vision.py).

in vec4 in_area;     // left, bottom, right, top, pixels
in vec4 in_corners;  // levels of the samples: left and right below, left and right above
in vec2 in_cell;     // column and row of the first of them

uniform vec2 size;   // of the frame, pixels

flat out vec4 corners;
flat out vec2 cell;

void main()
{
    vec2 at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(2.0 * mix(in_area.xy, in_area.zw, at) / size - 1.0, 0.0, 1.0);
    corners = in_corners;
    cell = in_cell;
}
