"""The method: surface-aware splat graph, Laplacian, deformers and kernel adaptation, on arrays alone."""
