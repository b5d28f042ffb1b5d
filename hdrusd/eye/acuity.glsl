// Reading between texels, for the blur of acuity; why by hand and the whole of it: acuity.py

// An image at a place in texels, bilinear, its edge continued; texel: 1 / size. The sampler is
// nearest and clamped. Texture filters keep 8 bits of a share: beside a lamp that is 1/512 of it.
vec4 mip_texel(sampler2D image, vec2 place, vec2 texel)
{
    vec2 base = floor(place - 0.5);
    vec2 part = place - 0.5 - base;
    vec4 at = (vec4(base, base + 1.0) + 0.5) * texel.xyxy;
    vec4 above = mix(textureLod(image, at.xy, 0.0), textureLod(image, at.zy, 0.0), part.x);
    vec4 below = mix(textureLod(image, at.xw, 0.0), textureLod(image, at.zw, 0.0), part.x);
    return mix(above, below, part.y);
}
