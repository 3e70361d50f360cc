//VTK::System::Dec
// A dot of constant size on the screen; an opaque colour marks the active one, which is larger.
layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
in vec4 colorVS[];
uniform mat4 MCDCMatrix;
//VTK::CustomUniforms::Dec
const vec2 CORNERS[4] = vec2[](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0));
out vec2 corner;
flat out vec4 glyphColor;
flat out float perPixel;    // length of a pixel, the dot's radius being 1

void main()
{
  vec4 center = MCDCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  if (center.w <= 0.0) return;
  float diameter = pointPx * (colorVS[0].a > 0.9 ? 1.25 : 1.0) + 2.0;
  for (int q = 0; q < 4; q++)
  {
    corner = CORNERS[q];
    glyphColor = colorVS[0];
    perPixel = 2.0 / diameter;
    gl_Position = vec4(center.xy + corner * diameter / viewportPx * center.w, center.zw);
    EmitVertex();
  }
  EndPrimitive();
}
