//VTK::System::Dec
// EWA splatting (Zwicker et al. 2001, as in 3DGS): the projected covariance plus a 0.3 px^2 low-pass, as a screen-aligned quad.
#include "splat_inputs"
out vec2 corner;           // in standard deviations
flat out vec4 glyphColor;

const float LOW_PASS = 0.3;

vec3 row(mat4 m, int i) { return vec3(m[0][i], m[1][i], m[2][i]); }

void main()
{
  vec4 eyePoint = MCVCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  vec4 center = MCDCMatrix * vec4(gl_in[0].gl_Position.xyz, 1.0);
  if (!isDrawn() || center.w <= 0.0) return;

  mat3 view = mat3(MCVCMatrix);
  vec3 u = view * axisUVS[0] * glyphScale;
  vec3 v = view * axisVVS[0] * glyphScale;
  vec3 across = cross(u, v);
  float size = length(across);
  vec3 w = size > 0.0 ? across * (shapeVS[0].x * glyphScale / size) : vec3(0.0);

  // Focal lengths in pixels, from the ratio of the two matrices: no projection of its own is handed in.
  vec2 zoom = vec2(length(row(MCDCMatrix, 0)) / length(row(MCVCMatrix, 0)), length(row(MCDCMatrix, 1)) / length(row(MCVCMatrix, 1)));
  vec2 focal = 0.5 * zoom * viewportPx;
  vec3 jx = vec3(focal.x, 0.0, 0.0);
  vec3 jy = vec3(0.0, focal.y, 0.0);
  if (row(MCDCMatrix, 3) != vec3(0.0))
  {
    float depth = -eyePoint.z;
    // Outside the picture the linearisation explodes: it is taken no further out than 1.3 half pictures.
    vec2 slope = clamp(eyePoint.xy / depth, -1.3 / zoom, 1.3 / zoom);
    jx = focal.x / depth * vec3(1.0, 0.0, slope.x);
    jy = focal.y / depth * vec3(0.0, 1.0, slope.y);
  }
  vec3 x = vec3(dot(jx, u), dot(jx, v), dot(jx, w));
  vec3 y = vec3(dot(jy, u), dot(jy, v), dot(jy, w));
  float cxx = dot(x, x);
  float cyy = dot(y, y);
  float cxy = dot(x, y);
  // The low-pass widens what is narrower than a pixel. Of coarse pixels it takes as much opacity as the splat would
  // spread over more of the screen than the fine picture shows: the factor is exactly 1 where pixels are the screen's.
  float finer = LOW_PASS / (coarseness * coarseness);
  float shown = max((cxx + finer) * (cyy + finer) - cxy * cxy, 0.0);
  cxx += LOW_PASS;
  cyy += LOW_PASS;
  float alpha = colorVS[0].a;
  if (coarseness > 1.0) alpha *= min(sqrt(shown / (cxx * cyy - cxy * cxy)), 1.0);
  // The quad ends where the splat's own threshold or 1/255 of opacity cuts it off.
  float reach = min(shapeVS[0].y, sqrt(max(2.0 * log(255.0 * alpha), 0.0)));
  if (reach <= 0.0) return;

  float mean = 0.5 * (cxx + cyy);
  float spread = length(vec2(0.5 * (cxx - cyy), cxy));
  float major = mean + spread;
  float minor = max((cxx * cyy - cxy * cxy) / major, 0.05);
  vec2 e = abs(cxy) > 1e-6 * mean ? normalize(vec2(major - cyy, cxy)) : (cxx >= cyy ? vec2(1.0, 0.0) : vec2(0.0, 1.0));
  vec2 s1 = reach * sqrt(major) * e * 2.0 / viewportPx;
  vec2 s2 = reach * sqrt(minor) * vec2(-e.y, e.x) * 2.0 / viewportPx;
  if (any(greaterThan(abs(center.xy) - (abs(s1) + abs(s2)) * center.w, vec2(center.w)))) return;
  vec4 color = vec4(tinted(colorVS[0].rgb), alpha * coverage);
  for (int q = 0; q < 4; q++)
  {
    corner = CORNERS[q] * reach;
    glyphColor = color;
    gl_Position = vec4(center.xy + (s1 * CORNERS[q].x + s2 * CORNERS[q].y) * center.w, center.zw);
    EmitVertex();
  }
  EndPrimitive();
}
