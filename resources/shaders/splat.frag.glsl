//VTK::System::Dec
//VTK::Output::Dec
//VTK::CustomUniforms::Dec
in vec2 corner;
flat in vec4 glyphColor;
//VTK::DepthPeeling::Dec

void main()
{
  float square = dot(corner, corner);
  float alpha = glyphColor.a * exp(-0.5 * square);
  if (alpha < 1.0 / 255.0) discard;
  //VTK::DepthPeeling::PreColor
  gl_FragData[0] = vec4(glyphColor.rgb, alpha);
  //VTK::DepthPeeling::Impl
}
