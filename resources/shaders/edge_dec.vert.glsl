out float edgeDepth;
