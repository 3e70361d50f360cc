  // Depth in front of the eye; lifted towards the eye without a move on the screen.
  // liftBy: rows of the projection that make clip z of a depth, perspective or not, world units of lift.
  edgeDepth = dot(depthRow.xyz, vertexMC.xyz) + depthRow.w;
  float liftedDepth = edgeDepth - min(liftBy.w, 0.5 * abs(edgeDepth));
  float liftedW = liftBy.z > 0.5 ? liftedDepth : 1.0;
  if (liftedW > 0.0) gl_Position.z = (liftBy.y - liftBy.x * liftedDepth) / liftedW * gl_Position.w;
