//VTK::System::Dec
//VTK::Output::Dec
//VTK::CustomUniforms::Dec
in vec2 corner;
flat in vec4 glyphColor;   // lit colour; a = 1 marks selected and highlighted glyphs
//VTK::DepthPeeling::Dec
#include "dither"

void main()
{
  float radius = length(corner);
  // Reciprocal size in pixels of the screen; derivatives are taken before any discard.
  float perPixel = max(length(vec2(dFdx(radius), dFdy(radius))) / coarseness, 1e-6);
  if (radius > 1.0) discard;
  if (coverage < 1.0 && ditherThreshold() > coverage) discard;
  //VTK::DepthPeeling::PreColor
  // A rim about 1.3 px wide that fades away on glyphs too small to carry one.
  float edge = 1.0 - smoothstep(0.6, 1.8, (1.0 - radius) / perPixel);
  float strength = rimShare * smoothstep(0.25, 0.06, perPixel);
  vec3 rim = glyphColor.a > 0.5 ? min(glyphColor.rgb * 1.5 + 0.12, 1.0) : glyphColor.rgb * 0.72;
  gl_FragData[0] = vec4(mix(glyphColor.rgb, rim, edge * strength), 1.0);
  //VTK::DepthPeeling::Impl
}
