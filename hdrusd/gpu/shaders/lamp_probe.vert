// What single pixels of a frame show: light in cd/m2 with its distance along the view axis (m, 0
// where there is no surface), and whether that surface scatters nothing, as a drawn lamp does.
uniform sampler2D hdr;
uniform sampler2D g_normal;
uniform sampler2D g_diffuse;

in vec2 pixel;
out vec4 seen;
out float black;

void main()
{
    ivec2 at = ivec2(pixel);
    seen = vec4(texelFetch(hdr, at, 0).rgb, texelFetch(g_normal, at, 0).w);
    black = texelFetch(g_diffuse, at, 0).rgb == vec3(0.0) ? 1.0 : 0.0;
    gl_Position = vec4(0.0);
}
