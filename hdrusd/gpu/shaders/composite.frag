// A layer as premultiplied colour, to be blended: cd/m2, and the share that it hides.
uniform sampler2D layer;   // cd/m2; w: that share, negative where the colour still lacks it
uniform vec2 pixel;        // 1 / size of layer

layout(location = 0) out vec4 premultiplied;

void main()
{
    vec4 value = textureLod(layer, gl_FragCoord.xy * pixel, 0.0);
    float hidden = abs(value.w);
    premultiplied = vec4(value.rgb * (value.w < 0.0 ? hidden : 1.0), hidden);
}
