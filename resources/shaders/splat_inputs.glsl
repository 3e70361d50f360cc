layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
in vec3 axisUVS[];
in vec3 axisVVS[];
in vec2 shapeVS[];
in vec4 colorVS[];
in float flagsVS[];
uniform mat4 MCDCMatrix;
uniform mat4 MCVCMatrix;
//VTK::CustomUniforms::Dec
// glyphScale    size factor
// opacityCut    splats fainter than this are not drawn
// viewportPx    width and height in pixels of the picture that is drawn
// coarseness    how many pixels of the screen one of these is wide and high
// selectTint, hoverTint, ghostTint, backfaceTint    colour and share of it
const vec2 CORNERS[4] = vec2[](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0));

bool isDrawn()
{
  return (int(flagsVS[0] + 0.5) & 2) == 0 && colorVS[0].a >= opacityCut && colorVS[0].a > 0.0;
}

vec3 tinted(vec3 color)
{
  int bits = int(flagsVS[0] + 0.5);
  color = mix(color, ghostTint.rgb, ghostTint.a);
  if ((bits & 1) != 0) color = mix(color, selectTint.rgb, selectTint.a);
  if ((bits & 4) != 0) color = mix(color, hoverTint.rgb, hoverTint.a);
  return color;
}
