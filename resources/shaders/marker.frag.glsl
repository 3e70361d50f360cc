//VTK::System::Dec
//VTK::Output::Dec
in vec2 corner;
flat in vec3 glyphColor;
flat in int shape;
flat in int state;
flat in float perPixel;
//VTK::DepthPeeling::Dec

// A ring with four ticks through it, light inside and dark at its edges: seen on any ground.
vec4 crosshair()
{
  float radius = length(corner);
  float ring = abs(radius - 0.6);
  float tick = radius < 0.35 || radius > 0.98 ? 1.0 : min(abs(corner.x), abs(corner.y));
  float away = min(ring, tick) / perPixel;
  if (away > 2.6) discard;
  return vec4(mix(glyphColor, vec3(0.05), smoothstep(0.8, 1.4, away)), 1.0 - smoothstep(1.8, 2.6, away));
}

// Disc or square with a rim, white on what is chosen and dark on the rest, and a soft outer edge.
vec4 disc()
{
  float radius = shape == 1 ? max(abs(corner.x), abs(corner.y)) : length(corner);
  if (radius > 1.0) discard;
  vec3 rim = state > 0 ? vec3(1.0) : vec3(0.08);
  float inner = 1.0 - perPixel * 2.4;
  vec3 color = mix(glyphColor, rim, smoothstep(inner - perPixel, inner, radius));
  // The head of the pin.
  if (shape == 1) color = mix(color, rim, 1.0 - smoothstep(perPixel, 2.0 * perPixel, length(corner) - 0.22));
  return vec4(color, 1.0 - smoothstep(1.0 - 1.5 * perPixel, 1.0, radius));
}

void main()
{
  //VTK::DepthPeeling::PreColor
  gl_FragData[0] = shape == 2 ? crosshair() : disc();
  //VTK::DepthPeeling::Impl
}
