//VTK::System::Dec
// Occupancy ellipse: a quad in the plane of the ellipse, so that perspective and depth are exact.
#include "splat_inputs"
out vec2 corner;
flat out vec4 glyphColor;

void main()
{
  float reach = shapeVS[0].y * glyphScale;
  vec3 across = cross(axisUVS[0], axisVVS[0]);
  if (!isDrawn() || reach <= 0.0 || dot(across, across) == 0.0) return;
  vec4 center = MCDCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  vec4 u = MCDCMatrix * vec4(axisUVS[0] * reach, 0.0);
  vec4 v = MCDCMatrix * vec4(axisVVS[0] * reach, 0.0);

  // Two soft lights fixed to the eye, from above left and from the right; the side that is seen is the lit one.
  vec3 normal = normalize(mat3(MCVCMatrix) * normalize(across));
  vec4 eyePoint = MCVCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  bool parallel = MCDCMatrix[0][3] == 0.0 && MCDCMatrix[1][3] == 0.0 && MCDCMatrix[2][3] == 0.0;
  vec3 toEye = parallel ? vec3(0.0, 0.0, 1.0) : -normalize(eyePoint.xyz);
  bool isBack = dot(normal, toEye) < 0.0;
  vec3 facing = isBack ? -normal : normal;
  float key = max(dot(facing, normalize(vec3(-0.45, 0.65, 0.75))), 0.0);
  float fill = max(dot(facing, normalize(vec3(0.80, -0.10, 0.55))), 0.0);
  vec3 color = colorVS[0].rgb;
  if (isBack) color = mix(color, backfaceTint.rgb, backfaceTint.a);
  color = tinted(color) * mix(1.0, 0.50 + 0.50 * key + 0.16 * fill, lightShare);
  for (int q = 0; q < 4; q++)
  {
    corner = CORNERS[q];
    glyphColor = vec4(color, (int(flagsVS[0] + 0.5) & 5) != 0 ? 1.0 : 0.0);
    gl_Position = center + u * corner.x + v * corner.y;
    EmitVertex();
  }
  EndPrimitive();
}
