//VTK::System::Dec
// A mark of constant size on the screen. The fourth channel says shape (dot, square, cross) and state (plain,
// chosen, active): 28 (1 + 3 shape + state) of 255. The active one is larger.
layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
in vec4 colorVS[];
uniform mat4 MCDCMatrix;
//VTK::CustomUniforms::Dec
const vec2 CORNERS[4] = vec2[](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0));
out vec2 corner;
flat out vec3 glyphColor;
flat out int shape;
flat out int state;
flat out float perPixel;    // length of a pixel, the dot's radius being 1

void main()
{
  vec4 center = MCDCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  if (center.w <= 0.0) return;
  int code = int(colorVS[0].a * 255.0 / 28.0 + 0.5) - 1;
  const float SIZES[3] = float[](1.0, 1.1, 2.0);
  float diameter = pointPx * SIZES[code / 3] * (code % 3 == 2 ? 1.3 : 1.0) + 2.0;
  for (int q = 0; q < 4; q++)
  {
    corner = CORNERS[q];
    glyphColor = colorVS[0].rgb;
    shape = code / 3;
    state = code % 3;
    perPixel = 2.0 / diameter;
    gl_Position = vec4(center.xy + corner * diameter / viewportPx * center.w, center.zw);
    EmitVertex();
  }
  EndPrimitive();
}
