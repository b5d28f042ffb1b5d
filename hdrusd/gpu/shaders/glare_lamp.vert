// Lamps as texels of a level of the glare pyramid, added by blending.
uniform vec2 size;  // texels of the level, with its margin

in vec2 place;  // column and row
in vec3 luminance;  // cd/m2
out vec3 light;

void main()
{
    light = luminance;
    gl_PointSize = 1.0;
    gl_Position = vec4((place + 0.5) / size * 2.0 - 1.0, 0.0, 1.0);
}
