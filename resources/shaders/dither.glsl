// Screen-door transparency needs no sorting and never accumulates over layers.
float ditherThreshold()
{
  ivec2 p = ivec2(gl_FragCoord.xy) & 3;
  const float BAYER[16] = float[](0.0, 8.0, 2.0, 10.0, 12.0, 4.0, 14.0, 6.0, 3.0, 11.0, 1.0, 9.0, 15.0, 7.0, 13.0, 5.0);
  return (BAYER[p.y * 4 + p.x] + 0.5) / 16.0;
}
