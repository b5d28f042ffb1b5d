// Depth of a caster. CUTOUT: with its holes. TILES: what another atlas has there.
#ifdef CUTOUT
in vec2 uv;
uniform sampler2D opacity_image;
uniform int channel;
uniform float scale, bias, threshold;
#endif
#ifdef RESTORE
uniform sampler2D kept;
#endif

void main()
{
#ifdef CUTOUT
    if (texture(opacity_image, uv)[channel] * scale + bias < threshold)
        discard;
#endif
#ifdef RESTORE
    gl_FragDepth = texelFetch(kept, ivec2(gl_FragCoord.xy), 0).r;
#endif
}
