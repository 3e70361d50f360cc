  if (edgeDepth < fadeRange.z) discard;
  float faded = fadeTo.a * clamp((edgeDepth - fadeRange.x) / max(fadeRange.y - fadeRange.x, 1e-20), 0.0, 1.0);
  gl_FragData[0] = vec4(mix(gl_FragData[0].rgb, fadeTo.rgb, faded), 1.0);
