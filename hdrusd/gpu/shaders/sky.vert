// One triangle over the whole screen at the farthest depth: pixels with a surface pass a depth
// test for "greater", those without one a test for "equal".
out vec2 window;  // 0 to 1 over the picture

void main()
{
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    window = corner * 0.5 + 0.5;
    gl_Position = vec4(corner, 1.0, 1.0);
}
