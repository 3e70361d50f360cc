//VTK::System::Dec
// A round dot of constant size on the screen at each centre.
#include "splat_inputs"
out vec2 corner;
flat out vec4 glyphColor;

void main()
{
  vec4 center = MCDCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  if (!isDrawn() || center.w <= 0.0) return;
  bool isMarked = (int(flagsVS[0] + 0.5) & 5) != 0;
  float diameter = pointPx * (isMarked ? 1.5 : 1.0);
  vec4 color = vec4(tinted(colorVS[0].rgb), diameter);
  for (int q = 0; q < 4; q++)
  {
    corner = CORNERS[q];
    glyphColor = color;
    gl_Position = vec4(center.xy + corner * diameter / (coarseness * viewportPx) * center.w, center.zw);
    EmitVertex();
  }
  EndPrimitive();
}
