//VTK::System::Dec
//VTK::Output::Dec
//VTK::CustomUniforms::Dec
in vec2 corner;
flat in vec4 glyphColor;   // a: diameter in pixels
//VTK::DepthPeeling::Dec
#include "dither"

void main()
{
  float square = dot(corner, corner);
  if (square > 1.0) discard;
  if (coverage < 1.0 && ditherThreshold() > coverage) discard;
  //VTK::DepthPeeling::PreColor
  // Dots of three pixels and more are rounded by a darker rim.
  float shade = glyphColor.a > 3.0 ? 1.0 - 0.35 * smoothstep(0.35, 1.0, square) : 1.0;
  gl_FragData[0] = vec4(glyphColor.rgb * shade, 1.0);
  //VTK::DepthPeeling::Impl
}
