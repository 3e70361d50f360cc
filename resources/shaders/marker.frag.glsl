//VTK::System::Dec
//VTK::Output::Dec
in vec2 corner;
flat in vec4 glyphColor;
flat in float perPixel;
//VTK::DepthPeeling::Dec

void main()
{
  float radius = length(corner);
  if (radius > 1.0) discard;
  //VTK::DepthPeeling::PreColor
  // Disc, rim (white on the active one, dark on the others), and a soft outer edge.
  vec3 rim = glyphColor.a > 0.9 ? vec3(1.0) : vec3(0.08);
  float inner = 1.0 - perPixel * 2.4;
  vec3 color = mix(glyphColor.rgb, rim, smoothstep(inner - perPixel, inner, radius));
  gl_FragData[0] = vec4(color, 1.0 - smoothstep(1.0 - 1.5 * perPixel, 1.0, radius));
  //VTK::DepthPeeling::Impl
}
