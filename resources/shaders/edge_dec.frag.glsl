in float edgeDepth;
